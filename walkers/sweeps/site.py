"""Site files: the cluster on which a sweep runs.

    scheduler = "slurm"
    partition = "main"
    walltime  = "02:00:00"
    cores     = 32
    jobs      = 4

Parsl submits the jobs. A job is a pilot: it starts workers, and each worker runs one deck after another until none is
left.
"""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator

from walkers.errors import InputError, Problem, expected_of, refused
from walkers.extras import require
from walkers.inputs.keys import value_at
from walkers.inputs.messages import quoted, validated
from walkers.inputs.toml import read_toml
from walkers.inputs.units import Whole
from walkers.text import printable

if TYPE_CHECKING:
    from parsl.config import Config

_OURS = {
    # Key of a site file: its names in Parsl's providers.
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
"""Providers by name; a site file may also give the class name of another provider of Parsl."""
_GUARDED = ("setsid", "setpriv", "--pdeathsig", "TERM")
"""Prefix of the command that starts Parsl's interchange. Ctrl-C must not end the interchange, because Parsl waits for
its last message. If the sweep is killed, the interchange must end, so that the pilots notice and end, too."""
_MOST_LOSSES = 5  # repetitions of a deck whose worker was lost (a cancelled job, a node that went down)
_SHELL_TEXTS = ("scheduler_options", "worker_init", "launch_cmd", "interchange_launch_cmd", "regex_job_id")
"""Settings of Parsl that are shell commands, and a regular expression that no shell reads."""
# SLURM replaces patterns such as %N in paths; a job whose output cannot be written ends at once.
_ODD = re.compile(r"[^\w./+@=,:-]")
_TAKEN = "expected letters, digits and . _ / + @ = , : -"
_Count = Annotated[Whole, Field(ge=1, le=10_000)]


class Site(BaseModel):
    """A cluster, as its site file describes it."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    scheduler: str = Field(examples=["slurm"])
    partition: str | None = None
    account: str | None = None
    walltime: Annotated[str, Field(pattern=r"^\d+:\d\d:\d\d$")] | None = Field(
        None, description="hours, minutes and seconds", examples=["02:00:00"]
    )
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


def load_site(path: str | Path) -> Site:
    """Read a site file; `InputError` if it is invalid, with Parsl's message if Parsl refuses it."""
    require("cluster")
    document = read_toml(Path(path))
    site = validated(Site, document, str(path), "a site")
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
    """Names of launchers in site files (``srun``) and in Parsl (``SrunLauncher``)."""
    import parsl.launchers

    return {name.removesuffix("Launcher").lower(): name for name in parsl.launchers.__all__ if name[:4] != "Wrap"}


def check_path(folder: Path) -> None:
    """Refuse a sweep's folder with a space, a quote or the like in it: Parsl writes it into shell scripts unquoted."""
    for source, text in (("out", str(folder.parent.resolve())), (printable(folder.name), folder.name)):
        if odd := _ODD.search(text):
            raise refused(source, f"with a site file {_TAKEN} in the path, found {odd[0]!r} in {text!r}")


def pilots(site: Site, run_dir: Path, ranks: int = 1) -> Config:
    """Parsl's configuration for decks of a number of MPI processes; the nodes must see ``run_dir`` (scripts, logs)."""
    import parsl.launchers
    import parsl.providers
    from parsl.config import Config
    from parsl.executors import HighThroughputExecutor
    from parsl.executors.high_throughput.executor import DEFAULT_LAUNCH_CMD
    from parsl.jobs.error_handlers import windowed_error_handler

    name = _SCHEDULERS.get(site.scheduler, site.scheduler)
    provider_class = getattr(parsl.providers, name)
    taken = inspect.signature(provider_class).parameters
    # Nodes are shared with other jobs unless [provider] says otherwise; without work there are no jobs.
    ours = {"worker_init": _worker_init(site), "exclusive": False, "min_blocks": 0}
    settings = {key: value for key, value in ours.items() if key in taken}
    for key, names in _OURS.items():
        theirs = next((one for one in names if one in taken), None)
        if theirs is not None or (key in site.model_fields_set and key != "cores"):  # Parsl refuses an unknown key
            settings[theirs or key] = getattr(site, key)
    settings = {key: value for key, value in settings.items() if value is not None}
    # With several nodes, srun starts the workers of each node.
    launcher = site.launcher or ("srun" if name == "SlurmProvider" and site.nodes > 1 else None)
    if launcher is not None:
        settings["launcher"] = getattr(parsl.launchers, _launchers()[launcher])()
    options: dict[str, Any] = {
        "max_workers_per_node": site.cores // ranks,
        "heartbeat_period": 10,
        "heartbeat_threshold": 60,
        "block_error_handler": windowed_error_handler,
        "worker_logdir_root": str(run_dir),
        "interchange_launch_cmd": [*_GUARDED, str(Path(sys.executable).with_name("interchange.py"))],
    }
    if site.container:
        options["launch_cmd"] = f"{site.container} {DEFAULT_LAUNCH_CMD}"
    if name == "LocalProvider":  # pilots on this machine; by default Parsl accepts connections from everywhere
        options["address"] = "127.0.0.1"
    provider = provider_class(**(settings | _as_tuples(site.provider)))
    executor = HighThroughputExecutor(label="pilots", provider=provider, **(options | _as_tuples(site.executor)))
    return Config(
        executors=[executor],
        run_dir=str(run_dir),
        strategy="simple",
        strategy_period=2,
        retries=_MOST_LOSSES,
        retry_handler=_cost_of_failure,
    )


def _as_tuples(table: Mapping[str, Any]) -> dict[str, Any]:
    """Settings with tuples instead of lists: Parsl expects tuples, and TOML has only lists."""
    return {key: tuple(value) if isinstance(value, list) else value for key, value in table.items()}


def _cost_of_failure(error: Exception, _: object) -> float:
    """Share of the retries that a failure uses up: Parsl repeats a deck only if its worker was lost."""
    from parsl.executors.high_throughput.errors import ManagerLost, WorkerLost

    return 1.0 if isinstance(error, (ManagerLost, WorkerLost)) else _MOST_LOSSES + 1.0


def _worker_init(site: Site) -> str:
    """Shell lines before the workers: load the modules, the lines of the site file, this Python first in PATH."""
    modules = [f"module load {quote(name)}" for name in site.modules]
    return "\n".join([*modules, *site.shell, f'export PATH={quote(str(Path(sys.executable).parent))}:"$PATH"'])
