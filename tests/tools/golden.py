"""Golden numbers: what shipped cases and sweeps compute, before and after a change of the program.

    python tests/tools/golden.py compare            # everything; exit status 1 and a list if
                                                    # anything differs
    python tests/tools/golden.py compare decks      # one part: decks or runs
    python tests/tools/golden.py freeze [PART ...]  # write the golden numbers anew, after a
                                                    # change that is meant

``decks``: what determines the run of each point of each shipped case and sweep, and of up to 25
points a sweep the deck's text, its tables and its layout. ``runs``: each column of each table
(bytes) and each number of the result of a dozen finished runs, which are made anew in
``runs/golden``.

Digests of tables are those of one machine's arithmetic: freeze on the machine that compares.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from walkers import load_case, run
from walkers.inputs.reading import shipped
from walkers.inputs.sweep import load_sweep
from walkers.inputs.tables.case import Case
from walkers.templates.deck import render_deck, single_segment

ROOT = Path(__file__).resolve().parents[2]
GOLDEN = Path(__file__).with_name("golden.json")
OUT = ROOT / "runs" / "golden"
POINTS = 25
"""Largest number of points of a sweep whose decks are rendered."""
SHORT = {"run.cycles": 24, "run.settling_cycles": 8}
"""Changes of a case that make its run shorter."""
RUNS: dict[str, tuple[str, dict[str, Any]]] = {
    "fig1b": ("fig1b", {}),
    "fig4a": ("fig4a", {}),
    "fig4b": ("fig4b", {}),
    "symmetric": ("symmetric", {}),
    "climber": ("climber", {}),
    "climber-dimer": ("climber-dimer", {}),
    "cluster": ("cluster", {}),
    "tray": ("tray", {}),
    "pile-ci": ("pile-ci", {}),
    "slope": ("fig1b", {"boundary.tilt": "20 deg", **SHORT}),
    "groove": (
        "fig1b",
        {"boundary.shape": "groove", "boundary.opening": "120 deg", "dimers.replicates": 2},
    ),
    "two-tones": ("fig4a", {"drive.waveform": "triangle", **SHORT}),
}
"""Shipped cases that are run, with their changes."""


def digest(content: bytes) -> str:
    """A short digest of bytes."""
    return hashlib.sha256(content).hexdigest()[:16]


def digest_of_text(text: str) -> str:
    """A short digest of a text."""
    return digest(text.encode())


def digest_of_json(content: Any) -> str:
    """A short digest of what can be written as JSON."""
    return digest_of_text(json.dumps(content, sort_keys=True))


# --- decks ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Point:
    """A shipped case, or a point of a shipped sweep."""

    name: str
    case: Case
    rendered: bool
    """Whether its deck is rendered."""


def points_of(name: str) -> Iterator[Point]:
    """The points of a shipped case or sweep."""
    if name in shipped("case"):
        yield Point(name, load_case(name), rendered=True)
        return
    sweep = load_sweep(name)
    every = max(1, len(sweep.rows) // POINTS)
    for number, case in enumerate(sweep.cases()):
        yield Point(f"{name}/{number}", case, rendered=number % every == 0)


def digests_of_deck(case: Case) -> list[str]:
    """Digests of text, tables and layout of the decks of the first segment and of the whole run."""
    texts = ""
    tables = ""
    layouts = ""
    for deck in (render_deck(case), render_deck(case, single_segment(case))):
        texts += deck.text
        for name, text in deck.files.items():
            tables += f"{name}\n{text}"
        layouts += json.dumps(deck.layout.as_dict(), sort_keys=True)
    return [digest_of_text(texts), digest_of_text(tables), digest_of_text(layouts)]


def digests_of_points(name: str) -> dict[str, list[str]]:
    """Digests of the points of a shipped case or sweep."""
    digests = {}
    for point in points_of(name):
        digests[point.name] = [digest_of_json(point.case.determinants())]
        if point.rendered:
            digests[point.name] += digests_of_deck(point.case)
    return digests


def decks() -> dict[str, Any]:
    """Part ``decks``."""
    digests: dict[str, Any] = {}
    with ProcessPoolExecutor(2) as pool:
        for part in pool.map(digests_of_points, [*shipped("case"), *shipped("sweep")]):
            digests |= part
    return digests


# --- runs -------------------------------------------------------------------------------------


def digest_of_column(column: pd.Series) -> str:
    """A digest of the bytes of a column, or of the texts of its objects."""
    values = column.to_numpy()
    if values.dtype == object:
        return digest_of_text("\n".join(map(repr, values.tolist())))
    return digest(values.tobytes())


def runs() -> dict[str, Any]:
    """Part ``runs``."""
    shutil.rmtree(OUT, ignore_errors=True)
    digests: dict[str, Any] = {}
    for name, (case, changes) in RUNS.items():
        directory = run(load_case(case, changes), OUT).directory
        for path in sorted(directory.glob("*.parquet")):
            table = pd.read_parquet(path)
            for column in table:
                digests[f"{name}/{path.stem}/{column}"] = digest_of_column(table[column])
        result = json.loads((directory / "result.json").read_text("utf-8"))
        for key, number in result["numbers"].items():
            digests[f"{name}/result/{key}"] = number
    return digests


# --- the program ------------------------------------------------------------------------------

PARTS: dict[str, Callable[[], dict[str, Any]]] = {"decks": decks, "runs": runs}


def differences(golden: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """What differs, a line each."""
    lines = []
    for key, value in golden.items():
        if key not in now:
            lines.append(f"gone: {key}")
        elif now[key] != value:
            lines.append(f"{key}: {value} -> {now[key]}")
    for key in now:
        if key not in golden:
            lines.append(f"new: {key}")
    return lines


def freeze(golden: dict[str, Any], part: str, now: dict[str, Any]) -> None:
    """Write the numbers of a part anew."""
    golden[part] = now
    GOLDEN.write_text(json.dumps(golden, indent=0, sort_keys=True) + "\n", "utf-8")
    print(f"{part}: {len(now)} values frozen")


def compare(golden: dict[str, Any], part: str, now: dict[str, Any]) -> bool:
    """Print what of a part differs; return whether nothing does."""
    lines = differences(golden[part], now)
    if not lines:
        print(f"{part}: all {len(now)} values are the same")
        return True
    print(f"{part}: {len(lines)} of {len(golden[part])} values differ")
    for line in lines:
        print(f"  {line}")
    return False


def main(action: str, *parts: str) -> int:
    """Freeze or compare; the exit status."""
    golden: dict[str, Any] = {}
    if GOLDEN.exists():
        golden = json.loads(GOLDEN.read_text("utf-8"))
    status = 0
    for part in parts or PARTS:
        now = json.loads(json.dumps(PARTS[part]()))  # as it is read from the file
        if action == "freeze":
            freeze(golden, part, now)
        elif not compare(golden, part, now):
            status = 1
    return status


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
