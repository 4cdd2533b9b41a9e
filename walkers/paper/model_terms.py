"""Further terms of the theory, each fitted to the published numbers.

The engine has Coulomb friction and the resistance of bridges to sliding and rolling. The theory integrates thousands of
walkers per second under any friction law, so that all parameters can be fitted for every term. It is for walkers that
are aligned with the drive and whose contacts stay closed; it does not describe hopping or turning.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import inf, isfinite, nan
from pathlib import Path
from statistics import fmean

import numpy as np

from walkers.inputs import library
from walkers.inputs.case import Case
from walkers.inputs.extras import require
from walkers.inputs.text import rendered
from walkers.paper.published import OBSERVATIONS, Observation, Point
from walkers.runner.files import write_text
from walkers.theory.motion import Friction, Walker, walk
from walkers.theory.quasistatic import FloatArray, translation

Ranges = Mapping[str, tuple[float, float]]
ALWAYS: Ranges = {
    "friction_wall": (0.02, 0.6),
    "friction_slide": (0.02, 0.6),
    "friction_bead": (0.02, 0.6),
    "log10_viscosity_ratio": (-1.0, 2.3),
}
"""Terms of the engine: three friction coefficients, and the viscosity of bridges over that of the liquid (log10)."""
KAPPA: Ranges = {"log10_kappa": (-1.0, 2.0)}
TERMS: Mapping[str, Ranges] = {
    "weaker or stronger bridges to the substrate": {"wall_bridge_factor": (0.5, 1.3)},
    "weaker or stronger bridges between the beads": {"bead_bridge_factor": (0.5, 1.3)},
    "drag in proportion to the load, the paper's κ (s/m)": KAPPA,
    "static friction above the kinetic": {"static_ratio": (1.0, 2.5), "log10_stribeck_velocity": (-4.0, -1.5)},
}
"""Terms that are fitted one at a time and all together, with their parameters."""
_WITHOUT = {
    "wall_bridge_factor": 1.0,
    "bead_bridge_factor": 1.0,
    "log10_kappa": -1.0,
    "static_ratio": 1.0,
    "log10_stribeck_velocity": -3.0,
}
NOTHING_ELSE = {"friction_wall": 1e-6, "friction_slide": 1e-6, "friction_bead": 1e-6, "log10_viscosity_ratio": -9.0}
"""Parameters that leave only the paper's law, F∥ = κ v F, integrated in time with inertia."""
_KEYS = (
    *(f"fig2_{g}g" for g in range(2, 7)),
    *("fig2_plateau", "fig2_frequency_4g", "fig2_frequency", "fig2_rest"),
    *(key for key, number in OBSERVATIONS.items() if number.fitted and key.startswith(("fig3", "fig4"))),
)
FITTED = tuple(OBSERVATIONS[key] for key in _KEYS)
"""Numbers of walkers on the axis whose contacts stay closed; in Fig. 4b they open in every cycle."""
_FREQUENCIES = (60.0, 90.0)
_CYCLES = 40
_HOPELESS = 30.0
PAGE_NAME = "model_terms.md"


@dataclass(frozen=True)
class Fit:
    """Best fit with some terms: parameters, and values by the name of each number (m/s, or a ratio).

    ``met`` numbers are within their deviations; ``missed`` are the names of the others, the worst first. ``misfit`` is
    Σ ln(1 + r²), r in deviations.
    """

    name: str
    parameters: dict[str, float]
    values: dict[str, float | None]
    met: int
    missed: list[str]
    misfit: float


def _at_the_ends(points: Sequence[Point]) -> list[Point]:
    """Both ends of the range of frequencies."""
    return [one for one in points if one.frequency in _FREQUENCIES or len(points) == 1]


@cache
def walkers_of_the_paper() -> dict[Point, Case]:
    """The walkers of `FITTED` without calibration: perfect wetting, volume fraction 1 %, viscosity of the liquid."""
    cases = {}
    for point in (one for number in FITTED for part in (number.of, number.over) for one in _at_the_ends(part)):
        case = point.case()
        known = library.library_of({}).liquid(case.liquid.name or "")
        viscosity = known["kinematic_viscosity"].value * known["density"].value
        liquid = replace(case.liquid, dynamic_viscosity=viscosity, volume_fraction=0.01, contact_angle=0.0)
        contact = replace(case.contact, minimum_separation_ratio=0.01)
        cases[point] = replace(case, liquid=liquid, contact=contact)
    return cases


@cache
def _walkers() -> Walker:
    return Walker.joined([Walker.of_case(case) for case in walkers_of_the_paper().values()])


