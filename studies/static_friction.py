"""Friction that is larger at rest than in motion: whether it gives what no calibration does, and the engine has it.

The experiments are those of the shipped calibration, walked through by the second engine, whose laws can be replaced.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import degrees, isfinite, log
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from walkers.audit.bench import FIRST_BEAD, Bench, bench_case, bench_recording, scene_on_floor
from walkers.inputs.calibration import Calibration, Observation, load_calibration
from walkers.inputs.case import Case
from walkers.inputs.library import surface_pair
from walkers.inputs.loads import contact_loads
from walkers.inputs.reading import load_case
from walkers.inputs.text import rendered
from walkers.paper import published
from walkers.physics.wall import WALL_COPIES
from walkers.postprocess.drawing import TWO_COLUMNS, letter_panels, new_figure, styled
from walkers.studies.audited import temporary_bench
from walkers.studies.chapter import Chapter
from walkers.studies.crosscheck.engine import Beads
from walkers.studies.crosscheck.kernels import FloatArray
from walkers.studies.crosscheck.laws import Laws
from walkers.studies.crosscheck.setup import engine_at
from walkers.templates.deck import Plan, plan_of
from walkers.templates.engine import STATIC_SPRING
from walkers.templates.placement import place
from walkers.templates.scene import Bead

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CYCLES = 24
"""Of which the first third settles."""
KINETIC = Laws()
RATIOS = (1.0, 1.2, 1.4, 1.6, 1.8, 2.2)
"""Static over kinetic friction, at which the plateau is looked at."""
FOUND: Mapping[str, float] = {
    "friction_wall": 0.277,
    "friction_slide": 0.602,
    "friction_bead": 0.0766,
    "rolling_friction": 0.00487,
    "viscosity_ratio": 8.89,
    "minimum_separation_ratio": 0.00782,
    "volume_fraction": 0.2,
    "film_drag": 0.454,
    "contact_angle": 40.5,
    "restitution": 0.444,
}
FOUND_RATIO = 1.376
"""What `search` found with friction that is larger at rest, begun at the set that was shipped before: parameters
(kinetic frictions), and the ratio of the frictions."""
_APART = 1.6
"""Sums of the radii; beads farther apart are no walker."""


@dataclass(frozen=True)
class Outcome:
    """What a set of parameters gives under some laws: speeds of the calibration's experiments, mm/s; NaN: no walker."""

    name: str
    parameters: Mapping[str, float]
    laws: Laws
    speeds: Mapping[str, float]

    def observed(self, observation: Observation) -> float:
        """What it says of an observation of speeds, mm/s or a ratio."""
        above = float(np.mean([self.speeds[one] for one in observation.of]))
        return above / float(np.mean([self.speeds[one] for one in observation.over])) if observation.over else above


def shipped() -> dict[str, float]:
    """The library's values of the calibration's parameters, and the restitution that cases have if they do not say."""
    prism, slide = surface_pair("ruby", "chromium-coated glass"), surface_pair("ruby", "glass")
    beads, contact = surface_pair("ruby", "ruby"), load_case("fig1b").contact
    assert prism is not None and slide is not None and beads is not None, "the library has ruby's surface pairs"
    same = ("rolling_friction", "viscosity_ratio", "minimum_separation_ratio", "volume_fraction")
    return {
        "friction_wall": prism["friction"].value,
        "friction_slide": slide["friction"].value,
        "friction_bead": beads["friction"].value,
        **{name: prism[name].value for name in same},
        "film_drag": prism["film_drag_ratio"].value,
        "contact_angle": degrees(prism["contact_angle"].value),
        "restitution": contact.restitution,
    }


def sets() -> dict[str, tuple[Mapping[str, float], Laws]]:
    """Parameters and laws by what they are: the shipped ones, and those with the friction that is larger at rest."""
    at_rest = Laws(static_friction="stick-slip", static_ratio=FOUND_RATIO)
    return {"one coefficient (shipped)": (shipped(), KINETIC), "larger at rest (found)": (FOUND, at_rest)}


def observations(calibration: Calibration) -> list[Observation]:
    """The calibration's observations of speeds, none that follows from others."""
    return [one for one in calibration.observations if one.quantity == "velocity" and not one.derived]


def residual(outcome: Outcome, observation: Observation) -> float:
    """In standard deviations; infinite where there is no walker."""
    scale = 1.0 if observation.over else 1e3
    found = (outcome.observed(observation) - scale * observation.value) / (scale * observation.deviation)
    return found if isfinite(found) else float("inf")


