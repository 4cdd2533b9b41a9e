"""Reports of runs: one HTML file with tables, figures and a scene that plays.

It needs no network. Reports of sweeps use the same page.
"""
