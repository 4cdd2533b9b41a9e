"""The analyses: one class per module, found by `walkers.postprocess.analysis`."""