def misfit(outcome: Outcome, calibration: Calibration) -> float:
    """Σ ln(1 + r²) over the observations of speeds, so that no single one decides; without a walker r counts as 30."""
    return sum(log(1.0 + min(abs(residual(outcome, one)), 30.0) ** 2) for one in observations(calibration))


def evaluate(
    name: str, parameters: Mapping[str, float], laws: Laws, calibration: Calibration, only: Sequence[str] | None = None
) -> Outcome:
    """Let the second engine walk through the calibration's experiments of speeds.

    Parameters
    ----------
    name
        Of the set.
    parameters
        Of the calibration, each in its unit.
    laws
        Of the second engine.
    calibration
        Whose experiments.
    only
        Some of them; if left out, all that an observation of speeds is of.
    """
    cases = _experiments(parameters, calibration)
    asked = {label for one in observations(calibration) for label in (*one.of, *one.over)} if only is None else only
    return Outcome(name, parameters, laws, {label: _speed(cases[label], laws) for label in cases if label in asked})


def _experiments(parameters: Mapping[str, float], calibration: Calibration) -> dict[str, Case]:
    """The calibration's experiments with some parameters."""
    from walkers.calibration.waves import wave_sweep

    values = np.array([[parameters[one.name] for one in calibration.parameters]])
    return dict(zip(calibration.experiments, wave_sweep(calibration, values, "static").cases(), strict=True))


def _speed(case: Case, laws: Laws) -> float:
    """Of the case's first walker along its heading, mm/s; NaN if its beads part."""
    scene, walkers = place((case,))
    beads = [bead for bead in scene.beads if bead.id in walkers[0].beads]
    radius, position = np.array([bead.radius for bead in beads]), np.array([bead.centre for bead in beads])
    still = Beads(radius, position, np.zeros_like(position), np.zeros_like(position))
    frames = engine_at(case, still, laws).run(CYCLES * case.run.steps_per_cycle, case.run.steps_per_cycle)[:, :, :3]
    return _along_heading(frames, radius, case)


