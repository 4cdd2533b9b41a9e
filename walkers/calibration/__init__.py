"""Calibration of unpublished parameters to published numbers: designs, emulators, posterior, predictions.

It stands on the sweeps; the physics is in the calibration file (`walkers.inputs.calibration`) and in the engine alone.
"""
