"""Pictures, films, figures, reports, and files for ParaView and LAMMPS of what a run has measured."""
