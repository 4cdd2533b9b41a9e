"""Sites of sweeps: the cores of this machine, or the cluster of a site file.

    scheduler = "slurm"
    partition = "main"
    walltime  = "02:00:00"
    cores     = 32
    jobs      = 4

The scheduling on a cluster is Parsl's. Jobs of a cluster are pilots: each holds workers that take deck after deck until
none is left.
"""

from __future__ import annotations

import inspect
import os
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator

from walkers.inputs.changes import value_at
from walkers.inputs.errors import InputError, Problem, refused
from walkers.inputs.extras import require
from walkers.inputs.library import expected_of
from walkers.inputs.messages import quoted, validated
from walkers.inputs.reading import read_toml
from walkers.physics.units import Whole

if TYPE_CHECKING:
    from parsl.config import Config

_OURS = {
    # Our key: what one or the other of Parsl's providers calls it.
    "partition": ("partition", "queue"),
    "account": ("account", "allocation", "project"),
    "walltime": ("walltime",),
    "nodes": ("nodes_per_block",),
    "cores": ("cores_per_node", "cpus_per_node"),
    "jobs": ("max_blocks",),
}
_SCHEDULERS = {
    "slurm": "SlurmProvider",
    "pbs": "PBSProProvider",
    "torque": "TorqueProvider",
    "lsf": "LSFProvider",
    "grid-engine": "GridEngineProvider",
    "condor": "CondorProvider",
    "local": "LocalProvider",
}
"""Names of our own; the class names of Parsl's other providers are taken as they are."""
_GUARDED = ("setsid", "setpriv", "--pdeathsig", "TERM")
"""How Parsl's interchange is started: out of Ctrl-C's reach, for Parsl waits for its word at the end; and mortal, so
that the pilots of a sweep that was killed miss it and end too."""
_MOST_LOSSES = 5  # how often a deck is given out again after its worker was lost (a cancelled job, a node gone down)
_SHELL_TEXTS = ("scheduler_options", "worker_init", "launch_cmd", "interchange_launch_cmd", "regex_job_id")
"""Settings of Parsl's that are lines or commands by what they are, and one that no shell sees."""
# SLURM fills in what stands behind a per cent sign, and its jobs end at once where their output cannot go.
_ODD = re.compile(r"[^\w./+@=,:-]")
_TAKEN = "expected letters, digits and . _ / + @ = , : -"
_Count = Annotated[Whole, Field(ge=1, le=10_000)]


class SiteFile(BaseModel):
    """A site file."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    scheduler: str
    partition: str | None = None
    account: str | None = None
    walltime: Annotated[str, Field(pattern=r"^\d+:\d\d:\d\d$")] | None = None
    nodes: _Count = 1
    cores: _Count
    jobs: _Count = 1
    modules: list[str] = []
    shell: list[str] = []
    launcher: str | None = None
    container: str | None = None
    provider: dict[str, Any] = {}
    executor: dict[str, Any] = {}

    @field_validator("scheduler", "launcher")
    @classmethod
    def _check_known(cls, name: str, info: ValidationInfo) -> str:
        import parsl.providers

        if info.field_name == "launcher" and name not in _launchers():
            raise ValueError(expected_of(name, sorted(_launchers())))
        if info.field_name == "scheduler" and name not in (*_SCHEDULERS, *parsl.providers.__all__):
            raise ValueError(f"{expected_of(name, _SCHEDULERS)}, or a provider of Parsl's")
        return name


@dataclass(frozen=True)
class Site:
    """A cluster as its file describes it, and MPI processes (ranks) of its decks: a node takes so many decks fewer."""

    file: SiteFile
    ranks: int = 1

    @property
    def workers_per_node(self) -> int:
        """How many decks run at once on a node."""
        return max(1, self.file.cores // self.ranks)

    @property
    def workers(self) -> int:
        """How many decks run at once."""
        return self.workers_per_node * self.file.nodes * self.file.jobs


def cores_here() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0))


def load_site(path: str | Path) -> Site:
    """Read a site file; `InputError` tells what is wrong with it, in Parsl's words if it is Parsl that refuses it."""
    require("cluster")
    document = read_toml(Path(path))
    site = Site(validated(SiteFile, document, str(path), "a site"))
    settings = [[table, key] for table in ("provider", "executor") for key in document.get(table, ())]
    for place in (["partition"], ["account"], *settings):
        value = value_at(document, place)
        for text in value if isinstance(value, list) else [value]:
            if isinstance(text, str) and place[-1] not in _SHELL_TEXTS and (odd := _ODD.search(text)):
                expected = f"{_TAKEN}, found {odd[0]!r}; [provider] scheduler_options takes whole lines of a script"
                raise InputError(str(path), [Problem(".".join(place), quoted(document, place), expected)])
    try:
        pilots(site, Path("parsl"))
    except Exception as error:  # whatever Parsl's classes raise about what they are given
        message = " ".join(str(error).split())
        raise refused(path, f"Parsl cannot use it: {message}") from error
    return site


