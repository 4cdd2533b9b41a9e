"""Sites: the cluster on which a sweep runs, as a file of SLURM's settings, or as a ``parsl.Config`` for any other.

    partition = "main"
    walltime  = "02:00:00"
    cores     = 32
    jobs      = 4

Parsl submits the jobs. A job is a pilot: it starts workers, and each worker runs one deck after another until none is
left.
"""

from __future__ import annotations

import re
import runpy
import sys
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from walkers.errors import input_error
from walkers.extras import require
from walkers.inputs.messages import validated
from walkers.inputs.toml import read_toml
from walkers.inputs.units import Whole
from walkers.text import printable

if TYPE_CHECKING:
    from parsl.config import Config

_GUARDED = ("setsid", "setpriv", "--pdeathsig", "TERM")
"""Prefix of the command that starts Parsl's interchange. Ctrl-C must not end the interchange, because Parsl waits for
its last message. If the sweep is killed, the interchange must end, so that the pilots notice and end, too."""
_MOST_LOSSES = (
    5  # repetitions of a deck whose worker was lost (a cancelled job, a node that went down)
)
# SLURM replaces patterns such as %N in paths; a job whose output cannot be written ends at once.
_ODD = re.compile(r"[^\w./+@=,:-]")
_TAKEN = "letters, digits and . _ / + @ = , : -"
_Count = Annotated[Whole, Field(ge=1, le=10_000)]
_Word = Annotated[str, Field(pattern=r"^[\w./+@=,:-]+$")]


class Slurm(BaseModel):
    """A cluster under SLURM, as its site file describes it."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    # Parsl writes words into shell scripts unquoted.
    partition: _Word | None = Field(None, description=_TAKEN)
    account: _Word | None = Field(None, description=_TAKEN)
    walltime: Annotated[str, Field(pattern=r"^\d+:\d\d:\d\d$")] = Field(
        "00:10:00", description="hours, minutes and seconds", examples=["02:00:00"]
    )
    nodes: _Count = 1
    cores: _Count
    jobs: _Count = 1
    sbatch: list[str] = []
    shell: list[str] = []
    container: str | None = None
    address: _Word | None = Field(None, description=_TAKEN)

    def config(self) -> Config:
        """Parsl's configuration. Without work there are no jobs; they share their nodes with others."""
        from parsl.config import Config
        from parsl.executors import HighThroughputExecutor
        from parsl.executors.high_throughput.executor import DEFAULT_LAUNCH_CMD
        from parsl.jobs.error_handlers import windowed_error_handler
        from parsl.launchers import SingleNodeLauncher, SrunLauncher
        from parsl.providers import SlurmProvider

        provider = SlurmProvider(
            self.partition,
            self.account,
            walltime=self.walltime,
            nodes_per_block=self.nodes,
            cores_per_node=self.cores,
            max_blocks=self.jobs,
            exclusive=False,
            scheduler_options="\n".join(f"#SBATCH {option}" for option in self.sbatch),
            worker_init="\n".join(self.shell),
            launcher=SrunLauncher() if self.nodes > 1 else SingleNodeLauncher(),
        )
        executor = HighThroughputExecutor(
            provider=provider,
            launch_cmd=f"{self.container} {DEFAULT_LAUNCH_CMD}" if self.container else None,
            address=self.address,
            max_workers_per_node=self.cores,
            heartbeat_period=10,
            heartbeat_threshold=60,
            block_error_handler=windowed_error_handler,
        )
        return Config([executor], strategy_period=2)


def load_site(path: str | Path) -> Config:
    """Parsl's configuration by a site file: a `Slurm` in TOML, or Python that calls its configuration ``config``.

    `InputError` if the file cannot be used.
    """
    require("cluster")
    from parsl.config import Config

    if Path(path).suffix != ".py":
        return validated(Slurm, read_toml(Path(path)), str(path), "a site").config()
    try:
        config = runpy.run_path(str(path)).get("config")
    except Exception as error:  # whatever the user's file raises
        raise input_error(
            path, f"cannot be used: {type(error).__name__}: {' '.join(str(error).split())}"
        ) from error
    if not isinstance(config, Config):
        raise input_error(path, "expected a configuration: config = parsl.Config(...)")
    return config


def check_path(folder: Path) -> None:
    """Refuse a sweep's folder with a space, a quote or the like in it: Parsl writes it into shell scripts unquoted."""
    for source, text in (
        ("out", str(folder.parent.resolve())),
        (printable(folder.name), folder.name),
    ):
        if odd := _ODD.search(text):
            raise input_error(
                source,
                f"with a site file expected {_TAKEN} in the path, found {odd[0]!r} in {text!r}",
            )


def decks_at(config: Config, ranks: int) -> int:
    """Number of decks that run at once at a site, on all nodes of all jobs, each with a number of MPI processes."""
    from parsl.executors.status_handling import BlockProviderExecutor

    return sum(
        int(executor.workers_per_node // ranks)
        * executor.provider.nodes_per_block
        * executor.provider.max_blocks
        for executor in config.executors
        if isinstance(executor, BlockProviderExecutor) and executor.provider is not None
    )


def prepare(config: Config, folder: Path, ranks: int) -> Config:
    """The configuration for decks of a number of MPI processes; the nodes must see the folder (scripts, logs)."""
    from parsl.executors import HighThroughputExecutor

    config.run_dir, config.retries, config.retry_handler = (
        str(folder),
        _MOST_LOSSES,
        _cost_of_failure,
    )
    for executor in config.executors:
        if isinstance(executor, HighThroughputExecutor):
            executor.worker_logdir_root = str(folder)
            executor.interchange_launch_cmd = [
                *_GUARDED,
                str(Path(sys.executable).with_name("interchange.py")),
            ]
            executor.max_workers_per_node = executor.workers_per_node // ranks
            provider: Any = executor.provider
            provider.worker_init += (
                f'\nexport PATH={quote(str(Path(sys.executable).parent))}:"$PATH"\n'
            )
    return config


def _cost_of_failure(error: Exception, _: object) -> float:
    """Share of the retries that a failure uses up: Parsl repeats a deck only if its worker was lost."""
    from parsl.executors.high_throughput.errors import ManagerLost, WorkerLost

    return 1.0 if isinstance(error, (ManagerLost, WorkerLost)) else _MOST_LOSSES + 1.0
