"""Sites: the cluster on which a sweep runs.

A site file has SLURM's settings, or in Python a ``parsl.Config`` for any other cluster:

    partition = "main"
    walltime  = "02:00:00"
    cores     = 32
    jobs      = 4

Parsl submits the jobs. A job is a pilot: it starts workers, and each worker runs one deck after
another until none is left. The *interchange* is a process that Parsl starts beside the sweep: it
passes decks and results between the sweep and the pilots.
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
"""Prefix of the command that starts Parsl's interchange.

Ctrl-C must not end the interchange, because Parsl waits for its last message. If the sweep is
killed, the interchange must end, so that the pilots notice and end, too.
"""
_MOST_LOSSES = 5
"""How often a deck is repeated whose worker was lost (a cancelled job, a node that went down)."""
_REFUSED_LETTER = re.compile(r"[^\w./+@=,:-]")
"""A letter that Parsl's shell scripts or SLURM's paths cannot have.

SLURM replaces patterns such as %N in paths; a job whose output cannot be written ends at once.
"""
_ACCEPTED_LETTERS = "letters, digits and . _ / + @ = , : -"
"""The other letters, for messages."""
_Count = Annotated[Whole, Field(ge=1, le=10_000)]
"""A number of nodes, cores or jobs."""
_Word = Annotated[str, Field(pattern=r"^[\w./+@=,:-]+$")]
"""A word of accepted letters."""


class Slurm(BaseModel):
    """A cluster under SLURM, as its site file describes it.

    Attributes
    ----------
    partition, account
        SLURM's options of these names.
    walltime
        Longest time of a job: hours, minutes and seconds.
    nodes, cores
        Number of nodes of a job, and of cores of a node.
    jobs
        Largest number of jobs at the same time.
    sbatch
        Further options of ``sbatch``, such as ``--mem=4G``.
    shell
        Lines of shell that each job runs first.
    container
        Command that runs the workers in a container.
    address
        Address at which the nodes reach the machine that runs the sweep.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    # Parsl writes words into shell scripts unquoted.
    partition: _Word | None = Field(None, description=_ACCEPTED_LETTERS)
    account: _Word | None = Field(None, description=_ACCEPTED_LETTERS)
    walltime: Annotated[str, Field(pattern=r"^\d+:\d\d:\d\d$")] = Field(
        "00:10:00", description="hours, minutes and seconds", examples=["02:00:00"]
    )
    nodes: _Count = 1
    cores: _Count
    jobs: _Count = 1
    sbatch: list[str] = []
    shell: list[str] = []
    container: str | None = None
    address: _Word | None = Field(None, description=_ACCEPTED_LETTERS)

    def config(self) -> Config:
        """Parsl's configuration.

        Without work there are no jobs. Jobs share their nodes with those of other users.
        """
        from parsl.config import Config
        from parsl.executors import HighThroughputExecutor
        from parsl.executors.high_throughput.executor import DEFAULT_LAUNCH_CMD
        from parsl.jobs.error_handlers import windowed_error_handler
        from parsl.launchers import SingleNodeLauncher, SrunLauncher
        from parsl.providers import SlurmProvider

        launch_command = None
        if self.container:
            launch_command = f"{self.container} {DEFAULT_LAUNCH_CMD}"
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
            launch_cmd=launch_command,
            address=self.address,
            max_workers_per_node=self.cores,
            heartbeat_period=10,  # s
            heartbeat_threshold=60,  # s without a sign of life after which a worker is lost
            block_error_handler=windowed_error_handler,
        )
        return Config([executor], strategy_period=2)


def load_site(path: str | Path) -> Config:
    """Parsl's configuration by a site file.

    Parameters
    ----------
    path
        A file in TOML with the fields of `Slurm`, or in Python with a variable ``config``, a
        ``parsl.Config``.

    Raises
    ------
    InputError
        If the file cannot be used.
    """
    require("cluster")
    from parsl.config import Config

    if Path(path).suffix != ".py":
        return validated(Slurm, read_toml(Path(path)), str(path), "a site").config()
    try:
        config = runpy.run_path(str(path)).get("config")
    except Exception as error:  # whatever the user's file raises
        reason = " ".join(str(error).split())
        raise input_error(path, f"cannot be used: {type(error).__name__}: {reason}") from error
    if not isinstance(config, Config):
        raise input_error(path, "expected a configuration: config = parsl.Config(...)")
    return config


def check_path(folder: Path) -> None:
    """Refuse a sweep's folder whose path has a space, a quote or the like.

    Parsl writes the path into shell scripts unquoted.
    """
    _check_letters("out", str(folder.parent.resolve()))
    _check_letters(printable(folder.name), folder.name)


def _check_letters(source: str, text: str) -> None:
    """Refuse a part of a path with letters that are not accepted; the message names its source."""
    refused = _REFUSED_LETTER.search(text)
    if refused:
        raise input_error(
            source,
            f"with a site file expected {_ACCEPTED_LETTERS} in the path, "
            f"found {refused[0]!r} in {text!r}",
        )


def decks_at(config: Config, ranks: int) -> int:
    """Number of decks that run at once at a site, on all nodes of all jobs.

    Zero if a node has fewer cores than a deck has processes. Executors of Parsl that get no nodes
    from a provider do not count.

    Parameters
    ----------
    config
        The configuration of the site.
    ranks
        Number of MPI processes of a deck.
    """
    from parsl.executors.status_handling import BlockProviderExecutor

    decks = 0
    for executor in config.executors:
        if isinstance(executor, BlockProviderExecutor) and executor.provider is not None:
            nodes = executor.provider.nodes_per_block * executor.provider.max_blocks
            decks += int(executor.workers_per_node // ranks) * nodes
    return decks


def prepare(config: Config, folder: Path, ranks: int) -> Config:
    """Change the configuration of a site for the decks of a sweep, and return it.

    Decks of lost workers are repeated, the interchange ends with the sweep and not with Ctrl-C, and
    a node has as many workers as it has cores for their processes.

    Parameters
    ----------
    config
        The configuration, which is changed.
    folder
        Where Parsl writes its scripts and logs; the nodes must see this folder.
    ranks
        Number of MPI processes of a deck, at most the number of cores of a node
        (`walkers.sweeps.scheduler.SweepOptions.for_ranks` refuses more).
    """
    from parsl.executors import HighThroughputExecutor

    programs = Path(sys.executable).parent
    config.run_dir = str(folder)
    config.retries = _MOST_LOSSES
    config.retry_handler = _cost_of_failure
    for executor in config.executors:
        if isinstance(executor, HighThroughputExecutor):
            executor.worker_logdir_root = str(folder)
            interchange = str(programs / "interchange.py")
            executor.interchange_launch_cmd = [*_GUARDED, interchange]
            executor.max_workers_per_node = executor.workers_per_node // ranks
            # A job starts with the PATH of its node, on which Parsl's worker need not be.
            provider: Any = executor.provider
            provider.worker_init += f'\nexport PATH={quote(str(programs))}:"$PATH"\n'
    return config


def _cost_of_failure(error: Exception, _: object) -> float:
    """How many of the `_MOST_LOSSES` repetitions of a deck a failure uses up.

    One if the worker was lost; more than there are for every other error, so that Parsl does not
    repeat the deck.
    """
    from parsl.executors.high_throughput.errors import ManagerLost, WorkerLost

    if isinstance(error, (ManagerLost, WorkerLost)):
        return 1.0
    return _MOST_LOSSES + 1.0
