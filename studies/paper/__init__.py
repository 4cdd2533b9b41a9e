"""The paper's figures with engine and theory, and a comparison with its measurements and statements.

Uses finished sweeps (the numbers of the engine), `walkers.theory`, and the observations of the calibration ``ruby``.
"""
