"""Processes of the engine: how they are started, isolated from the user's settings, and ended.

What the engine writes is judged in `walkers.runner.launch`.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache

from walkers.warning import warn_user

ALONE = {
    "OMPI_MCA_ess_singleton_isolated": "1",  # no orted
    "OMPI_MCA_orte_create_session_dirs": "0",  # no folder in TMPDIR; Open MPI 5 ignores it
    "OMPI_MCA_btl": "self",  # no network
    "OMPI_MCA_pml": "ob1",  # no search for a network, which takes half of the time
}
"""Environment of an engine of one process.

With only the first variable, 14 of 1,500 starts failed.
"""
_RANKS = {
    "OMPI_MCA_btl": "self,vader",  # shared memory; two ranks start in 0.7 of the time
    "OMPI_MCA_pml": "ob1",
    "OMPI_MCA_mpi_yield_when_idle": "1",
    "OMPI_MCA_plm": "isolated",  # no ssh, which containers lack
}
"""Environment of an engine of several processes.

Ranks that wait yield their core: beside four busy processes, a pile took a quarter of the time.
"""
_HIDDEN = ("OMPI_MCA_", "SLURM_STEP_ID", "SLURM_STEPID", "SLURM_PROCID", "LD_PRELOAD")
"""First letters of variables of the environment that the engine must not see.

A user's Open MPI settings for a cluster, such as the network, may not work on one machine. The
loader would report the LD_PRELOAD of the user as an ERROR before the engine starts.
"""
_DIES_WITH_PARENT = ("setpriv", "--pdeathsig", "KILL")
"""Command by which the kernel ends the engine when its launcher dies, even by SIGKILL."""
_UNLESS_ORPHAN = ("sh", "-c", '[ "$PPID" = "$0" ] && exec "$@"')
"""Command that starts nothing if its parent is another process than the launcher.

The kernel does not notice a launcher that died before `_DIES_WITH_PARENT` asked for it.
"""
_MPIRUN = ("mpirun", "--allow-run-as-root", "--oversubscribe", "--bind-to", "none", "-n")
"""Command that starts several ranks.

By default, mpirun refuses root and more ranks than cores, and binds all decks to the same cores.
"""
_WITH_LOOPBACK = ("sh", "-c", 'PATH="$PATH:/usr/sbin:/sbin" ip link set lo up && exec "$@"', "sh")
"""Command that starts another one with a loopback network.

mpirun always listens on every address that it finds; with only a loopback, no other machine can
reach it.
"""
_UNSHARE_AS_ROOT = ("unshare", "--net")
"""Command that takes the network away from a program, for root."""
_UNSHARE_AS_USER = ("unshare", "--net", "--map-current-user", "--keep-caps")
"""The same for a user, who needs a user namespace."""
_GRACE_SECONDS = 2.0
"""Time between SIGTERM and SIGKILL."""


def cores_here() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0))


def start_command(ranks: int) -> tuple[str, ...]:
    """The command that starts the engine so that it ends with its launcher.

    Parameters
    ----------
    ranks
        Number of MPI processes. Several have no access to the network.

    Returns
    -------
    tuple of str
        Words that stand before the command of the engine.
    """
    dies_with_parent: tuple[str, ...] = ()
    unless_orphan: tuple[str, ...] = ()
    if shutil.which(_DIES_WITH_PARENT[0]):
        dies_with_parent = _DIES_WITH_PARENT
        unless_orphan = (*_UNLESS_ORPHAN, str(os.getpid()))
    if ranks == 1:
        return (*dies_with_parent, *unless_orphan)
    # With --oversubscribe, waiting ranks yield their core to any program: beside one, steps take
    # 30 times as long.
    yields = int(ranks > cores_here())
    return (
        *off_the_network(),
        *dies_with_parent,
        *unless_orphan,
        *_MPIRUN,
        str(ranks),
        "--mca",
        "mpi_yield_when_idle",
        str(yields),
        *dies_with_parent,
    )


@cache
def off_the_network() -> tuple[str, ...]:
    """Command that starts a program with only a loopback network; empty if that is forbidden."""
    for unshare in (_UNSHARE_AS_ROOT, _UNSHARE_AS_USER):
        prefix = (*unshare, *_WITH_LOOPBACK)
        with suppress(OSError, subprocess.CalledProcessError):
            subprocess.run(
                [*prefix, "true"], stdin=subprocess.DEVNULL, capture_output=True, check=True
            )
            return prefix
    warn_user(
        "mpirun listens on all networks: unshare (util-linux) and ip (iproute2), which take them "
        "away, are missing or forbidden"
    )
    return ()


@contextmanager
def engine_environment(ranks: int) -> Iterator[dict[str, str]]:
    """The environment of an engine for as long as it runs: the user's, without `_HIDDEN`.

    A single process has a folder for temporary files of its own, which is removed at the end of
    the block. Open MPI 5 makes a folder in TMPDIR at each start and leaves it there; if it cannot
    make it, the engine goes on without MPI and dies of SIGSEGV. The folder is in /tmp, or where
    else files can be written, if TMPDIR of the user does not exist or is read-only.

    Parameters
    ----------
    ranks
        Number of MPI processes.
    """
    inherited = {name: value for name, value in os.environ.items() if not name.startswith(_HIDDEN)}
    if ranks > 1:
        yield inherited | _RANKS
        return
    with tempfile.TemporaryDirectory(prefix="walkers-", ignore_cleanup_errors=True) as folder:
        yield inherited | ALONE | {"TMPDIR": folder}


@contextmanager
def postponed_interrupts() -> Iterator[None]:
    """Delay signals that end the program to the end of the block.

    A signal within `subprocess.Popen` could leave behind an engine that nobody ends. Only the main
    thread receives signals; in other threads nothing is delayed.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    caught: list[int] = []

    def catch(number: int, _frame: object) -> None:
        caught.append(number)

    handlers = {}
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        handlers[number] = signal.signal(number, catch)
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        for interrupt in caught:
            signal.raise_signal(interrupt)


def end_process(process: subprocess.Popen[bytes]) -> None:
    """End the engine and all of its children, first with SIGTERM, then with SIGKILL."""
    if process.poll() is None:
        with suppress(ProcessLookupError, subprocess.TimeoutExpired):
            os.killpg(process.pid, signal.SIGTERM)
            process.wait(_GRACE_SECONDS)
    # Children may outlive their parent or ignore SIGTERM.
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
