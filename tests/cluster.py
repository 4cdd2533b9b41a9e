"""A throw-away SLURM cluster for tests, and a site without a scheduler.

The cluster has one node, this machine, and daemons of its own, which touch no other cluster.
"""

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

pilots = HighThroughputExecutor(
    provider=LocalProvider(),
    address="127.0.0.1",
    max_workers_per_node=2,
    heartbeat_period=1,
    heartbeat_threshold=3,
)
config = Config([pilots], strategy_period=0.5)
"""
"""A site file: pilots on this machine without a scheduler."""


def why_not() -> str | None:
    """Why there can be no cluster here, or None."""
    missing = []
    for name in ("munged", "slurmctld", "slurmd", "sbatch"):
        if shutil.which(name, path=_PATH) is None:
            missing.append(name)
    if missing:
        return f"a throw-away SLURM cluster needs {', '.join(missing)}"
    if os.getuid() != 0:
        return "a throw-away SLURM cluster is for root"
    return None


@contextmanager
def slurm_cluster(folder: Path) -> Iterator[dict[str, str]]:
    """Start a cluster with its files in a folder, and stop it at the end.

    Parameters
    ----------
    folder
        An empty folder. Munge insists that others can write neither to it nor to those above.

    Yields
    ------
    dict
        The environment in which the commands of SLURM speak to the cluster.
    """
    for name in ("state", "spool", "munge"):
        (folder / name).mkdir()
    host = socket.gethostname().split(".")[0]
    configuration = folder / "slurm.conf"
    configuration.write_text(
        _CONFIGURATION.format(
            host=host,
            folder=folder,
            cores=os.cpu_count(),
            memory=_megabytes_of_memory() - 512,
            ports=_free_ports(2),
        )
    )
    environment = {**os.environ, "PATH": _PATH, "SLURM_CONF": str(configuration)}

    def answer(command: str, columns: str) -> bytes:
        """What a command of SLURM prints; nothing if no daemon answers."""
        process = subprocess.run(
            [command, "-h", "-o", columns], env=environment, capture_output=True, check=False
        )
        return process.stdout.strip()

    try:
        _start_munge(folder / "munge")
        for daemon in (["slurmctld"], ["slurmd", "-N", host]):
            subprocess.run([*daemon, "-f", str(configuration)], check=True, env=environment)
        wait_for(lambda: answer("sinfo", "%T") == b"idle")
        yield environment
    finally:
        subprocess.run(
            ["scancel", "--user", "root"], env=environment, check=False, capture_output=True
        )
        wait_for(lambda: not answer("squeue", "%A"))
        for pid_file in (folder / "slurmd.pid", folder / "slurmctld.pid", folder / "munge" / "pid"):
            with suppress(OSError, ValueError):  # it did not start, or has ended
                os.kill(int(pid_file.read_text()), signal.SIGTERM)


def _free_ports(number: int) -> list[int]:
    """Ports of this machine that are free; they are all open before any is closed again."""
    probes = [socket.create_server(("127.0.0.1", 0)) for _ in range(number)]
    ports = []
    for probe in probes:
        ports.append(probe.getsockname()[1])
        probe.close()
    return ports


def _megabytes_of_memory() -> int:
    """Memory of this machine, MiB."""
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2**20


def _start_munge(folder: Path) -> None:
    """Start the daemon by which those of SLURM know each other, as the user munge."""
    key = folder / "key"
    key.write_bytes(os.urandom(128))
    key.chmod(0o600)
    shutil.chown(folder, "munge", "munge")
    shutil.chown(key, "munge", "munge")
    as_munge = ["setpriv", "--reuid", "munge", "--regid", "munge", "--clear-groups"]
    options = [
        f"--socket={folder / 'socket'}",
        f"--key-file={key}",
        f"--pid-file={folder / 'pid'}",
        f"--log-file={folder / 'log'}",
        f"--seed-file={folder / 'seed'}",
    ]
    subprocess.run([*as_munge, str(shutil.which("munged", path=_PATH)), *options], check=True)
