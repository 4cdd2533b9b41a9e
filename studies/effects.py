"""What effects that the law leaves out would change, by the theory: ``python -m studies.effects`` prints the table.

docs/explanation/unexplained.md explains the effects and shows the table. SI units.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from math import pi, sqrt
from typing import Any

import numpy as np

from walkers import load_case
from walkers.arrays import FloatArray
from walkers.extras import require
from walkers.inputs.resolving.loads import contact_loads, dimer_of
from walkers.inputs.tables.case import Case
from walkers.main import main, new_app
from walkers.text import aligned
from walkers.theory.motion import Walker, predict_motion

COMMAND = "python -m studies.effects"
app = new_app(COMMAND)

_STEPS = 512  # per cycle; 2048 change velocities by less than 0.01 mm/s
_LIFT = sqrt(
    140.0
)  # a sphere under the load N rolls at h = 140 R (η U R/N)² in a liquid that cavitates
_EDGES = 4.70 * 1.682 / 2.0
"""Drag of the edge of a bridge over 2 r_w γ Ca^⅔: 4.70 γ Ca^⅔ per length of front and rear together, along the normal
of an edge that moves at U cos φ; the integral of cos^(5/3) φ over half of it is 1.682."""
_SLOW = 1e-3  # m/s; the couple of hysteresis changes its sign over this velocity
_SHOWN = 0.05  # m/s, of the column of sizes
_PEAKS = (2, 3, 5, 6, 10)
_CASES: Mapping[str, tuple[str, Mapping[str, Any]]] = {
    **{
        f"{peak} g, {hertz} Hz": (
            "fig1b",
            {"drive.peak_acceleration": f"{peak} g", "drive.frequency": f"{hertz} Hz"},
        )
        for peak in _PEAKS
        for hertz in (60, 90)
    },
    "Fig. 3, 0.3": ("fig1b", {"drive.gamma0": 0.5}),
    "Fig. 3, 0.4": ("fig1b", {"drive.gamma0": 0.5, "dimers.radii": ["0.4 mm", "0.2 mm"]}),
    **{f"Fig. {name}": (f"fig{name}", {}) for name in ("4a", "4b")},
}


@dataclass(frozen=True)
class Effect:
    """An effect and its size; the defaults are the law alone."""

    name: str
    lifted_above: float = 0.0  # height of asperities, m, from which the liquid lifts rolling beads
    hysteresis: float = 0.0  # cos θ of receding edges on beads, minus that of advancing ones
    edges: tuple[float, float] = (0.0, 0.0)  # drags on the substrate and on beads, as `_EDGES`
    merged: bool = False  # the bridges of both beads to the substrate
    asperities: float = 0.0  # sliding resistance of flows between asperities over 3πηR
    friction: tuple[float, float] = (
        1.0,
        1.0,
    )  # factors on that of beads with the substrate, and with each other
    changes: Mapping[str, Any] = field(default_factory=dict)  # of keys of the cases


_ALL = (_EDGES, _EDGES)
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
    Effect("(e) edges on the substrate", edges=(_EDGES, 0.0)),
    Effect("(e) all edges", edges=_ALL),
    Effect("(e) all edges, more friction", edges=_ALL, friction=(1.2, 1.1)),
    Effect("(e) all edges, more friction, 150 µm", edges=_ALL, friction=(1.4, 1.2), changes=_WIDE),
    Effect("(f) asperities", asperities=1.0),
    Effect("(f) asperities, ten times", asperities=10.0),
)


def _curved(case: Case) -> FloatArray:
    """Reduced radii of the contacts, m."""
    return np.array([*dimer_of(case).radii, dimer_of(case).reduced_radius])


def _parts(case: Case, effect: Effect) -> tuple[FloatArray, FloatArray]:
    """Parameters of `effect_terms` for a case, and losses of the loads of its contacts, in units of 4πγR̄."""
    dimer, liquid, loads = dimer_of(case), case.liquid.of_bridges, contact_loads(case)
    tension, radii, curved = liquid.surface_tension, np.array(dimer.radii), _curved(case)
    wetted = (
        4.0 * curved * [load.surfaces.volume for load in loads] / pi
    ) ** 0.25  # r_w of the law
    on_bead = wetted[:2] + wetted[2]
    above = effect.lifted_above or np.inf
    lifts = _LIFT * liquid.viscosity * curved * np.sqrt(curved / above)
    couples = 2.0 * tension * effect.hysteresis * on_bead
    edges = np.array(effect.edges)[:, None] * [wetted[:2], on_bead]
    drags = 2.0 * tension * np.cbrt(liquid.viscosity / tension) ** 2 * edges
    discs = 2.0 * np.sqrt(radii * liquid.meniscus_radius)
    lost = (
        effect.merged * tension / liquid.meniscus_radius * _common(discs, 2.0 * sqrt(radii.prod()))
    )
    unit = dimer.capillary_scale
    return np.concatenate([lifts, couples, *drags]) / unit, np.array([0.5, 0.5, 0.0]) * lost / unit


def _common(edges: FloatArray, apart: float) -> float:
    """Area that two discs have in common, m²."""
    parts = (apart**2 + edges**2 - edges[::-1] ** 2) / (2.0 * apart)
    if edges.sum() <= apart:
        return 0.0
    return float(edges**2 @ np.arccos(parts / edges) - apart * sqrt(edges[0] ** 2 - parts[0] ** 2))


def effect_terms(
    sliding: tuple[float, float, float], normal: FloatArray, friction: FloatArray, terms: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The effects in the motion (`walkers.theory.motion.predict_motion`), to be compiled."""
    along = 0.5 * (sliding[0] + sliding[1] - sliding[2])
    spins = (along - sliding[0], along - sliding[1])  # velocities -R dφ/dt
    entraining = (0.5 * (along + spins[0]), 0.5 * (along + spins[1]), 0.5 * (spins[0] - spins[1]))
    friction, forces, couples = friction.copy(), np.zeros(3), np.zeros(3)
    for at in range(3):
        if normal[at] > 0.0:
            friction[at] *= max(0.0, 1.0 - terms[at] * abs(entraining[at]) / normal[at])
    for at in range(2):
        forces[at] = terms[5 + at] * np.sign(along) * abs(along) ** (2.0 / 3.0)
        turning = terms[7 + at] * np.sign(spins[at]) * abs(spins[at]) ** (2.0 / 3.0)
        turning += terms[3 + at] * np.tanh(spins[at] / _SLOW)
        couples += 0.5 * (forces[at] + turning) * np.array([1.0, 1.0, -1.0])
        couples[at] -= forces[at] + turning
    return friction, forces, couples


