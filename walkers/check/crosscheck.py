"""The second engine's chapter of docs/explanation/validation.md: cases of all kinds in both engines, and other laws."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.check.chapter import Chapter
from walkers.check.checking import crosscheck
from walkers.check.comparison import FEWEST_SEEDS, Comparison, PileComparison, shortened, simulate
from walkers.check.laws import Laws, laws_from
from walkers.inputs import resolve_case
from walkers.inputs.case import Case
from walkers.inputs.reading import load_case, read_toml, shipped_cases
from walkers.inputs.text import rendered
from walkers.pipeline import run
from walkers.postprocess.drawing import TWO_COLUMNS, legend_below, letter_panels, new_figure, series_look, styled
from walkers.postprocess.gait import gait, walk
from walkers.postprocess.motion import Motion

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_ALONE = {"replicates": 2, "facing": "right"}
_PILE_CYCLES = 24
_IN_GROOVE = "groove of 120°"
_SAMPLED = ("fig1b", "fig4b")
"""Cases whose means over all steps are told."""
SUPPOSITIONS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("the decks' laws", ()),
    ("no lubrication", ("lubrication",)),
    ("no rolling friction", ("rolling-friction",)),
    ("no damping of contacts", ("damping",)),
)
"""What if: each with the terms that are left out."""


@dataclass(frozen=True)
class Supposition:
    """What would be if laws were others: velocities of walkers by case, mm/s."""

    name: str
    velocities: Mapping[str, float]


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
    cases = quick_cases() if quick else full_cases()
    found = {name: crosscheck(make(), out, seeds=FEWEST_SEEDS) for name, make in cases.items()}
    single = {name: one for name, one in found.items() if isinstance(one, Comparison)}
    piles = {name: one for name, one in found.items() if isinstance(one, PileComparison)}
    whatif = [] if quick else suppose(out)
    sampled = [(name, row) for name, one in single.items() if name in _SAMPLED for row in one.rows]
    text = rendered(
        "walkers.check",
        "crosscheck.md.j2",
        single=single,
        piles=piles,
        whatif=whatif,
        jitter=_jitter(single[_IN_GROOVE]) if _IN_GROOVE in single else None,
        every_step=[(name, row) for name, row in sampled if row.every_step is not None],
    )
    return Chapter(
        "crosscheck",
        "A second engine",
        text,
        {"crosscheck": draw(single, piles)},
        {
            "cases": {name: one.as_dict() for name, one in found.items()},
            "what_if": {one.name: dict(one.velocities) for one in whatif},
        },
        tuple(f"{name}: {told}" for name, one in found.items() for told in one.disagreements),
    )


def quick_cases() -> dict[str, Callable[[], Case]]:
    """Fig. 1b for six cycles."""
    return {"fig1b": lambda: shortened(load_case("fig1b"), 6)}


def full_cases() -> dict[str, Callable[[], Case]]:
    """Walkers, climbers, clusters, other drives and walls, and a small pile."""
    fan = {"clusters": [{"arrangement": "fan", "radii": ["0.3 mm", "0.2 mm", "0.2 mm"], "angle": "20 deg", **_ALONE}]}
    tones = [
        {"frequency": "80 Hz", "peak_acceleration": "4 g"},
        {"frequency": "160 Hz", "peak_acceleration": "3 g", "phase": "90 deg"},
    ]
    return {
        **{name: partial(load_case, name) for name in ("fig1b", "fig4a", "fig4b")},
        "alignment from 30°": lambda: _changed("fig1b", 40, dimers={"angle": "30 deg", **_ALONE}),
        "symmetric from 30°": lambda: _changed("symmetric", 40, dimers={"angle": "30 deg", **_ALONE}),
        "fan of three": lambda: _changed("fig1b", 24, ("dimers",), **fan),
        "two tones": lambda: _changed("symmetric", 24, dimers=_ALONE, drive={"harmonics": tones}),
        "slope of 5°": lambda: _changed("fig1b", 24, boundary={"tilt": "5 deg"}),
        _IN_GROOVE: lambda: _changed("fig1b", 24, boundary={"shape": "groove", "opening": "120 deg"}),
        "climber": lambda: shortened(load_case("climber"), 20),
        "cluster in a corner": lambda: shortened(load_case("cluster"), 21),
        "pile-ci": lambda: shortened(load_case("pile-ci"), _PILE_CYCLES),
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


def suppose(out: Path) -> list[Supposition]:
    """Velocities of the paper's walkers by the second engine under other laws, mm/s."""
    motions = {name: run(load_case(name), out).motion for name in ("fig1b", "fig4a", "fig4b")}
    return [
        Supposition(name, {case: _speed(motion, laws_from(without)) for case, motion in motions.items()})
        for name, without in SUPPOSITIONS
    ]


def _speed(motion: Motion, laws: Laws) -> float:
    made = simulate(motion, laws, every_step=False)
    return 1e3 * float(walk(made.motion.groups[0]).velocity.mean())


def _jitter(found: Comparison) -> float:
    """How far the second engine departs from itself if it begins elsewhere by the rounding of its numbers, m."""
    first = found.first.position.copy()
    first[0] *= 1.0 + 1e-15
    moved = simulate(replace(found.first, position=first), found.laws, every_step=False).motion
    return float(np.linalg.norm(moved.position - found.second.position, axis=-1).max())


@styled
def draw(single: Mapping[str, Comparison], piles: Mapping[str, PileComparison]) -> Figure:
    """Gait of a walker in both engines, and how far apart beads are through the runs."""
    figure, (left, right) = new_figure(TWO_COLUMNS, 4.0, ncols=2)
    name = "fig4b" if "fig4b" in single else next(iter(single))
    shown = single[name]
    _draw_gait(left, shown, name)
    for number, (label, one) in enumerate(single.items()):
        right.semilogy(*_apart(one), label=label, lw=0.8, markevery=0.2, **series_look(number))
    for label, pile in piles.items():
        for number, one in enumerate(pile.starts):
            right.semilogy(*_apart(one), color="0.6", lw=0.6, label=None if number else label)
    right.set(xlabel="cycles", ylabel="distance / radius", title="largest distance of a bead from itself")
    legend_below(right, ncols=2)
    letter_panels((left, right))
    return figure


def _draw_gait(axes: Any, shown: Comparison, name: str) -> None:
    first, second = shown.first.groups[0], shown.second.groups[0]
    last = slice(-2 * shown.case.run.samples_per_cycle - 1, None)
    cycles = first.time[last] * shown.case.drive.frequency
    one, other = gait(first), gait(second)
    for contact in range(one.sliding.shape[-1]):
        line = axes.plot(cycles, 1e3 * one.sliding[last, 0, contact], label=f"contact {contact + 1}")[0]
        axes.plot(cycles, 1e3 * other.sliding[last, 0, contact], "x", color=line.get_color(), ms=3)
    axes.set(xlabel="cycles", ylabel="sliding velocity / mm s$^{-1}$", title=f"{name}: LIGGGHTS, second engine (x)")
    legend_below(axes, ncols=2)


def _apart(one: Comparison) -> tuple[Any, Any]:
    parting = one.parting
    radius = float(one.second.radius.min())
    return parting.time / parting.period, np.maximum(parting.apart, 1e-16) / radius
