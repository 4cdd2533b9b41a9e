"""Sweeps on a real SLURM cluster: a throw-away one of this machine alone, started by the tests as root."""

import signal
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.cluster import slurm_cluster, why_not
from tests.conftest import PATIENCE, PROGRAM, call, document, to_toml, wait_for
from tests.test_sweeps import contents_of
from walkers.sweeps.table import load

HEARTS = {"address": "127.0.0.1", "heartbeat_period": 1, "heartbeat_threshold": 5}
SITE = {"scheduler": "slurm", "partition": "main", "walltime": "00:10:00", "cores": 2, "jobs": 2, "executor": HEARTS}
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


@pytest.fixture
def files(in_folder: Path) -> Path:
    (in_folder / "base.toml").write_text(to_toml(document(liquid={"name": "glycerol 87 %"}, run=RUN)))
    (in_folder / "test.toml").write_text(to_toml(SWEEP))
    (in_folder / "site.toml").write_text(to_toml(SITE))
    front, log, go = in_folder / "front", in_folder / "launches", in_folder / "go"
    # Ten launches are enough for six points, though one fails and two are cancelled; twelve points need two more.
    front.write_text(
        f"""#!/bin/sh
        echo >> {log}
        [ $(wc -l < {log}) -le 10 ] || while ! [ -e {go} ]; do sleep 0.1; done
        exec liggghts "$@"
        """
    )
    front.chmod(0o755)
    return in_folder


def _jobs(environment: dict[str, str], *options: str) -> list[str]:
    command = ["squeue", "-h", "-o", "%A", *options]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.split()


def _sweep(environment: dict[str, str]) -> subprocess.Popen[str]:
    command = [PROGRAM, "sweep", "test.toml", "--engine", "./front", "--site", "site.toml", "--out", "cluster"]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.mark.slow
def test_a_sweep_through_slurm(cluster: dict[str, str], files: Path) -> None:
    """A failing point, a pilot cancelled midway, an interrupt and a resumption: bit for bit what this machine gives."""

    def at_least(number: int) -> Callable[[], bool]:
        return lambda: first.poll() is not None or len(contents_of(files / "cluster")) >= number

    first = _sweep(cluster)
    wait_for(at_least(2))
    pilot, *_ = _jobs(cluster, "-t", "running")  # the other one may have to wait for cores
    subprocess.run(["scancel", pilot], env=cluster, check=True)
    wait_for(at_least(6))
    assert first.poll() is None
    assert pilot not in _jobs(cluster)
    first.send_signal(signal.SIGINT)
    _, errors = first.communicate(timeout=PATIENCE)
    assert (first.returncode, "Traceback" in errors) == (130, False)
    wait_for(lambda: not _jobs(cluster))
    left = contents_of(files / "cluster")
    assert 6 <= len(left) < 11
    (files / "go").touch()
    second = _sweep(cluster)
    _, errors = second.communicate(timeout=PATIENCE)
    assert second.returncode == 1
    assert "point 4, base-" in errors
    assert "blow-up" in errors
    wait_for(lambda: not _jobs(cluster))
    frame = load(files / "cluster" / "test")
    assert list(frame["status"]) == ["finished"] * 4 + ["failed"] + ["finished"] * 7
    local = call("sweep", "test.toml", "--engine", "./front", "--out", "local")
    assert local.returncode == 1
    assert contents_of(files / "cluster") == contents_of(files / "local")
    assert len(contents_of(files / "local")) == 11


def test_engines_within_a_job(cluster: dict[str, str], in_folder: Path) -> None:
    """One process within a step of srun, and two ranks of mpirun within a job, as workers of a pilot start them."""
    checks = [f"srun {PROGRAM} audit --only thrown", f"{PROGRAM} audit --only ranks"]
    wrapped = "; ".join(f"{check}; echo ended with $? >> ended.new" for check in checks)
    wrapped += "; mv ended.new ended"
    job = ["sbatch", "--ntasks", "1", "--cpus-per-task", "2", "--output", "job.log", "--wrap", wrapped]
    subprocess.run(job, env=cluster, capture_output=True, check=True)
    wait_for((in_folder / "ended").exists)  # sbatch's own --wait looks every ten seconds
    told = (in_folder / "job.log").read_text()
    assert (in_folder / "ended").read_text() == 2 * "ended with 0\n", told
    assert told.count("lines pass") == 2
    assert "skip" not in told
