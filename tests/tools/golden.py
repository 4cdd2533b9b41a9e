"""Golden numbers: what shipped cases and sweeps compute, to compare before and after a change of the program.

    python tests/tools/golden.py compare            # everything; exit status 1 and a list if anything differs
    python tests/tools/golden.py compare decks      # one part: decks or runs
    python tests/tools/golden.py freeze [PART ...]  # write the golden numbers anew, after a change that is meant

``decks``: what determines the run of each point of each shipped case and sweep, and of up to 25 points a sweep the
deck's text, its tables and its layout. ``runs``: each column of each table (bytes) and each number of the result of a
dozen finished runs, which are made anew in ``runs/golden``.

Digests of tables are those of one machine's arithmetic: freeze on the machine that compares.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import sys
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
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
RUNS: dict[str, tuple[str, dict[str, Any]]] = {
    **{
        name: (name, {})
        for name in ("fig1b", "fig4a", "fig4b", "symmetric", "climber", "climber-dimer", "cluster")
    },
    "tray": ("tray", {}),
    "pile-ci": ("pile-ci", {}),
    "slope": ("fig1b", {"boundary.tilt": "20 deg", "run.cycles": 24, "run.settling_cycles": 8}),
    "groove": (
        "fig1b",
        {"boundary.shape": "groove", "boundary.opening": "120 deg", "dimers.replicates": 2},
    ),
    "two-tones": (
        "fig4a",
        {"drive.waveform": "triangle", "run.cycles": 24, "run.settling_cycles": 8},
    ),
}


def digest(content: str | bytes) -> str:
    """A short digest of a text or of bytes."""
    return hashlib.sha256(content if isinstance(content, bytes) else content.encode()).hexdigest()[
        :16
    ]


def _cases(sweep: str) -> Iterator[tuple[str, Case, bool]]:
    """Name and case of each point, and whether its deck is rendered."""
    points = load_sweep(sweep)
    every = max(1, len(points.rows) // POINTS)
    for number, case in enumerate(points.cases()):
        yield f"{sweep}/{number}", case, number % every == 0


def _of_deck(case: Case) -> list[str]:
    """Digests of deck, tables and layout of the first segment and of the whole run."""
    decks = [render_deck(case), render_deck(case, single_segment(case))]
    return [
        digest("".join(deck.text for deck in decks)),
        digest("".join(f"{name}\n{text}" for deck in decks for name, text in deck.files.items())),
        digest("".join(json.dumps(deck.layout.as_dict(), sort_keys=True) for deck in decks)),
    ]


def of_points(name: str) -> dict[str, list[str]]:
    """Digests of the points of a shipped case or sweep."""
    points = [(name, load_case(name), True)] if name in shipped("case") else _cases(name)
    return {
        key: [
            digest(json.dumps(case.determinants(), sort_keys=True)),
            *(_of_deck(case) if rendered else []),
        ]
        for key, case, rendered in points
    }


def decks() -> dict[str, Any]:
    """Part ``decks``."""
    with ProcessPoolExecutor(2) as pool:
        parts = pool.map(of_points, [*shipped("case"), *shipped("sweep")])
        return {key: digests for part in parts for key, digests in part.items()}


def runs() -> dict[str, Any]:
    """Part ``runs``."""
    digests: dict[str, Any] = {}
    for name, (case, changes) in RUNS.items():
        place = run(load_case(case, changes), OUT).directory
        for path in sorted(place.glob("*.parquet")):
            table = pd.read_parquet(path)
            digests |= {
                f"{name}/{path.stem}/{column}": _of_column(table[column]) for column in table
            }
        result = json.loads((place / "result.json").read_text("utf-8"))
        digests |= {f"{name}/result/{key}": value for key, value in result["numbers"].items()}
    return digests


def _of_column(column: pd.Series) -> str:
    values = column.to_numpy()
    return digest(
        "\n".join(map(repr, values.tolist())) if values.dtype == object else values.tobytes()
    )


PARTS = {"decks": decks, "runs": runs}


def differences(golden: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """What differs, a line each."""
    gone = [f"gone: {key}" for key in golden if key not in now]
    new = [f"new: {key}" for key in now if key not in golden]
    changed = [
        f"{key}: {golden[key]} -> {now[key]}"
        for key in golden
        if key in now and golden[key] != now[key]
    ]
    return gone + new + changed


def main(action: str, *names: str) -> int:
    """Freeze or compare."""
    golden = json.loads(GOLDEN.read_text("utf-8")) if GOLDEN.exists() else {}
    chosen = names or tuple(PARTS)
    if "runs" in chosen:
        shutil.rmtree(OUT, ignore_errors=True)
    status = 0
    for name in chosen:
        now = json.loads(json.dumps(PARTS[name]()))
        if action == "freeze":
            golden[name] = now
            GOLDEN.write_text(json.dumps(golden, indent=0, sort_keys=True) + "\n", "utf-8")
            print(f"{name}: {len(now)} values frozen")
        elif different := differences(golden[name], now):
            status = 1
            print(
                f"{name}: {len(different)} of {len(golden[name])} values differ",
                *different,
                sep="\n  ",
            )
        else:
            print(f"{name}: all {len(now)} values are the same")
    return status


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
