"""Calibration of unpublished parameters to published numbers: designs, emulators, posteriors.

The experiments are sweeps. All physics is in the calibration file (`walkers.calibration.file`)
and in the engine.
"""
