"""A throw-away SLURM cluster of one node: this machine, under daemons of its own that touch no other; a local site."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from tests.conftest import wait_for

_PATH = f"{os.environ['PATH']}:/usr/sbin:/sbin"
_CONFIGURATION = """\
ClusterName=throwaway
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
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
SchedulerParameters=sched_interval=1,bf_interval=1,batch_sched_delay=0,sched_min_interval=0
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
config = Config([pilots], strategy_period=0.5)
"""
"""A site file: pilots on this machine without a scheduler."""


def why_not() -> str | None:
    """Why there can be no cluster here, or None."""
    missing = [
        name
        for name in ("munged", "slurmctld", "slurmd", "sbatch")
        if shutil.which(name, path=_PATH) is None
    ]
    if missing or os.getuid():
        return f"a throw-away SLURM cluster is for root; missing: {', '.join(missing) or 'nothing'}"
    return None


@contextmanager
def slurm_cluster(folder: Path) -> Iterator[dict[str, str]]:
    """Start a cluster with its files in a folder; yields the environment in which SLURM's commands speak to it.

    The folder and those above it must be closed to others, which munge insists on.
    """
    probes = [socket.create_server(("127.0.0.1", 0)) for _ in range(2)]
    ports = [probe.getsockname()[1] for probe in probes]
    for probe in probes:
        probe.close()
    host, cores = socket.gethostname().split(".")[0], os.cpu_count()
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2**20 - 512
    for name in ("state", "spool", "munge"):
        (folder / name).mkdir()
    configuration = folder / "slurm.conf"
    configuration.write_text(
        _CONFIGURATION.format(host=host, folder=folder, cores=cores, memory=memory, ports=ports)
    )
    environment = {**os.environ, "PATH": _PATH, "SLURM_CONF": str(configuration)}

    def asked(program: str, what: str) -> bytes:
        """What a command of SLURM says; nothing if nobody answers."""
        told = subprocess.run(
            [program, "-h", "-o", what], env=environment, capture_output=True, check=False
        )
        return told.stdout.strip()

    try:
        _start_munge(folder / "munge")
        for daemon in (["slurmctld"], ["slurmd", "-N", host]):
            subprocess.run([*daemon, "-f", str(configuration)], check=True, env=environment)
        wait_for(lambda: asked("sinfo", "%T") == b"idle")
        yield environment
    finally:
        subprocess.run(
            ["scancel", "--user", "root"], env=environment, check=False, capture_output=True
        )
        wait_for(lambda: not asked("squeue", "%A"))
        for pid_file in (folder / "slurmd.pid", folder / "slurmctld.pid", folder / "munge" / "pid"):
            with suppress(OSError, ValueError):
                os.kill(int(pid_file.read_text()), signal.SIGTERM)


def _start_munge(folder: Path) -> None:
    (folder / "key").write_bytes(os.urandom(128))
    (folder / "key").chmod(0o600)
    for path in (folder, folder / "key"):
        shutil.chown(path, "munge", "munge")
    places = {
        "socket": "socket",
        "key-file": "key",
        "pid-file": "pid",
        "log-file": "log",
        "seed-file": "seed",
    }
    options = [f"--{name}={folder / place}" for name, place in places.items()]
    as_munge = ["setpriv", "--reuid", "munge", "--regid", "munge", "--clear-groups"]
    subprocess.run([*as_munge, str(shutil.which("munged", path=_PATH)), *options], check=True)
