"""Sites of sweeps: what Parsl is given, workers of other processes and of SLURM."""

import signal
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from ipaddress import ip_address
from pathlib import Path

import psutil
import pytest

from tests.cluster import LOCAL, slurm_cluster, why_not
from tests.conftest import PATIENCE, PROGRAM, call, document, processes_in, to_toml, wait_for
from tests.test_scheduler import TINY, contents_of
from walkers.errors import InputError
from walkers.inputs.sweep import load_sweep
from walkers.runner.launch import _off_the_network
from walkers.sweeps.scheduler import Options
from walkers.sweeps.site import Slurm, check_path, decks_at, load_site, prepare
from walkers.sweeps.table import load


def test_what_parsl_is_told(tmp_path: Path) -> None:
    file = {"partition": "main", "account": "granular", "walltime": "02:00:00", "nodes": 2, "jobs": 4, "cores": 16}
    file |= {"shell": ["module load openmpi", "ulimit -c 0"], "sbatch": ["--qos=long", "--mem=4G"]}
    (tmp_path / "site.toml").write_text(to_toml(file | {"address": "10.1.0.1", "container": "apptainer exec w.sif"}))
    config = load_site(tmp_path / "site.toml")
    assert [decks_at(config, ranks) for ranks in (1, 3, 17)] == [2 * 16 * 4, 2 * 5 * 4, 0]
    (executor,) = prepare(config, tmp_path / "parsl", 3).executors
    provider = executor.provider
    told = {"partition": "main", "account": "granular", "walltime": "02:00:00", "exclusive": False, "min_blocks": 0}
    told |= {"nodes_per_block": 2, "cores_per_node": 16, "max_blocks": 4}
    assert {name: getattr(provider, name) for name in told} == told
    assert type(provider.launcher).__name__ == "SrunLauncher"
    assert provider.worker_init.splitlines()[:2] == ["module load openmpi", "ulimit -c 0"]
    assert {"#SBATCH --qos=long", "#SBATCH --mem=4G"} <= {*provider.scheduler_options.splitlines()}
    assert (executor.max_workers_per_node, executor.address, executor.encrypted) == (5, "10.1.0.1", True)
    assert executor.launch_cmd.startswith("apptainer exec w.sif process_worker_pool.py ")


