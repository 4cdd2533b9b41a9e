"""Calibration of unpublished parameters to published numbers: designs, emulators, posterior, predictions.

It uses sweeps; all physics is in the calibration file (`walkers.calibration.file`) and in the engine.
"""
