"""Physical laws, one file each, with equation and source, in plain numbers of SI units.

The resolved case (forces at rest, the time step), the audit and the theory all take them from here.
"""
