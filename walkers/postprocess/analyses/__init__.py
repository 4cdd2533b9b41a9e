"""The analyses: each a class in a module of its own here, found by `walkers.postprocess.analysis`."""