def _along_heading(frames: FloatArray, radius: FloatArray, case: Case) -> float:
    """Speed of the mass centre along the heading after the first third of the cycles, mm/s; NaN if the beads part.

    Parameters
    ----------
    frames : ndarray, shape (cycles, 2, 3)
        Places after each cycle, m.
    radius : ndarray, shape (2,)
    case
        With the drive.
    """
    arm = frames[:, 0] - frames[:, 1]
    if not np.isfinite(frames).all() or np.linalg.norm(arm, axis=1).max() > _APART * radius.sum():
        return float("nan")
    arm[:, 2] = 0.0
    heading = arm / np.linalg.norm(arm, axis=1, keepdims=True)
    centre = np.einsum("fbx,b->fx", frames, radius**3 / np.sum(radius**3))
    steps = np.einsum("fx,fx->f", np.diff(centre, axis=0), (heading[1:] + heading[:-1]) / 2.0)
    return float(1e3 * steps[len(frames) // 3 :].mean() * case.drive.frequency)


def search(
    calibration: Calibration,
    laws: Laws,
    start: Mapping[str, float],
    *,
    ratios: tuple[float, float] = (1.0, 3.0),
    evaluations: int = 300,
    seed: int = 1,
) -> Outcome:
    """Parameters and a ratio of the frictions with the least `misfit`, by differential evolution.

    Parameters
    ----------
    calibration
        Whose parameters are free, within their ranges; rolling friction, which speeds hardly depend on, stays.
    laws
        With the kind of static friction; its ratio is free.
    start
        A set to begin about.
    ratios
        Range of the static friction over the kinetic one.
    evaluations
        At most so many, of some seconds each.
    seed
        Of the search.
    """
    from scipy.optimize import differential_evolution

    from walkers.calibration.space import Space

    space = Space(calibration.parameters)
    names = [one.name for one in calibration.parameters]
    kept = names.index("rolling_friction")
    first = space.unit(np.array([start[name] for name in names]))

    def outcome(point: FloatArray) -> Outcome:
        unit = np.clip(point[:-1], 0.0, 1.0)
        unit[kept] = first[kept]
        found = dict(zip(names, map(float, space.values(unit)), strict=True))
        ratio = ratios[0] + float(point[-1]) * (ratios[1] - ratios[0])
        return evaluate("found", found, replace(laws, static_ratio=ratio), calibration)

    random = np.random.default_rng(seed)
    about = np.append(first, 0.3)
    population = max(12, len(about) + 4)
    points = np.clip(about + random.normal(0.0, 0.12, (population, len(about))), 0.0, 1.0)
    points[0] = about
    found = differential_evolution(
        lambda point: misfit(outcome(point), calibration),
        [(0.0, 1.0)] * len(about),
        init=points,
        maxiter=max(1, evaluations // population - 1),
        polish=False,
        rng=seed,
    )
    return outcome(found.x)


@dataclass(frozen=True)
class Sawtooth:
    """A bead that is drawn along a wall by the engine's model of static friction: friction over load, least to most."""

    speed: float
    time_step: float
    least: float
    mean: float
    most: float


_KINETIC, _RATIO = 0.3, 2.0


def sawteeth(bench: Bench) -> list[Sawtooth]:
    """Friction of a bead under its capillary load, drawn at several speeds with two time steps."""
    found = []
    for time_step in (1e-6, 4e-6):
        friction = {"bead_bead": 0.0, "bead_wall": _KINETIC}
        case = bench_case(
            contact={"friction": friction, "restitution": 0.3}, run={"time_step": f"{time_step * 1e6:g} us"}
        )
        load, radius = contact_loads(case).capillary[0], case.walkers[0].radii[0]
        for speed in (1e-4, 1e-3, 1e-2):
            # Deep enough for linear springs to carry the load on two walls.
            bead = Bead(
                FIRST_BEAD, (0.0, 0.0, radius - load / (WALL_COPIES * STATIC_SPRING)), radius, (speed, 0.0, 0.0)
            )
            plan = Plan(case, scene_on_floor([bead]), bench_recording(1000, 1), prescribed=True, static_ratio=_RATIO)
            series = bench.run(plan)
            drag = -series.force[500:, series.row(FIRST_BEAD), 0] / load
            found.append(Sawtooth(speed, time_step, float(drag.min()), float(drag.mean()), float(drag.max())))
    return found


def in_stock_engine(outcome: Outcome, calibration: Calibration, bench: Bench, only: Sequence[str]) -> dict[str, float]:
    """Speeds of some experiments, mm/s, by the engine's own model of static friction with a set's ratio."""
    cases = _experiments(outcome.parameters, calibration)
    found = {}
    for label in only:
        case = cases[label].for_cycles(CYCLES)
        plan = replace(plan_of(case), static_ratio=outcome.laws.static_ratio)
        series = bench.run(plan)
        rows = [series.row(bead) for bead in plan.walkers[0].beads]
        radius = np.array(case.walkers[0].radii)
        frames = series.position[:: case.run.samples_per_cycle, rows]
        found[label] = _along_heading(frames[1:], radius, case)
    return found


def chapter(out: Path, *, quick: bool = False) -> Chapter:
    """Whether friction that is larger at rest gives the plateau, together with the rest.

    Parameters
    ----------
    out
        Folder of the run directories; none is made.
    quick
        The plateau at two ratios alone, without the engine.
    """
    del out
    calibration = load_calibration("ruby")
    outcomes = [evaluate(name, *one, calibration, _PLATEAU if quick else None) for name, one in sets().items()]
    ratios = RATIOS[::3] if quick else RATIOS
    plateaus = {one.name: [plateau_at(ratio, one, calibration) for ratio in ratios] for one in outcomes}
    numbers: dict[str, Any] = {
        "sets": {one.name: {"parameters": dict(one.parameters), "laws": one.laws.differences()} for one in outcomes},
        "speeds": {one.name: dict(one.speeds) for one in outcomes},
        "plateau": {"ratios": list(ratios), **plateaus},
    }
    if not quick:
        with temporary_bench() as bench:
            stock = in_stock_engine(outcomes[-1], calibration, bench, _PLATEAU)
            teeth = sawteeth(bench)
        numbers |= {"stock": stock, "sawteeth": [vars(one) for one in teeth]}
    text = rendered(
        "walkers.studies",
        "static_friction.md.j2",
        quick=quick,
        rows=[] if quick else _rows(outcomes, calibration),
        given=[] if quick else [_given(one, calibration) for one in outcomes],
        outcomes=outcomes,
        names=[one.name for one in calibration.parameters],
        plateaus=plateaus,
        ratios=ratios,
        stock=None if quick else _plateau(stock),
        teeth=[] if quick else teeth,
        kinetic=_KINETIC,
        ratio=_RATIO,
    )
    figures = {} if quick else {"static-friction": draw(outcomes, plateaus)}
    failed = _unlike([_plateau(one.speeds) for one in outcomes])
    return Chapter("static-friction", "Friction that is larger at rest than in motion", text, figures, numbers, failed)


def _unlike(plateaus: Sequence[float]) -> tuple[str, ...]:
    """What the chapter says of the plateau and does not hold: of the shipped set, and of that with two coefficients."""
    alone, found = (abs(one - 1.0) <= _LEVEL for one in plateaus)
    told = (("one coefficient gives no plateau", not alone), ("two coefficients give the plateau", found))
    return tuple(statement for statement, holds in told if not holds)


_LEVEL = 0.2
"""v(10 g)/v(6 g) differs from 1 by less where speeds have levelled off: the calibration's deviation."""
_PLATEAU = ("fig2_60_6", "fig2_90_6", "fig2_60_10", "fig2_90_10")


def _plateau(speeds: Mapping[str, float]) -> float:
    """The ratio v(10 g)/v(6 g) of Fig. 2."""
    low, high = (np.mean([speeds[f"fig2_{frequency}_{peak}"] for frequency in (60, 90)]) for peak in (6, 10))
    return float(high / low)


def plateau_at(ratio: float, outcome: Outcome, calibration: Calibration) -> float:
    """The ratio v(10 g)/v(6 g) of Fig. 2 if friction at rest is so many times that in motion, all else as in a set."""
    laws = replace(outcome.laws, static_friction="stick-slip", static_ratio=ratio) if ratio > 1.0 else KINETIC
    return _plateau(evaluate("scan", outcome.parameters, laws, calibration, _PLATEAU).speeds)


def _rows(outcomes: Sequence[Outcome], calibration: Calibration) -> list[dict[str, Any]]:
    """An observation a row: what is published, and what each set gives, whether within the deviation."""
    return [
        {
            "title": one.title or one.name,
            "published": one.value * (1.0 if one.over else 1e3),
            "found": [
                (round(outcome.observed(one), 4) + 0.0, abs(residual(outcome, one)) <= 1.0) for outcome in outcomes
            ],
        }
        for one in observations(calibration)
    ]


def _given(outcome: Outcome, calibration: Calibration) -> dict[str, Any]:
    """How many of the observations a set gives."""
    asked = observations(calibration)
    missed = [one.title or one.name for one in asked if abs(residual(outcome, one)) > 1.0]
    told = {"within": len(asked) - len(missed), "of": len(asked), "misfit": misfit(outcome, calibration)}
    return {"name": outcome.name, "missed": "; ".join(missed), **told}


@styled
def draw(outcomes: Sequence[Outcome], plateaus: Mapping[str, Sequence[float]]) -> Figure:
    """Figs. 2 and 3 by each set, and the plateau against the ratio of the frictions."""
    figure, (fig2, fig3, scan) = new_figure(TWO_COLUMNS, 3.0, ncols=3)
    fit = published.FIT
    fig2.plot(list(fit), [1e3 * speed for speed in fit.values()], "k-", lw=2.0, alpha=0.5, label="published")
    fig2.plot([6.0, 10.0], [1e3 * fit[6.0]] * 2, "k--", lw=2.0, alpha=0.5)
    fig3.plot(_asymmetries(), [1e3 * speed for speed in published.FIG3_FIT.values()], "k-", lw=2.0, alpha=0.5)
    for number, outcome in enumerate(outcomes):
        _draw_set(fig2, fig3, outcome, f"C{number}")
        scan.plot(RATIOS, plateaus[outcome.name], "o-", color=f"C{number}", mfc="none")
    scan.axhline(1.0, color="k", ls="--", lw=2.0, alpha=0.5)
    fig2.set(xlabel="peak acceleration (g)", ylabel="velocity (mm/s)", title="Fig. 2, 60 and 90 Hz")
    fig3.set(xlabel="sin δ", ylabel="velocity (mm/s)", title="Fig. 3, Γ0 = 0.5")
    scan.set(xlabel="friction at rest / in motion", ylabel="v(10 g)/v(6 g)", title="plateau of Fig. 2")
    letter_panels((fig2, fig3, scan))
    handles, labels = fig2.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


def _asymmetries() -> list[float]:
    return [(one - other) / (one + other) for one, other in published.FIG3_FIT]


def _draw_set(fig2: Axes, fig3: Axes, outcome: Outcome, color: str) -> None:
    for frequency, style in ((60, "o-"), (90, "s:")):
        peaks = [g for g in (2, 3, 4, 5, 6, 10) if f"fig2_{frequency}_{g}" in outcome.speeds]
        speeds = [outcome.speeds[f"fig2_{frequency}_{g}"] for g in peaks]
        label = outcome.name if frequency == 60 else None
        fig2.plot(peaks, speeds, style, color=color, mfc="none", label=label)
    speeds = [outcome.speeds[f"fig3_{number}"] for number in range(1, 6)]
    fig3.plot(_asymmetries(), speeds, "o-", color=color, mfc="none")
