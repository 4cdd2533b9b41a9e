"""The reports of docs/engine-reports: decks that print numbers give those of their pages on the installed engine."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from walkers.runner.launch import ALONE

REPORTS = Path(__file__).resolve().parents[1] / "docs" / "engine-reports"
DEFAULT_PAGE = ("-var", "page", "100000", "-var", "one", "2000")
_RESULT = re.compile(r"^RESULT (.*)", re.MULTILINE)
_NUMBER = re.compile(r": (-?\d\S*?)(?=,|\s|$)")


@pytest.fixture
def decks(tmp_path: Path) -> Path:
    """The decks, where their output may be written."""
    for file in (*REPORTS.glob("*.lig"), *REPORTS.glob("*.stl")):
        shutil.copy(file, tmp_path)
    return tmp_path


def run(folder: Path, name: str, *options: str) -> subprocess.CompletedProcess[str]:
    """Run a deck with the engine as it is packaged: without a contact model of ours."""
    environment = {name: value for name, value in os.environ.items() if name != "LD_PRELOAD"} | ALONE
    command = ["stdbuf", "-oL", "liggghts", "-log", "none", *options, "-in", f"{name}.lig"]
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, errors="replace", timeout=60, check=False
    )


# Deck, options, and each number that it prints: what the formula says, what the engine gives.
NUMBERS = [
    ("coulomb-limit", (), [(0.5, 0.5), (1.0, 1.140)]),
    ("coulomb-limit", ("-var", "e", "0.3"), [(0.3, 0.3), (1.0, 1.358)]),
    ("wall-takes-a-strangers-velocity", (), [(1.0, -2.0), (1.0, 0.0)]),
    ("contact-angle", (), [(30.0, 7.854)]),
    ("page-second-run", (), [(1.0, 0.0)]),
    ("page-second-run", DEFAULT_PAGE, [(1.0, 1.0)]),
    ("page-write-restart", (), [(1.0, 1.0), (1.0, 0.0)]),
    ("page-write-restart", DEFAULT_PAGE, [(1.0, 1.0), (1.0, 1.0)]),
    ("delete-atoms", (), [(1.0, 0.0)]),
    ("delete-atoms", ("-var", "compress", "no"), [(1.0, 1.0)]),
    ("washino-wall", (), [(1.0, 1.0), (1.0, 0.0)]),
    ("wall-is-a-sphere", (), [(1.0, 0.435), (1.0, 0.25)]),
    ("liquid-content", (), [(88.85e-6, 412.4e-6), (88.85e-6, 88.85e-6), (1.0, 100.0 ** (1.0 / 3.0))]),
]


@pytest.mark.parametrize(
    ("name", "options", "numbers"), NUMBERS, ids=lambda value: value if isinstance(value, str) else ""
)
def test_deck_gives_the_number_of_its_report(
    decks: Path, name: str, options: tuple[str, ...], numbers: list[tuple[float, float]]
) -> None:
    done = run(decks, name, *options)
    assert done.returncode == 0, done.stdout[-500:]
    measured = [float(number) for line in _RESULT.findall(done.stdout) for number in _NUMBER.findall(line)]
    assert len(measured) == len(numbers)
    for value, (expected, stated) in zip(measured, numbers, strict=True):
        assert value == pytest.approx(stated, rel=3e-3, abs=1e-7)
        assert expected == stated or abs(value - expected) > 0.1 * abs(expected)


def test_every_deck_is_in_a_report() -> None:
    decks = {deck.stem for deck in REPORTS.glob("*.lig")}
    reports = "".join(page.read_text("utf-8") for page in REPORTS.glob("*.md"))
    assert all(f"({deck}.lig)" in reports for deck in decks)
