"""Which physics is missing: published numbers from the theory, with one term after the other, each fitted anew.

The engine knows Coulomb's friction and the bridges' resistance to sliding and rolling. The theory integrates under any
law of friction, thousands of walkers a second, so that for every term all parameters can be searched for what they give
at best.
It is a theory of walkers whose contacts stay closed, aligned with the drive: of hopping and turning it knows nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from math import inf, isfinite, nan
from pathlib import Path
from statistics import fmean
from typing import NamedTuple

import numpy as np

from walkers.inputs import library
from walkers.inputs.case import Case
from walkers.inputs.text import rendered
from walkers.paper import dimers
from walkers.paper.published import FITTED, Point, Published
from walkers.runner.files import write_json, write_text
from walkers.theory.motion import Friction, Walker, walk
from walkers.theory.quasistatic import FloatArray, translation

_CYCLES = 40
_FREQUENCIES = (60.0, 90.0)
_HOPELESS = 30.0


class Term(NamedTuple):
    """Something that the theory may have: parameters and their ranges; ``log10_`` parameters are logarithms."""

    name: str
    ranges: Mapping[str, tuple[float, float]]


ALWAYS = Term(
    "Coulomb friction and the bridges' resistance",
    {
        "friction_wall": (0.02, 0.6),
        "friction_slide": (0.02, 0.6),
        "friction_bead": (0.02, 0.6),
        "log10_viscosity_ratio": (-1.0, 2.3),
    },
)
"""What the engine has: three frictions, and the bridges' viscosity over the liquid's."""
KAPPA = Term("drag in proportion to the load, the paper's κ (s/m)", {"log10_kappa": (-1.0, 2.0)})
ADDED = (
    Term("weaker or stronger bridges to the substrate", {"wall_bridge_factor": (0.5, 1.3)}),
    Term("weaker or stronger bridges between the beads", {"bead_bridge_factor": (0.5, 1.3)}),
    KAPPA,
    Term("static friction above the kinetic", {"static_ratio": (1.0, 2.5), "log10_stribeck_velocity": (-4.0, -1.5)}),
)
"""Terms to be tried, one at a time and all together."""

_NEUTRAL = {
    "wall_bridge_factor": 1.0,
    "bead_bridge_factor": 1.0,
    "log10_kappa": -1.0,
    "static_ratio": 1.0,
    "log10_stribeck_velocity": -3.0,
}
NOTHING_ELSE = {
    **dict.fromkeys(("friction_wall", "friction_slide", "friction_bead"), 1e-6),
    "log10_viscosity_ratio": -9.0,
}
"""What leaves the paper's law alone, F∥ = κ v F, but integrated in time, with inertia."""


def points_of(number: Published) -> tuple[list[Point], list[Point]]:
    """Walkers that it is a mean over, and those that it is a ratio to: at the ends of the range of frequencies."""
    of, over = (
        [one for one in points if one.frequency in _FREQUENCIES or len(points) == 1]
        for points in (number.of, number.over)
    )
    return of, over


@dataclass(frozen=True)
class Fit:
    """What terms give at best.

    Attributes
    ----------
    name, parameters
        Of the terms; the best parameters.
    values
        Target's name to what comes out (m/s, or a ratio); None where the forces have no solution.
    met, missed
        How many of them lie within their deviations; the names of the others, the worst first.
    misfit
        Σ ln(1 + r²), r in deviations.
    """

    name: str
    parameters: dict[str, float]
    values: dict[str, float | None]
    met: int
    missed: list[str]
    misfit: float


@cache
def walkers_of_the_paper() -> dict[Point, Case]:
    """The walkers that the numbers are of, as one would take them without a calibration.

    Of Fig. 4b there are none: there contacts open in every cycle, and that is beyond the theory.
    """
    points = [point for number in FITTED for part in points_of(number) for point in part]
    return {point: _bare(dimers.of_point(point)) for point in points}


def _bare(case: Case) -> Case:
    """With perfectly wetting bridges of 1 % liquid, of its own viscosity."""
    known = library.liquid(case.liquid.name or "")
    liquid = replace(
        case.liquid,
        dynamic_viscosity=known["kinematic_viscosity"].value * known["density"].value,
        volume_fraction=0.01,
        contact_angle=0.0,
    )
    return replace(case, liquid=liquid, contact=replace(case.contact, minimum_separation_ratio=0.01))


def speeds(parameters: Mapping[str, float]) -> dict[str, dict[Point, float]]:
    """What walkers of the paper do, m/s, by quantity and point; NaN where the forces have no solution.

    Parameters
    ----------
    parameters
        Of `ALWAYS` and of any of `ADDED`.
    """
    cases = walkers_of_the_paper()
    walkers = _walkers()
    known = {**_NEUTRAL, "log10_kappa": -inf, **parameters}
    scale = np.array([[known["wall_bridge_factor"]]] * 2 + [[known["bead_bridge_factor"]]])
    on_slide = np.array([point.sweep == "fig4" for point in cases])
    wall = np.where(on_slide, known["friction_slide"], known["friction_wall"])
    dry = Friction.coulomb(wall, np.full(len(cases), known["friction_bead"]))
    kinetic = np.asarray(dry.kinetic)
    friction = Friction(
        kinetic=kinetic,
        static=kinetic * known["static_ratio"],
        stribeck_velocity=10.0 ** known["log10_stribeck_velocity"],
        linear=10.0 ** known["log10_kappa"],
    )
    resistances = walkers.resistances * 10.0 ** known["log10_viscosity_ratio"]
    motion = walk(
        replace(walkers, at_rest=walkers.at_rest * scale, resistances=resistances),
        friction,
        [case.drive.frequency for case in cases.values()],
        [case.drive.peak_acceleration for case in cases.values()],
        cycles=_CYCLES,
    )
    # Contacts that would open for a moment are let be: the engine's walkers hop there and walk on.
    sliding = np.where(motion.solved, motion.sliding, np.nan)
    velocity = translation(sliding)
    columns = {"velocity": velocity, "rotation_1": velocity - sliding[0], "sliding_1": sliding[0]}
    return {name: dict(zip(cases, map(float, values), strict=True)) for name, values in columns.items()}


