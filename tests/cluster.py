"""A throw-away SLURM cluster of one node: this machine, under daemons of its own that touch no other; a local site."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "setpriv")
_CONFIGURATION = """\
ClusterName=throwaway
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller_port}
SlurmdPort={node_port}
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge/socket
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
SchedulerParameters=sched_interval=5,bf_interval=5,batch_sched_delay=0,sched_min_interval=0
DefMemPerCPU=500
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} RealMemory={memory} State=UNKNOWN
PartitionName=main Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""

LOCAL = """\
from parsl import Config
from parsl.executors import HighThroughputExecutor
from parsl.providers import LocalProvider

hearts = {"heartbeat_period": 1, "heartbeat_threshold": 3}
pilots = HighThroughputExecutor(provider=LocalProvider(), address="127.0.0.1", max_workers_per_node=2, **hearts)
config = Config([pilots], strategy_period=2)
"""
"""A site file: pilots on this machine without a scheduler."""


def why_not() -> str | None:
    """Why there can be no cluster here, or None."""
    if os.getuid() != 0:
        return "a throw-away SLURM cluster can only be started by root"
    missing = [name for name in _PROGRAMS if _path_of(name) is None]
    if missing:
        return f"{', '.join(missing)} not found: apt-get install slurm-wlm munge"
    return None


def _path_of(name: str) -> str | None:
    return shutil.which(name, path=f"{os.environ['PATH']}:/usr/sbin:/sbin")


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextmanager
def slurm_cluster(folder: Path) -> Iterator[dict[str, str]]:
    """Start a cluster with its files in a folder; yields the environment in which SLURM's commands speak to it.

    The folder and those above it must be closed to others, which munge insists on.
    """
    host = socket.gethostname().split(".")[0]
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2**20 - 512
    for name in ("state", "spool", "munge"):
        (folder / name).mkdir()
    configuration = folder / "slurm.conf"
    ports = {"controller_port": _free_port(), "node_port": _free_port()}
    cores = os.cpu_count()
    configuration.write_text(_CONFIGURATION.format(host=host, folder=folder, cores=cores, memory=memory, **ports))
    environment = {**os.environ, "SLURM_CONF": str(configuration)}
    try:
        _start_munge(folder / "munge")
        for daemon, options in (("slurmctld", []), ("slurmd", ["-N", host])):
            subprocess.run([str(_path_of(daemon)), "-f", str(configuration), *options], check=True, env=environment)
        _wait_until_idle(environment)
        yield environment
    finally:
        subprocess.run(["scancel", "--user", "root"], env=environment, check=False, capture_output=True)
        time.sleep(1.0)
        for pid_file in (folder / "slurmd.pid", folder / "slurmctld.pid", folder / "munge" / "pid"):
            with suppress(OSError, ValueError):
                _stop(int(pid_file.read_text()))


def _stop(pid: int) -> None:
    os.kill(pid, signal.SIGTERM)
    for _ in range(100):
        if not Path(f"/proc/{pid}/exe").exists():  # gone, or a zombie of whoever should have reaped it
            return
        time.sleep(0.1)
    os.kill(pid, signal.SIGKILL)


def _start_munge(folder: Path) -> None:
    (folder / "key").write_bytes(os.urandom(128))
    (folder / "key").chmod(0o600)
    for path in (folder, folder / "key"):
        shutil.chown(path, "munge", "munge")
    places = {"socket": "socket", "key-file": "key", "pid-file": "pid", "log-file": "log", "seed-file": "seed"}
    options = [f"--{name}={folder / place}" for name, place in places.items()]
    as_munge = ["setpriv", "--reuid", "munge", "--regid", "munge", "--clear-groups"]
    subprocess.run([*as_munge, str(_path_of("munged")), *options], check=True)


def _wait_until_idle(environment: dict[str, str]) -> None:
    for _ in range(300):
        told = subprocess.run(["sinfo", "-h", "-o", "%T"], env=environment, capture_output=True, text=True, check=False)
        if told.stdout.strip() == "idle":
            return
        time.sleep(0.1)
    raise AssertionError(f"the node does not come up: {told.stdout}{told.stderr}")