def test_workers_of_another_process_give_the_same(in_folder: Path, front: Callable[[str], str]) -> None:
    """Pilots without a scheduler. The first engine ends its worker, whose deck is repeated."""
    lost = f"grep -q spawn_main /proc/$PPID/cmdline && mkdir {in_folder}/once && kill -9 $PPID"
    engine = front(f'{lost}\nexec liggghts "$@"')
    (in_folder / "base.toml").write_text(to_toml(document(run=TINY)))
    (in_folder / "test.toml").write_text('case = "base.toml"\n[axes]\nrun.time_step = ["2 us", "1 us"]\n')
    (in_folder / "site.py").write_text(LOCAL)
    there = [PROGRAM, "sweep", "test.toml", "--out", "there", "--site", "site.py", "--engine", engine]
    program = subprocess.Popen(there, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    call("sweep", "test.toml", "--out", "here", "-j", "2", "--engine", engine, check=True)  # meanwhile
    _, errors = program.communicate(timeout=PATIENCE)
    assert program.returncode == 0, errors
    assert contents_of(in_folder / "here") == contents_of(in_folder / "there") != {}
    assert "WorkerLost" in "".join(log.read_text() for log in in_folder.glob("there/test/parsl/*/parsl.log"))


def _reachable(process: psutil.Process) -> Iterator[str]:
    """What a process listens on, or takes datagrams at, that others than this machine may reach."""
    devices = Path(f"/proc/{process.pid}/net/dev").read_text().splitlines()[2:]
    for one in process.net_connections("inet") if [line.split(":")[0].strip() for line in devices] != ["lo"] else ():
        here = ip_address(one.laddr.ip.partition("%")[0].removeprefix("::ffff:")) if one.laddr else None
        if here is not None and not here.is_loopback and not one.raddr:
            yield f"{process.name()} {one.type.name} {one.laddr}"


@pytest.mark.parametrize(("site", "ranks"), [("", 2), (LOCAL, 1)])
def test_nothing_listens_beyond_this_machine(in_folder: Path, site: str, ranks: int) -> None:
    """Not the program, mpirun and the engines; nor Parsl's interchange, pilots and workers.

    Plain engines of one rank are looked at by `test_stopped`.
    """
    if ranks > 1 and not _off_the_network():
        pytest.skip("mpirun listens on every address where nobody may have a network of his own")
    settings = {"run.ranks": ranks, "run.duration": "100 s"}
    sweep = {"case": "pile-ci", "set": settings, "axes": {"run.seed": [1, 2]}}
    (in_folder / "test.toml").write_text(to_toml(sweep))
    (in_folder / "site.py").write_text(site)
    command = [PROGRAM, "sweep", "test.toml", *(["--site", "site.py"] if site else ["-j", "2"])]
    program = subprocess.Popen(command, start_new_session=True, stderr=subprocess.DEVNULL)
    found: set[str] = set()

    def looked() -> bool:
        """Until beads have moved in two processes."""
        assert program.poll() is None
        for pid in {*processes_in(in_folder), *(one.pid for one in psutil.Process(program.pid).children(True))}:
            with suppress(psutil.Error, OSError):
                found.update(_reachable(psutil.Process(pid)))
        dumps = [dump for dump in in_folder.glob("runs/**/beads.bin") if dump.stat().st_size > 1000]
        return len(dumps) * ranks >= 2

    try:
        wait_for(looked)
    finally:
        program.terminate()
        program.wait(timeout=PATIENCE)
    assert not found


# --- a throw-away cluster ---------------------------------------------------------------------------------------------


SITE = {"partition": "main", "address": "127.0.0.1", "cores": 1, "jobs": 2, "sbatch": ["--comment=decks"]}
# Twelve frequencies, a deck each; at the fifth the time step is far beyond the viscous limit of glycerol.
STEPS = [*["2 us"] * 4, "40 us", *["2 us"] * 7]
ZIP = {"drive.frequency": {"linspace": ["60 Hz", "71 Hz", 12]}, "run.time_step": STEPS}
SWEEP = {"case": "base.toml", "set": {"run.allow_unstable": True}, "zip": [ZIP]}
RUN = {"cycles": 40, "settling_cycles": 2, "samples_per_cycle": 5}


@pytest.fixture(scope="module")
def cluster() -> Iterator[dict[str, str]]:
    """The environment in which SLURM's commands speak to the cluster."""
    if reason := why_not():
        pytest.skip(reason)
    with tempfile.TemporaryDirectory(prefix="slurm-", ignore_cleanup_errors=True) as folder:
        Path(folder).chmod(0o711)
        with slurm_cluster(Path(folder)) as environment:
            yield environment


def test_a_sweep_through_slurm(cluster: dict[str, str], in_folder: Path, front: Callable[[str], str]) -> None:
    """A failing point, a pilot cancelled midway, an interrupt and a resumption: bit for bit what this machine gives."""
    (in_folder / "base.toml").write_text(to_toml(document(liquid={"name": "glycerol 87 %"}, run=RUN)))
    (in_folder / "test.toml").write_text(to_toml(SWEEP))
    (in_folder / "site.toml").write_text(to_toml(SITE))
    # Ten launches are enough for six points, though one fails and one is cancelled; twelve points need two more.
    log, go = in_folder / "launches", in_folder / "go"
    waits = f"[ $(wc -l < {log}) -le 10 ] || while ! [ -e {go} ]; do sleep 0.1; done"
    command = ["sweep", "test.toml", "--engine", front(f'echo >> {log}\n{waits}\nexec liggghts "$@"'), "--out"]

    def start() -> subprocess.Popen[str]:
        through = [PROGRAM, *command, "cluster", "--site", "site.toml"]
        return subprocess.Popen(through, env=cluster, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)

    def jobs(*options: str) -> list[str]:
        told = subprocess.run(["squeue", "-h", "-o", "%A", *options], env=cluster, capture_output=True, check=True)
        return told.stdout.decode().split()

    def has(least: int) -> bool:
        assert first.poll() is None
        return len(contents_of(in_folder / "cluster")) >= least

    first = start()
    wait_for(lambda: has(2))
    pilot, *_ = jobs("-t", "running")
    subprocess.run(["scancel", pilot], env=cluster, check=True)
    wait_for(lambda: has(6))
    assert pilot not in jobs()
    first.send_signal(signal.SIGINT)
    _, errors = first.communicate(timeout=PATIENCE)
    assert (first.returncode, "Traceback" in errors) == (130, False)
    wait_for(lambda: not jobs())
    go.touch()
    second = start()
    _, errors = second.communicate(timeout=PATIENCE)
    assert (second.returncode, "point 4, base-" in errors, "blow-up" in errors) == (1, True, True), errors
    wait_for(lambda: not jobs())
    assert list(load("cluster/test")["status"]) == ["finished"] * 4 + ["failed"] + ["finished"] * 7
    assert call(*command, "local").returncode == 1
    assert contents_of(in_folder / "cluster") == contents_of(in_folder / "local") != {}


def test_ranks_take_cores_of_this_machine_and_of_a_cluster() -> None:
    site = Slurm(cores=8, nodes=2).config()
    assert Options(6, site).for_ranks(2).decks_at_once == 8
    assert Options(6).for_ranks(2).decks_at_once == 3
    with pytest.raises(InputError, match="16 MPI processes"):
        Options(6, site).for_ranks(16)


BAD = {
    'partition = "main"': "toml: cores: missing",
    "cores = 1000000000": "toml: cores = 1000000000: expected .*at most 10000",
    'cores = 2\npartitoin = "main"': 'toml: partitoin = .*did you mean "partition"',
    'cores = 2\nwalltime = "2h"': 'toml: walltime = "2h": expected hours, minutes and seconds',
    # What a shell, or SLURM, would take for more.
    **{
        f"cores = 2\n{key} = '{text}'": f"toml: {key} = .*: expected letters"
        for key in ("partition", "account", "address")
        for text in ("$(touch pwned)", "a b", "a;b", "100%N")
    },
    "import walkers": "py: expected a configuration: config = parsl.Config",
    "import parsl\nconfig = parsl.Config([1])": "py: cannot be used: AttributeError: ",
}


def test_a_site_that_makes_no_sense(tmp_path: Path) -> None:
    for text, told in BAD.items():
        name = f"site.{told.partition(':')[0]}"
        (tmp_path / name).write_text(text)
        with pytest.raises(InputError, match=f"site.{told}"):
            load_site(tmp_path / name)
    for odd in ("100%N", "$(touch pwned)", "a b"):
        with pytest.raises(InputError, match=r"^out: .* expected letters"):
            check_path(tmp_path / odd / "fig2")
    check_path(tmp_path / load_sweep("fig4", {"contact.rolling_friction": 0.01, "contact.restitution": 0.5}).name)
