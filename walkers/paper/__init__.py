"""The paper's figures with engine and theory, and the facts that it measured or states beside ours.

Uses finished sweeps (the numbers of the engine), `walkers.theory`, and the observations of the calibration ``ruby``.
"""
