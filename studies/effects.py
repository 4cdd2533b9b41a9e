"""What effects beyond the bridge law would change in the theory of the dimer.

``python -m studies.effects`` prints the table. docs/explanation/unexplained.md explains the effects
and shows the table. SI units. Nothing here changes the law or the engine.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import pi, sqrt
from typing import Any

import numpy as np

from walkers import load_case
from walkers.arrays import FloatArray
from walkers.extras import require
from walkers.inputs.resolving.loads import contact_loads, dimer_of
from walkers.inputs.tables.case import Case
from walkers.main import main, new_app
from walkers.text import aligned_rows
from walkers.theory.motion import Walker, predict_motion
from walkers.theory.stepping import edge_forces

COMMAND = "python -m studies.effects"
app = new_app(COMMAND)

_STEPS_PER_CYCLE = 512
"""Time steps of the theory; 2048 change velocities by less than 0.01 mm/s."""

_LIFT = sqrt(140.0)
"""A sphere under the load N rolls at the height h = 140 R (η U R/N)² in a liquid that cavitates."""

_SLOW = 1e-3
"""Velocity over which the couple of hysteresis changes its sign, m/s."""

_VELOCITY_OF_SIZES = 0.05
"""Velocity at which the table gives the size of an effect, m/s."""

_PEAKS = (2, 3, 5, 6, 10)
"""Peak accelerations of the walker of Fig. 2, g."""


@dataclass(frozen=True)
class Effect:
    """An effect and its size; the defaults are the law alone."""

    name: str
    """Name in the table, with the letter of the documentation."""
    lifted_above: float = 0.0
    """Height of the asperities above which the liquid lifts rolling beads, m; 0: no lift."""
    hysteresis: float = 0.0
    """cos θ of receding edges on beads, minus that of advancing ones."""
    merged: bool = False
    """Whether the bridges of both beads to the substrate are one."""
    asperities: float = 0.0
    """Sliding resistance of flows between asperities, over 3πηR."""
    changes: Mapping[str, Any] = field(default_factory=dict)
    """Changes of the cases, by dotted keys."""


_WIDE = {"liquid.meniscus_radius": "150 um"}
EFFECTS = (
    Effect("the law"),
    Effect("(a) lift above 40 nm", lifted_above=40e-9),
    Effect("(a) lift above 0.3 µm", lifted_above=0.3e-6),
    Effect("(a) lift above 3 µm", lifted_above=3e-6),
    Effect("(b) merged bridges", merged=True),
    Effect("(b) merged bridges, 150 µm", merged=True, changes=_WIDE),
    Effect("(c) hysteresis of 20°", hysteresis=0.06),
    Effect("(d) menisci of 20 µm", changes={"liquid.meniscus_radius": "20 um"}),
    Effect("(d) menisci of 150 µm", changes=_WIDE),
    Effect("(e) no edges", changes={"liquid.edge_ratio": 0.0}),
    Effect("(e) edges as estimated", changes={"liquid.edge_ratio": 1.0}),
    Effect("(e) twice the estimate", changes={"liquid.edge_ratio": 2.0}),
    Effect("(f) asperities", asperities=1.0),
    Effect("(f) asperities, ten times", asperities=10.0),
)
"""The rows of the table."""


def _cases(changes: Mapping[str, Any]) -> dict[str, Case]:
    """The cases of a row of the table, changed by dotted keys. The first one is a walker at 2 g."""
    cases = {}
    for peak in _PEAKS:
        for frequency in (60, 90):
            drive = {
                "drive.peak_acceleration": f"{peak} g",
                "drive.frequency": f"{frequency} Hz",
            }
            cases[f"{peak} g, {frequency} Hz"] = load_case("fig1b", {**drive, **changes})
    force = {"drive.gamma0": 0.5}
    cases["Fig. 3, 0.3"] = load_case("fig1b", {**force, **changes})
    larger = {"dimers.radii": ["0.4 mm", "0.2 mm"]}
    cases["Fig. 3, 0.4"] = load_case("fig1b", {**force, **larger, **changes})
    cases["Fig. 4a"] = load_case("fig4a", changes)
    cases["Fig. 4b"] = load_case("fig4b", changes)
    return cases


# --- the effects as terms of the theory -----------------------------------------------------------


def _contact_radii(case: Case) -> FloatArray:
    """Reduced radii of the contacts: of both beads with the substrate, and of the beads; m."""
    dimer = dimer_of(case)
    return np.array([*dimer.radii, dimer.reduced_radius])


def _terms(case: Case, effect: Effect) -> FloatArray:
    """The ten parameters of `effect_terms` for a case, forces over 4πγR̄."""
    liquid = case.liquid.of_bridges
    tension = liquid.surface_tension
    radii = _contact_radii(case)
    lowest_lift = effect.lifted_above or np.inf
    lifts = _LIFT * liquid.viscosity * radii * np.sqrt(radii / lowest_lift)

    volumes = np.array([load.surfaces.volume for load in contact_loads(case)])
    wetted_radii = (4.0 * radii * volumes / pi) ** 0.25  # r_w of the law
    wetted_on_beads = wetted_radii[:2] + wetted_radii[2]
    couples = 2.0 * tension * effect.hysteresis * wetted_on_beads

    dimer = dimer_of(case)
    forces = np.concatenate([lifts, couples]) / dimer.capillary_scale
    return np.concatenate([forces, Walker.of_case(case).edges[:, 0], dimer.radii])


def _lost_loads(case: Case, effect: Effect) -> FloatArray:
    """Capillary force that the three contacts lose as bridges merge, over 4πγR̄."""
    if not effect.merged:
        return np.zeros(3)
    liquid = case.liquid.of_bridges
    dimer = dimer_of(case)
    radii = np.array(dimer.radii)
    menisci = 2.0 * np.sqrt(radii * liquid.meniscus_radius)
    distance = 2.0 * sqrt(radii.prod())
    suction = liquid.surface_tension / liquid.meniscus_radius
    lost = suction * _common_area(menisci, distance)
    return np.array([0.5, 0.5, 0.0]) * lost / dimer.capillary_scale


def _common_area(radii: FloatArray, distance: float) -> float:
    """Area that two discs have in common, m²; radii and distance of their centres in m."""
    if radii.sum() <= distance:
        return 0.0
    to_chord = (distance**2 + radii**2 - radii[::-1] ** 2) / (2.0 * distance)
    sectors = radii**2 @ np.arccos(to_chord / radii)
    return float(sectors - distance * sqrt(radii[0] ** 2 - to_chord[0] ** 2))


def effect_terms(
    sliding: tuple[float, float, float], normal: FloatArray, friction: FloatArray, terms: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Add the effects to the motion.

    Contacts 1 and 2 are those of the beads with the substrate, contact 3 is that of the beads.

    Parameters
    ----------
    sliding
        Sliding velocities of the contacts, m/s.
    normal
        Normal forces of the contacts, over 4πγR̄, shape (3,).
    friction
        Friction of the contacts, shape (3, 3): for each the coefficient at rest, its rise, and the
        velocity of half of the rise.
    terms
        Sizes of the effects, shape (10,): lift of the contacts, couples of hysteresis on the beads,
        and the parameters of `walkers.theory.stepping.edge_forces`.

    Returns
    -------
    friction, forces, couples
        Friction, forces and couples for `walkers.theory.motion.predict_motion`.
    """
    lifts = terms[0:3]
    hysteresis = terms[3:5]
    velocity = 0.5 * (sliding[0] + sliding[1] - sliding[2])
    spins = (velocity - sliding[0], velocity - sliding[1])  # velocities -R dφ/dt
    entraining = (
        0.5 * (velocity + spins[0]),
        0.5 * (velocity + spins[1]),
        0.5 * (spins[0] - spins[1]),
    )
    friction = friction.copy()
    for contact in range(3):
        if normal[contact] > 0.0:
            lift = lifts[contact] * abs(entraining[contact])
            friction[contact, :2] *= max(0.0, 1.0 - lift / normal[contact])

    friction, forces, couples = edge_forces(sliding, normal, friction, terms[5:10])
    for bead in range(2):
        turning = hysteresis[bead] * np.tanh(spins[bead] / _SLOW)
        couples += 0.5 * turning * np.array([1.0, 1.0, -1.0])
        couples[bead] -= turning
    return friction, forces, couples


