"""Figures, pictures, films and reports of runs, and files for ParaView and LAMMPS."""
