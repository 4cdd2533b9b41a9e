"""The paper's figures with engine and theory, and a comparison with its measurements.

`make` runs the missing points of the shipped sweeps, draws the figures and writes the comparison.
The facts are the observations of the calibration ``ruby``.
"""