def _launchers() -> Mapping[str, str]:
    """Our names for Parsl's launchers (``srun``) and theirs (``SrunLauncher``)."""
    import parsl.launchers

    return {name.removesuffix("Launcher").lower(): name for name in parsl.launchers.__all__ if name[:4] != "Wrap"}


def check_path(folder: Path) -> None:
    """Refuse a folder with a space, a quote or the like in its path: Parsl writes it into shell scripts as it is."""
    whole = str(folder.resolve())
    if odd := _ODD.search(whole):
        raise refused("--out", f"with a site file {_TAKEN} in the path, found {odd[0]!r} in {whole!r}")


def pilots(site: Site, run_dir: Path) -> Config:
    """Parsl's configuration for a cluster; its scripts and logs go to a folder that the nodes must see."""
    import parsl.launchers
    import parsl.providers
    from parsl.config import Config
    from parsl.executors import HighThroughputExecutor
    from parsl.executors.high_throughput.executor import DEFAULT_LAUNCH_CMD
    from parsl.jobs.error_handlers import windowed_error_handler

    file = site.file
    name = _SCHEDULERS.get(file.scheduler, file.scheduler)
    provider_class = getattr(parsl.providers, name)
    taken = inspect.signature(provider_class).parameters
    # A node is shared with others unless the provider table says otherwise; jobs come and go with the work.
    ours = {"worker_init": _worker_init(file), "exclusive": False, "min_blocks": 0}
    settings = {key: value for key, value in ours.items() if key in taken}
    for key, names in _OURS.items():
        theirs = next((one for one in names if one in taken), None)
        if theirs is not None or (key in file.model_fields_set and key != "cores"):  # then it is Parsl's to refuse it
            settings[theirs or key] = getattr(file, key)
    settings = {key: value for key, value in settings.items() if value is not None}
    # On several nodes each needs a step of its own to start its workers.
    launcher = file.launcher or ("srun" if name == "SlurmProvider" and file.nodes > 1 else None)
    if launcher is not None:
        settings["launcher"] = getattr(parsl.launchers, _launchers()[launcher])()
    options: dict[str, Any] = {
        "max_workers_per_node": site.workers_per_node,
        "heartbeat_period": 10,
        "heartbeat_threshold": 60,
        "block_error_handler": windowed_error_handler,
        "worker_logdir_root": str(run_dir),
        "interchange_launch_cmd": [*_GUARDED, str(Path(sys.executable).with_name("interchange.py"))],
    }
    if file.container:
        options["launch_cmd"] = f"{file.container} {DEFAULT_LAUNCH_CMD}"
    if name == "LocalProvider":  # pilots on this machine: nobody else is to be listened to, and Parsl listens to all
        options["address"] = "127.0.0.1"
    provider = provider_class(**(settings | _as_tuples(file.provider)))
    executor = HighThroughputExecutor(label="pilots", provider=provider, **(options | _as_tuples(file.executor)))
    return Config(
        executors=[executor],
        run_dir=str(run_dir),
        strategy="simple",
        strategy_period=2,
        retries=_MOST_LOSSES,
        retry_handler=_cost_of_failure,
    )


def _as_tuples(table: Mapping[str, Any]) -> dict[str, Any]:
    """Parsl's ranges are tuples, while TOML has lists only."""
    return {key: tuple(value) if isinstance(value, list) else value for key, value in table.items()}


def _cost_of_failure(error: Exception, _: object) -> float:
    """What Parsl counts a task's failure for: it may be lost with its worker, and not fail otherwise."""
    from parsl.executors.high_throughput.errors import ManagerLost, WorkerLost

    return 1.0 if isinstance(error, (ManagerLost, WorkerLost)) else _MOST_LOSSES + 1.0


def _worker_init(file: SiteFile) -> str:
    """Shell lines before the workers: the modules, the site's own lines, and this Python first on the path."""
    modules = [f"module load {quote(name)}" for name in file.modules]
    return "\n".join([*modules, *file.shell, f'export PATH={quote(str(Path(sys.executable).parent))}:"$PATH"'])
