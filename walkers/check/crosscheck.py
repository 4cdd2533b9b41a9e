"""The second engine's chapter of docs/explanation/validation.md: cases of all kinds in both engines, and other laws."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from walkers.check.comparison import FEWEST_SEEDS, Comparison, crosscheck, shortened, simulate
from walkers.check.validate import Chapter
from walkers.inputs import resolve_case
from walkers.inputs.case import Case
from walkers.inputs.reading import load_case, read_toml, shipped_cases
from walkers.inputs.text import rendered
from walkers.pipeline import run
from walkers.postprocess.gait import walk

_ALONE = {"replicates": 2, "facing": "right"}
_PILE_CYCLES = 24
_IN_GROOVE = "groove of 120°"
SUPPOSITIONS: dict[str, tuple[str, ...]] = {
    "the decks' laws": (),
    "no lubrication": ("lubrication",),
    "no rolling friction": ("rolling-friction",),
    "no damping of contacts": ("damping",),
}
"""What if: each with the terms that are left out."""


def chapter(out: Path, *, quick: bool = False) -> Chapter:
    """Run cases of all kinds in both engines.

    Parameters
    ----------
    out
        Folder of the run directories.
    quick
        A short run of one walker alone.

    Raises
    ------
    runner.EngineFailure
        If the engine fails in one of the known ways.
    """
    cases = {"fig1b": shortened(load_case("fig1b"), 6)} if quick else full_cases()
    found = {
        name: crosscheck(case, out, seeds=1 if case.mixture is None else FEWEST_SEEDS) for name, case in cases.items()
    }
    whatif = {} if quick else suppose(out)
    text = rendered(
        "walkers.check",
        "crosscheck.md.j2",
        single={name: one for name, one in found.items() if one.case.mixture is None},
        piles={name: one for name, one in found.items() if one.case.mixture is not None},
        whatif=whatif,
        jitter=_jitter(found[_IN_GROOVE]) if _IN_GROOVE in found else None,
    )
    numbers = {"cases": {name: one.as_dict() for name, one in found.items()}, "what_if": whatif}
    failed = tuple(f"{name}: {told}" for name, one in found.items() for told in one.disagreements)
    return Chapter("crosscheck", "A second engine", text, {}, numbers, failed)


def full_cases() -> dict[str, Case]:
    """Walkers, climbers, clusters, other drives and walls, and a small pile."""
    fan = {"clusters": [{"arrangement": "fan", "radii": ["0.3 mm", "0.2 mm", "0.2 mm"], "angle": "20 deg", **_ALONE}]}
    tones = [
        {"frequency": "80 Hz", "peak_acceleration": "4 g"},
        {"frequency": "160 Hz", "peak_acceleration": "3 g", "phase": "90 deg"},
    ]
    return {
        **{name: load_case(name) for name in ("fig1b", "fig4a", "fig4b")},
        "alignment from 30°": _changed("fig1b", 40, dimers={"angle": "30 deg", **_ALONE}),
        "symmetric from 30°": _changed("symmetric", 40, dimers={"angle": "30 deg", **_ALONE}),
        "fan of three": _changed("fig1b", 24, ("dimers",), **fan),
        "two tones": _changed("symmetric", 24, dimers=_ALONE, drive={"harmonics": tones}),
        "slope of 5°": _changed("fig1b", 24, boundary={"tilt": "5 deg"}),
        _IN_GROOVE: _changed("fig1b", 24, boundary={"shape": "groove", "opening": "120 deg"}),
        "climber": shortened(load_case("climber"), 20),
        "cluster in a corner": shortened(load_case("cluster"), 21),
        "pile-ci": shortened(load_case("pile-ci"), _PILE_CYCLES),
    }


def _changed(shipped: str, cycles: int, without: tuple[str, ...] = (), **tables: Any) -> Case:
    """A shipped case for so many cycles, with changes merged into its tables; harmonics replace the drive."""
    document = {name: table for name, table in read_toml(shipped_cases()[shipped]).items() if name not in without}
    for name, table in tables.items():
        if isinstance(table, dict) and "harmonics" not in table:
            document[name] = {**document.get(name, {}), **table}
        else:
            document[name] = table
    return shortened(resolve_case(document, name=shipped), cycles)


def suppose(out: Path) -> dict[str, dict[str, float]]:
    """Velocities of the paper's walkers by the second engine under other laws, mm/s."""
    motions = {name: run(load_case(name), out).motion for name in ("fig1b", "fig4a", "fig4b")}
    return {
        told: {
            name: 1e3 * float(walk(simulate(motion, without).groups[0]).velocity.mean())
            for name, motion in motions.items()
        }
        for told, without in SUPPOSITIONS.items()
    }


def _jitter(found: Comparison) -> float:
    """How far the second engine departs from itself if it begins elsewhere by the rounding of its numbers, m."""
    (start,) = found.starts
    place = start.first.position.copy()
    place[0] *= 1.0 + 1e-15
    moved = simulate(replace(start.first, position=place))
    return float(np.linalg.norm(moved.position - start.second.position, axis=-1).max())