@cache
def _compiled() -> Callable[..., Any]:
    """`effect_terms` as the theory calls it, compiled once."""
    from numba import njit

    compiled: Callable[..., Any] = njit(effect_terms)
    return compiled


def row(effect: Effect) -> dict[str, str]:
    """The row of an effect in the table."""
    cases = [load_case(name, {**changes, **effect.changes}) for name, changes in _CASES.values()]
    terms, lost = map(np.array, zip(*(_parts(case, effect) for case in cases), strict=True))
    walker = Walker.joined([Walker.of_case(case) for case in cases])
    more = np.array([effect.friction[0], *effect.friction])[:, None]
    resistances = walker.resistances.copy()
    squeezed = np.array(
        [3.0 * pi * case.liquid.of_bridges.viscosity * _curved(case) for case in cases]
    ).T
    resistances[0] += effect.asperities * squeezed
    walker = replace(
        walker,
        friction=walker.friction * more,
        at_rest=walker.at_rest - lost.T,
        resistances=resistances,
    )
    motion = predict_motion(
        walker,
        [case.excitation.frequency for case in cases],
        [case.excitation.peak_acceleration for case in cases],
        steps_per_cycle=_STEPS,
        effect=(_compiled(), terms),
    )
    velocity = dict(zip(_CASES, 1e3 * motion.velocity, strict=True))
    mean = {
        peak: (velocity[f"{peak} g, 60 Hz"] + velocity[f"{peak} g, 90 Hz"]) / 2.0 for peak in _PEAKS
    }
    slide = effect.asperities * squeezed[0, 0] * _SHOWN / dimer_of(cases[0]).capillary_scale
    lift, turn, drags = (
        terms[0, 0] * _SHOWN,
        terms[0, 3],
        (terms[0, 5] + terms[0, 7]) * _SHOWN ** (2.0 / 3.0),
    )
    numbers = {
        "size, %": 100.0 * (lift + turn + drags + slide + lost[0, 0]) / walker.at_rest[0, 0],
        **{f"{peak} g": mean[peak] for peak in _PEAKS[:-1]},
        "10 g / 6 g": mean[10] / mean[6],
        "Fig. 3, 0.4 / 0.3": velocity["Fig. 3, 0.4"] / velocity["Fig. 3, 0.3"],
        "4a": velocity["Fig. 4a"],
        "4a, small bead slides, %": 100.0 * motion.sliding[1, -2] / motion.velocity[-2],
        "4b": velocity["Fig. 4b"],
        "4b, rotation": 1e3 * motion.rotation[0, -1],
    }
    texts = {
        name: f"{number:.2f}" if np.isfinite(number) else "opens"
        for name, number in numbers.items()
    }
    return {"mm/s": effect.name, **texts}


def rows() -> list[dict[str, str]]:
    """The table: a row for each of `EFFECTS`, texts by the heads of the columns."""
    require("theory")
    return [row(effect) for effect in EFFECTS]


@app.default
def effects() -> None:
    """Print what effects that the law leaves out would change: velocities by the theory, mm/s."""
    table = rows()
    heads = list(table[0])
    print(aligned([heads, *(list(row.values()) for row in table)], right=range(1, len(heads))))


if __name__ == "__main__":
    main(app=app)
