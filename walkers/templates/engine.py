"""Start of the engine: version and environment variables."""

from __future__ import annotations

AUDITED_VERSION = "LIGGGHTS-PUBLIC 3.8.0"
"""The audited version of the engine."""

POSITION_IS_NO_NUMBER = "a bead's position is no number"
"""In the ERROR line of an engine that has met a bead whose position is no number."""

STEP_VARIABLES = ("SLURM_STEP_ID", "SLURM_STEPID", "SLURM_PROCID")
"""Variables of the environment that the engine must not see."""

ALONE = {
    "OMPI_MCA_ess_singleton_isolated": "1",  # no orted
    "OMPI_MCA_orte_create_session_dirs": "0",  # no folder in TMPDIR
    "OMPI_MCA_btl": "self",  # no network
    "OMPI_MCA_pml": "ob1",  # no look for one either, which takes half of the time
}
"""Variables of the environment of an engine of one process; with the first alone 14 starts of 1,500 failed."""

RANKS = {"OMPI_MCA_btl": "self,vader", "OMPI_MCA_pml": "ob1", "OMPI_MCA_mpi_yield_when_idle": "1"}
"""Variables of the environment of an engine of several processes on one machine: they meet in its memory.

`mpirun` itself listens on the network that it sees (`walkers.runner.launch` leaves it the loopback); started so, two
ranks take 0.7 of the time to start. Ranks that wait leave
their core to others: beside four busy processes a pile took a quarter of the time.
"""
