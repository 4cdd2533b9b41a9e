"""The laws that a deck stands on, one file a law, in plain numbers of SI units: its equation and source at the top.

The resolved case (forces at rest, the time step), the audit and the theory all take them from here.
"""
