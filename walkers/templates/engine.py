"""Start of the engine: version and environment variables."""

from __future__ import annotations

AUDITED_VERSION = "LIGGGHTS-PUBLIC 3.8.0"
"""The audited version of the engine."""

POSITION_IS_NO_NUMBER = "a bead's position is no number"
"""Part of the ERROR line for a bead whose position is not a number."""

STEP_VARIABLES = ("SLURM_STEP_ID", "SLURM_STEPID", "SLURM_PROCID")
"""Variables of the environment that the engine must not see."""

ALONE = {
    "OMPI_MCA_ess_singleton_isolated": "1",  # no orted
    "OMPI_MCA_orte_create_session_dirs": "0",  # no folder in TMPDIR
    "OMPI_MCA_btl": "self",  # no network
    "OMPI_MCA_pml": "ob1",  # no search for a network, which takes half of the time
}
"""Environment of an engine of one process; with only the first variable, 14 of 1,500 starts failed."""

RANKS = {
    "OMPI_MCA_btl": "self,vader",
    "OMPI_MCA_pml": "ob1",
    "OMPI_MCA_mpi_yield_when_idle": "1",
    "OMPI_MCA_plm": "isolated",  # no ssh, which containers lack
}
"""Environment of an engine of several processes on one machine, which communicate by shared memory.

mpirun itself listens on the network (`walkers.runner.launch` leaves it only the loopback). Two ranks start in 0.7 of
the time. Waiting ranks yield their core: beside four busy processes, a pile took a quarter of the time.
"""