# --- the table ------------------------------------------------------------------------------------


def row(effect: Effect) -> dict[str, str]:
    """The row of an effect in the table: texts by the heads of the columns."""
    cases = _cases(effect.changes)
    all_cases = list(cases.values())
    terms = np.array([_terms(case, effect) for case in all_cases])
    lost = np.array([_lost_loads(case, effect) for case in all_cases])
    walker = _walkers(all_cases, effect, lost)
    motion = predict_motion(
        walker,
        [case.excitation.frequency for case in all_cases],
        [case.excitation.peak_acceleration for case in all_cases],
        steps_per_cycle=_STEPS_PER_CYCLE,
        effect=(effect_terms, terms),
    )
    velocity = dict(zip(cases, 1e3 * motion.velocity, strict=True))
    mean = {}
    for peak in _PEAKS:
        mean[peak] = (velocity[f"{peak} g, 60 Hz"] + velocity[f"{peak} g, 90 Hz"]) / 2.0
    force = _force_at_large_bead(all_cases[0], effect, terms[0], lost[0])
    numbers = {
        "size, %": 100.0 * force / walker.normal_at_rest[0, 0],
        "2 g": mean[2],
        "3 g": mean[3],
        "5 g": mean[5],
        "6 g": mean[6],
        "10 g / 6 g": mean[10] / mean[6],
        "Fig. 3, 0.4 / 0.3": velocity["Fig. 3, 0.4"] / velocity["Fig. 3, 0.3"],
        "4a": velocity["Fig. 4a"],
        "4a, small bead slides, %": 100.0 * motion.sliding[1, -2] / motion.velocity[-2],
        "4b": velocity["Fig. 4b"],
        "4b, rotation": 1e3 * motion.rotation[0, -1],
    }
    texts = {"mm/s": effect.name}
    for head, number in numbers.items():
        texts[head] = f"{number:.2f}" if np.isfinite(number) else "opens"
    return texts


