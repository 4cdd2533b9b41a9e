"""The program and the Makefile, as a user meets them."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

import walkers
from tests.conftest import PROGRAM, SHORT, call, document, to_toml
from walkers.physics.time_step import WALKER_FRACTIONS

ROOT = Path(__file__).parent.parent


def _walkers(*arguments: str) -> str:
    """The installed program, as a process of its own."""
    return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, check=True).stdout


def test_show_tells_what_follows_from_a_case() -> None:
    shown = call("show", "fig1b", check=True).stdout
    for part in ("Γ0 = 0.3811", "sin δ = 0.2", "μ = 0.5429", "4πγR limit", "rayleigh", "viscous", " a cycle"):
        assert part in shown
    summary = json.loads(call("show", "fig1b", "--json", check=True).stdout)
    assert summary["dimer"]["gamma0"] == pytest.approx(0.3811, abs=1e-4)
    assert summary["case"]["walkers"][0]["radii"] == [3e-4, 2e-4]
    shares = summary["time_step"]["share"]
    assert shares.keys() == WALKER_FRACTIONS.keys()
    assert all(0.0 < share <= WALKER_FRACTIONS[limit] for limit, share in shares.items())
    assert summary["run"]["predicted_seconds"] > 0
    walls = summary["contacts"][:2]
    assert all(0.5 < contact["capillary_force"] / contact["capillary_force_limit"] < 0.9 for contact in walls)


def test_deck_is_printed_or_written(tmp_path: Path) -> None:
    printed = _walkers("deck", "fig1b")
    call("deck", "fig1b", "--to", str(tmp_path / "deck"), check=True)
    assert (tmp_path / "deck" / "walker.lig").read_text() == printed
    assert (tmp_path / "deck" / "bridges.txt").exists()
    again = call("deck", "fig1b", "--to", str(tmp_path / "deck"))
    assert again.returncode == 2


def test_from_a_case_file_to_pictures(in_folder: Path) -> None:
    (in_folder / "mine.toml").write_text(to_toml(document(run=SHORT)))
    assert "toward the large bead" in _walkers("run", "mine.toml")
    assert "(already run)" in call("run", "mine.toml", check=True).stdout
    for command, last in (("plot", "gait.png"), ("vtk", "walkers.pvd"), ("render", "walker.png")):
        path = Path(call(command, "mine.toml", check=True).stdout.split()[-1])
        assert path.name == last
        assert path.exists()


def test_a_spread_that_cannot_be_is_refused_before_the_run(in_folder: Path) -> None:
    uncertain = {"uncertain": {"contact": {"restitution": [0.01, 0.8]}}}
    (in_folder / "mine.toml").write_text(to_toml(document(run=SHORT, **uncertain)))
    done = call("run", "mine.toml", "--spread")
    assert (done.returncode, done.stdout) == (2, "")
    assert "contact.restitution" in done.stderr
    assert not (in_folder / "runs").exists()


def test_progress_is_plain_lines_without_a_terminal(in_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first one is due after a second; here at once, so that a run need not last that long on a fast machine."""
    monkeypatch.setattr("walkers.progress._FIRST_LINE_SECONDS", 0.0)
    (in_folder / "mine.toml").write_text(to_toml(document(run={**SHORT, "cycles": 30})))
    done = call("run", "mine.toml", check=True)
    lines = [line for line in done.stderr.splitlines() if not line.startswith("walkers: warning:")]
    assert lines
    assert all(line.startswith("mine: ") and " %, " in line for line in lines)
    assert all("s simulated" in line and "steps/s" in line and ("left" in line or "starting" in line) for line in lines)
    assert "\x1b" not in done.stderr


def test_make_help_lists_the_targets() -> None:
    shown = subprocess.run(["make"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert all(f"make {target}" in shown for target in ("walker", "test", "help", "clean"))


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become somebody else")
def test_without_root_and_engine_the_administrators_command_is_told() -> None:
    """As nobody, with a PATH that holds neither liggghts nor sudo."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        place.chmod(0o755)
        for tool in ("bash", "make", "id", "awk"):
            (place / tool).symlink_to(str(shutil.which(tool)))
        shutil.copy(ROOT / "Makefile", place)
        done = subprocess.run(
            ["make", "--no-print-directory", "engine"],
            cwd=place,
            env={"PATH": folder},
            user=65534,
            capture_output=True,
            text=True,
            check=False,
            stdin=subprocess.DEVNULL,
        )
    assert done.returncode != 0
    assert "apt-get install liggghts" in done.stderr
    assert "administrator" in done.stderr


def test_installing_claims_one_name() -> None:
    """Others may have a module called inputs or runner, and theirs is theirs."""
    from importlib.metadata import packages_distributions

    names = [name for name, owners in packages_distributions().items() if "granular-walkers" in owners]
    assert [name for name in names if not name.startswith("__editable__")] == ["walkers"]
    script = (
        "import walkers.inputs, sys; print([name for name in sys.modules if name in ('inputs', 'runner', 'sweeps')])"
    )
    told = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd="/")
    assert told.stdout.strip() == "[]"
    assert dir(walkers) == sorted(walkers.__all__)