@cache
def _walkers() -> Walker:
    """The walkers, their bridges of the liquid's own viscosity."""
    return Walker.joined([Walker.of_case(case) for case in walkers_of_the_paper().values()])


def values_of(parameters: Mapping[str, float], wanted: Sequence[Published]) -> dict[str, float]:
    """What some parameters give of published numbers, m/s or ratios, by what they are called here."""
    found = speeds(parameters)
    values = {}
    for number in wanted:
        above, below = ([found[number.quantity][one] for one in points] for points in points_of(number))
        value = fmean(above)
        if below:
            value = value / fmean(below) if fmean(below) else nan
        values[number.fitted] = value
    return values


def _residuals(values: Mapping[str, float], wanted: Sequence[Published]) -> FloatArray:
    residuals = np.array([(values[number.fitted] - number.si) / number.si_deviation for number in wanted])
    return np.where(np.isfinite(residuals), residuals, _HOPELESS)


def fit(
    terms: Sequence[Term],
    wanted: Sequence[Published] = FITTED,
    *,
    fixed: Mapping[str, float] | None = None,
    begin: Mapping[str, float] | None = None,
    seed: int = 1,
    generations: int = 80,
) -> Fit:
    """The parameters with the least misfit (`scipy.optimize.differential_evolution`).

    Parameters
    ----------
    terms
        Beside `ALWAYS`.
    wanted
        What is to come out, of `walkers.paper.published.FITTED`.
    fixed
        Parameters that are not searched for.
    begin
        Parameters to begin with; those of an term that are not among them begin where it does nothing.
    seed, generations
        Of the search.
    """
    from scipy.optimize import differential_evolution

    fixed = fixed or {}
    every = {**ALWAYS.ranges, **{key: ends for one in terms for key, ends in one.ranges.items()}}
    ranges = {key: ends for key, ends in every.items() if key not in fixed}

    def misfit(point: FloatArray) -> float:
        values = values_of({**fixed, **dict(zip(ranges, map(float, point), strict=True))}, wanted)
        return float(np.log1p(_residuals(values, wanted) ** 2).sum())

    begin = {**_NEUTRAL, **(begin or {})}
    found = differential_evolution(
        misfit,
        list(ranges.values()),
        maxiter=generations,
        popsize=12,
        rng=np.random.default_rng(seed),
        polish=False,
        x0=[begin[key] for key in ranges] if begin.keys() >= ranges.keys() else None,
    )
    parameters = dict(zip(ranges, map(float, found.x), strict=True))
    values = values_of({**fixed, **parameters}, wanted)
    residuals = np.abs(_residuals(values, wanted))
    worst = [place for place in np.argsort(residuals)[::-1] if residuals[place] > 1.0]
    return Fit(
        name=" + ".join(one.name for one in terms) or ALWAYS.name,
        parameters=parameters,
        values={name: value if isfinite(value) else None for name, value in values.items()},
        met=len(wanted) - len(worst),
        missed=[wanted[place].fitted for place in worst],
        misfit=float(found.fun),
    )


def try_model_terms(*, seed: int = 1, generations: int = 80) -> list[Fit]:
    """The fit without any, with each term, with all of them, and of the paper's law alone."""
    bare = fit((), seed=seed, generations=generations)
    # From where the others end: what has more parameters must not come out worse for want of generations.
    added = [fit((one,), begin=bare.parameters, seed=seed, generations=generations) for one in ADDED]
    best = min(added, key=lambda one: one.misfit)
    every = fit(ADDED, begin=best.parameters, seed=seed, generations=generations)
    alone = fit((KAPPA,), fixed=NOTHING_ELSE, seed=seed, generations=generations)
    named = (replace(every, name="all of these"), replace(alone, name="the paper's law alone, integrated"))
    return [bare, *added, *named]


def write_model_terms(fits: Sequence[Fit], to: Path) -> list[Path]:
    """Write ``model_terms.json`` and ``model_terms.md``."""
    to.mkdir(parents=True, exist_ok=True)
    told = {"targets": [_told(number) for number in FITTED], "fits": [asdict(one) for one in fits]}
    write_json(to / "model_terms.json", told)
    write_text(to / "model_terms.md", as_markdown(fits))
    return [to / "model_terms.json", to / "model_terms.md"]


def _told(number: Published) -> dict[str, object]:
    of, over = ([point.name for point in points] for points in points_of(number))
    told = {"name": number.fitted, "quantity": number.quantity.removesuffix("_1"), "of": of, "over": over}
    return told | {"value": number.si, "deviation": number.si_deviation}


def as_markdown(fits: Sequence[Fit]) -> str:
    """The fits as a table, and below it what they give."""
    return rendered("walkers.paper", "model_terms.md.j2", fits=fits, numbers=FITTED)
