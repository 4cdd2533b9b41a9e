"""Physical laws, one file each, with equation and source; all numbers are in SI units.

The resolved case (forces at rest, time step), the audit and the theory use them.
"""