def _walkers(cases: Sequence[Case], effect: Effect, lost: FloatArray) -> Walker:
    """The walkers of N cases with the loads and sliding resistances of an effect.

    ``lost`` is as from `_lost_loads`, shape (N, 3).
    """
    walker = Walker.joined([Walker.of_case(case) for case in cases])
    # `effect_terms` has the forces of edges: the theory takes one further force law.
    walker = replace(walker, edges=np.zeros_like(walker.edges))
    resistances = walker.resistances.copy()
    resistances[0] += effect.asperities * np.array([_squeezing(case) for case in cases]).T
    return replace(
        walker,
        normal_at_rest=walker.normal_at_rest - lost.T,
        resistances=resistances,
    )


def _squeezing(case: Case) -> FloatArray:
    """The unit of `Effect.asperities`, 3πηR, at the three contacts, N s/m."""
    return 3.0 * pi * case.liquid.of_bridges.viscosity * _contact_radii(case)


def _force_at_large_bead(case: Case, effect: Effect, terms: FloatArray, lost: FloatArray) -> float:
    """Force of an effect at the contact of the large bead with the substrate, over 4πγR̄.

    The velocity is 50 mm/s; ``terms`` and ``lost`` are those of the case.
    """
    lift = terms[0] * _VELOCITY_OF_SIZES
    couple = terms[3]
    sliding = effect.asperities * _squeezing(case)[0] * _VELOCITY_OF_SIZES
    sliding /= dimer_of(case).capillary_scale
    return float(lift + couple + sliding + lost[0])


def rows() -> list[dict[str, str]]:
    """The table: a row for each of `EFFECTS`, texts by the heads of the columns."""
    require("theory")
    return [row(effect) for effect in EFFECTS]


@app.default
def effects() -> None:
    """Print what effects beyond the law would change: velocities by the theory, mm/s."""
    table = rows()
    print(aligned_rows(table, right=range(1, len(table[0]))))


if __name__ == "__main__":
    main(app=app)