def speeds(parameters: Mapping[str, float]) -> dict[str, dict[Point, float]]:
    """Velocities of the paper's walkers, m/s, by quantity and point; NaN where the forces have no solution.

    The parameters are those of `ALWAYS` and of any of `TERMS`.
    """
    cases, walkers = walkers_of_the_paper(), _walkers()
    known = {**_WITHOUT, "log10_kappa": -inf, **parameters}
    scale = np.array([[known["wall_bridge_factor"]]] * 2 + [[known["bead_bridge_factor"]]])
    on_slide = np.array([point.sweep == "fig4" for point in cases])
    wall = np.where(on_slide, known["friction_slide"], known["friction_wall"])
    kinetic = np.asarray(Friction.coulomb(wall, np.full(len(cases), known["friction_bead"])).kinetic)
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
    # Contacts that would open for a moment are allowed: in the engine, walkers hop there and walk on.
    sliding = np.where(motion.solved, motion.sliding, np.nan)
    columns = {"velocity": translation(sliding), "sliding_1": sliding[0]}
    return {name: dict(zip(cases, map(float, values), strict=True)) for name, values in columns.items()}


def values_of(parameters: Mapping[str, float], wanted: Sequence[Observation]) -> dict[str, float]:
    """Predictions of the published numbers for given parameters, m/s or ratios, by name."""
    found = speeds(parameters)
    values = {}
    for number in wanted:
        above, below = ([found[number.quantity][one] for one in _at_the_ends(p)] for p in (number.of, number.over))
        value = fmean(above)
        if below:
            value = value / fmean(below) if fmean(below) else nan
        values[number.fitted] = value
    return values


def fit(
    name: str,
    ranges: Ranges,
    wanted: Sequence[Observation] = FITTED,
    *,
    fixed: Mapping[str, float] | None = None,
    begin: Mapping[str, float] | None = None,
    generations: int = 120,
) -> Fit:
    """The parameters with the least misfit (`scipy.optimize.differential_evolution`).

    Parameters
    ----------
    name, ranges
        Name of the terms, and ranges of all fitted parameters; others are ``fixed``.
    wanted
        Numbers to fit, of `FITTED`.
    begin
        Initial parameters; missing parameters of a term begin where the term has no effect.
    generations
        Generations of the search.
    """
    from scipy.optimize import differential_evolution

    def residuals(values: Mapping[str, float]) -> FloatArray:
        found = np.array([(values[number.fitted] - number.si) / number.si_deviation for number in wanted])
        return np.where(np.isfinite(found), found, _HOPELESS)

    def outcome(point: FloatArray) -> tuple[dict[str, float], dict[str, float]]:
        parameters = dict(zip(ranges, map(float, point), strict=True))
        return parameters, values_of({**(fixed or {}), **parameters}, wanted)

    start = {**_WITHOUT, **(begin or {})}
    found = differential_evolution(
        lambda point: float(np.log1p(residuals(outcome(point)[1]) ** 2).sum()),
        list(ranges.values()),
        maxiter=generations,
        popsize=12,
        rng=np.random.default_rng(1),
        polish=False,
        x0=[start[key] for key in ranges] if start.keys() >= ranges.keys() else None,
    )
    parameters, values = outcome(found.x)
    apart = np.abs(residuals(values))
    missed = [wanted[place].fitted for place in np.argsort(apart)[::-1] if apart[place] > 1.0]
    finite = {key: value if isfinite(value) else None for key, value in values.items()}
    return Fit(name, parameters, finite, len(wanted) - len(missed), missed, float(found.fun))


def try_model_terms(to: Path) -> list[Fit]:
    """Fit without any term, with each, with all of them, and the paper's law alone; write ``model_terms.md``."""
    require("theory")
    bare = fit("Coulomb friction and the bridges' resistance", ALWAYS)
    # Begin where the others end, so that more parameters do not give a worse fit.
    added = [fit(name, {**ALWAYS, **ranges}, begin=bare.parameters) for name, ranges in TERMS.items()]
    best = min(added, key=lambda one: one.misfit)
    every = {**ALWAYS, **{key: ends for ranges in TERMS.values() for key, ends in ranges.items()}}
    together = fit("all of these", every, begin=best.parameters)
    fits = [bare, *added, together, fit("the paper's law alone, integrated", KAPPA, fixed=NOTHING_ELSE)]
    to.mkdir(parents=True, exist_ok=True)
    write_text(to / PAGE_NAME, rendered("walkers.paper", "model_terms.md.j2", fits=fits, of=len(FITTED)))
    return fits
