"""One run: its name, preview, making, status, comparison and removal; decks that are run by hand.

Many runs are made and compared in `walkers.sweeps`.
"""
