"""How far laws of capillary bridges are from the Young–Laplace equation, and what that does to walkers."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from functools import cache, lru_cache
from math import acos, degrees, inf, log, pi
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.optimize import brentq

from walkers.inputs.case import Case
from walkers.inputs.loads import contact_loads, dimer_of
from walkers.inputs.reading import load_case
from walkers.inputs.text import rendered
from walkers.inputs.units import ACCELERATION_OF_ONE_G
from walkers.physics import capillary
from walkers.physics.laplace import POINTS, FloatArray, ForceCurve, bridge, force_curve
from walkers.postprocess.drawing import TWO_COLUMNS, letter_panels, new_figure, styled
from walkers.studies.bridge_laws import ENGINE, LAWS, Law
from walkers.studies.chapter import Chapter
from walkers.theory.motion import Walker, walk
from walkers.theory.prediction import friction_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CONTACT_NAMES = ("large bead on wall", "small bead on wall", "bead on bead")
WALL = ("wall", (3.0e-4, inf))
_GAPS = 280
_SMALL_CHANGE = 0.02


@dataclass(frozen=True)
class Condition:
    """A bridge of the project's: radii in m (the second infinity at a wall), liquid over a bead's volume, rad."""

    name: str
    radius_1: float
    radius_2: float
    volume_fraction: float
    contact_angle: float

    @property
    def volume(self) -> float:
        """Liquid in the bridge as the engine has it, m³."""
        if self.radius_2 == inf:
            return capillary.bridge_volume_at_wall(self.radius_1, self.volume_fraction)
        return capillary.bridge_volume_between_beads(self.radius_1, self.radius_2, self.volume_fraction)

    @property
    def bridge(self) -> tuple[float, float, float, float]:
        """Arguments of a law's: radii, volume, contact angle."""
        return self.radius_1, self.radius_2, self.volume, self.contact_angle


@dataclass(frozen=True)
class Deviation:
    """A law beside Young–Laplace: ratios of the law's value to the reference's.

    Attributes
    ----------
    pull
        At contact.
    work
        From contact to the law's rupture and to the reference's.
    rupture
        Largest gaps.
    largest
        Largest difference of the forces at any gap, none beyond rupture, over the reference's pull at contact.
    """

    pull: float
    work: float
    rupture: float
    largest: float


@lru_cache(maxsize=256)
def reference(condition: Condition) -> ForceCurve:
    """Young–Laplace's curve, lengths in m."""
    return force_curve(*condition.bridge)


def force_of(law: Law, condition: Condition, gaps: FloatArray) -> FloatArray:
    """F/γ by a law at gaps, m, shape (n,): none beyond its rupture."""
    return np.where(gaps <= law.rupture(*condition.bridge), law.force(*condition.bridge, gaps), 0.0)


def deviation(law: Law, condition: Condition) -> Deviation:
    """A law beside Young–Laplace in a condition."""
    exact, end = reference(condition), law.rupture(*condition.bridge)
    own = 0.5 * end * (1.0 - np.cos(np.linspace(0.0, pi, _GAPS)))
    forces = law.force(*condition.bridge, own)
    # Differences where the reference is tabulated, and beyond its rupture, where it is none.
    inside = np.abs(force_of(law, condition, exact.gaps) - exact.forces)
    beyond = np.abs(forces[own > exact.rupture])
    return Deviation(
        pull=float(forces[0] / exact.forces[0]),
        work=float(np.trapezoid(forces, own)) / exact.work,
        rupture=end / exact.rupture,
        largest=float(max(inside.max(), beyond.max(initial=0.0)) / exact.forces[0]),
    )


@dataclass(frozen=True)
class ContactError:
    """A contact of a case's dimer: the engine's bridge beside Young–Laplace's.

    Attributes
    ----------
    name
        ``large bead on wall``, ``small bead on wall``, ``bead on bead``.
    condition
        Its bridge.
    engine_pull, pull
        At contact, N, the engine's and Young–Laplace's.
    gaps, forces : ndarray, shape (`walkers.physics.laplace.POINTS`,)
        m and N: Young–Laplace's pull from contact to rupture, for whoever runs walkers with it.
    deviation
        The engine's law in ratios.
    """

    name: str
    condition: Condition
    engine_pull: float
    pull: float
    gaps: FloatArray
    forces: FloatArray
    deviation: Deviation


def capillary_errors(case: Case) -> tuple[ContactError, ...]:
    """The bridges of a case's dimer, as the engine has them and by Young–Laplace, in the order of `contact_loads`.

    Parameters
    ----------
    case
        With dimers.

    Raises
    ------
    ValueError
        If it has none.
    """
    radii, liquid = dimer_of(case).radii, case.liquid
    found = []
    pairs = ((radii[0], inf), (radii[1], inf), radii)
    for name, pair, engine in zip(CONTACT_NAMES, pairs, contact_loads(case).capillary, strict=True):
        condition = Condition(name, *pair, liquid.volume_fraction, liquid.contact_angle)
        exact = reference(condition)
        forces = liquid.surface_tension * exact.forces
        found.append(
            ContactError(name, condition, engine, float(forces[0]), exact.gaps, forces, deviation(ENGINE, condition))
        )
    return tuple(found)


@dataclass(frozen=True)
class Speeds:
    """Velocities of a case's walker by theory, m/s, with the engine's pulls at contact and others.

    Attributes
    ----------
    engine
        With the engine's pulls.
    young_laplace
        With Young–Laplace's at all three contacts.
    sensitivities
        d ln v / d ln F of the pulls at large bead, small bead and bead on bead, and of all three at once.
    """

    engine: float
    young_laplace: float
    sensitivities: tuple[float, float, float, float]


def speeds(case: Case) -> Speeds:
    """What the pulls at contact do to a walker's velocity, by `walkers.theory.motion`.

    The theory's contacts stay closed: of the bridges it has their pull at contact and their drag, which stays as it is.
    How pulls fall off with the gap, and where bridges break, is left out.

    Parameters
    ----------
    case
        As for `walkers.theory.prediction.motion_of`.
    """
    exact = [one.pull / one.engine_pull for one in capillary_errors(case)]
    up, down = 1.0 + _SMALL_CHANGE, 1.0 - _SMALL_CHANGE
    single = [np.where(np.arange(3) == contact, factor, 1.0) for contact in range(3) for factor in (up, down)]
    factors = [np.ones(3), np.array(exact), *single, np.full(3, up), np.full(3, down)]
    velocity = _velocities(case, np.array(factors))
    slopes = np.diff(np.log(velocity[2:].reshape(4, 2)), axis=1)[:, 0] / (log(down) - log(up))
    one, other, pair, together = (round(float(slope), 6) + 0.0 for slope in slopes)  # no -0
    return Speeds(float(velocity[0]), float(velocity[1]), (one, other, pair, together))


def _velocities(case: Case, factors: FloatArray) -> FloatArray:
    """Velocities with the engine's pulls times factors of shape (n, 3)."""
    dimer = dimer_of(case)
    pulls = np.array(contact_loads(case).capillary) / dimer.capillary_scale
    walker = Walker.of_case(case)
    many = [replace(walker, at_rest=walker.at_rest + (pulls * (factor - 1.0))[:, None]) for factor in factors]
    friction = friction_of(*[case] * len(factors), viscous=True)
    drive = (case.drive.frequency, case.drive.peak_acceleration)
    return walk(Walker.joined(many), friction, *drive, steady_acceleration=case.axial_gravity).velocity


PAIRS = ((3.0e-4, 2.0e-4), (6.0e-4, 3.0e-4), (5.45e-4, 3.075e-4))
"""Radii of the paper's dimers and of its climbing beads, m."""
PILES = (0.01, 0.0)
"""Liquid of the piles: its volume over that of a bead, and its contact angle, rad."""


@cache
def shipped() -> tuple[float, float]:
    """The same of the walkers, as calibrated."""
    liquid = load_case(CASES[0]).liquid
    return liquid.volume_fraction, liquid.contact_angle


def conditions() -> tuple[Condition, ...]:
    """The paper's pairs of beads, and a bead on a wall, which is the same in units of its radius for all radii."""
    return tuple(
        Condition(name, *pair, fraction, angle)
        for fraction in (PILES[0], 0.05, shipped()[0])
        for angle in (PILES[1], shipped()[1])
        for name, pair in (*((f"{1e3 * one:.4g}/{1e3 * two:.4g} mm", (one, two)) for one, two in PAIRS), WALL)
    )


CASES = ("fig1b", "fig4a")
_CLIMBER = "climber-dimer"
_COLLOCATED = 1e-8
_ENERGY = 2e-3
_FITTED = 0.02


def chapter(out: Path, *, quick: bool = False) -> Chapter:
    """Bridges by Young–Laplace, published laws beside them, and what the engine's errors do to walkers.

    Parameters
    ----------
    out
        Folder of the run directories; none is made.
    quick
        Two conditions instead of six.
    """
    del out
    few = (shipped(), PILES)
    all_of = [one for one in conditions() if not quick or (one.volume_fraction, one.contact_angle) in few]
    engine = [
        {
            **asdict(one),
            "radius_2": None if one.radius_2 == inf else one.radius_2,  # JSON has no infinity
            "volume": one.volume,
            **asdict(deviation(ENGINE, one)),
        }
        for one in all_of
    ]
    laws = [_row_of(law) for law in LAWS]
    walking = {name: _walking(load_case(name)) for name in CASES}
    checks = _checks(all_of)
    numbers = {
        "engine": engine,
        "laws": laws,
        "walkers": walking,
        "checks": checks,
        "bond_numbers": {name: _bond_number(load_case(name)) for name in (*CASES, _CLIMBER)},
        "angle_of_engines_wall_pull": _angle_of_wall_pull(),
        "coverage": _coverage(load_case(CASES[0])),
    }
    return Chapter(
        name="bridges",
        title="Capillary bridges by the Young–Laplace equation",
        text=_text_of(numbers),
        figures={"bridges": figure()},
        numbers=numbers,
        failed=tuple(check["what"] for check in checks if not check["largest"] <= check["expected"]),
    )


def _text_of(numbers: dict[str, Any]) -> str:
    """The chapter's Markdown."""
    pairs = [row for row in numbers["engine"] if row["name"] != WALL[0]]
    walls = [row for row in numbers["engine"] if row["name"] == WALL[0]]
    fits = [row for row in numbers["laws"] if row["name"] in {LAWS[1].name, LAWS[-1].name}]
    gains = [100.0 * (one["young_laplace"] / one["engine"] - 1.0) for one in numbers["walkers"].values()]
    coverage = numbers["coverage"]
    left = [
        coverage[f"{bead}_room"] - coverage[f"{bead}_wall"] - coverage[f"{bead}_pair"] for bead in ("large", "small")
    ]
    return rendered(
        "walkers.studies",
        "bridges.md.j2",
        degrees=degrees,
        liquid=shipped(),
        points=POINTS,
        names=CONTACT_NAMES,
        max_pair=max(pairs, key=lambda row: float(row["pull"])),
        wall_pulls=_range(walls, "pull"),
        wall_works=_range(walls, "work"),
        wall_ruptures=_range(walls, "rupture"),
        pair_works=_range(pairs, "work"),
        pair_pulls=_range(pairs, "pull"),
        best_pull=max(abs(one["pull"] - 1.0) for row in fits for key, one in row.items() if key != "name"),
        gains=[f"{gain:.0f} %" for gain in gains],
        merging=_MERGING if min(left) < 0.0 else _APART,
        **numbers,
    )


def _range(rows: list[dict[str, Any]], key: str) -> str:
    values = [float(row[key]) for row in rows]
    return f"{min(values):.2f} to {max(values):.2f}"


_MERGING = "They overlap: there liquid merges, which no law of pairs knows."
_APART = "They do not meet, if only just."


def _row_of(law: Law) -> dict[str, Any]:
    """A law between two beads and at a wall, as shipped and in piles."""
    chosen = {}
    for label, liquid in (("shipped", shipped()), ("piles", PILES)):
        for contact, name, pair in (("beads", "0.3/0.2 mm", PAIRS[0]), ("wall", *WALL)):
            chosen[f"{label} {contact}"] = asdict(deviation(law, Condition(name, *pair, *liquid)))
    return {"name": law.name, **chosen}


def _walking(case: Case) -> dict[str, Any]:
    found = speeds(case)
    contacts = [
        {"name": one.name, "engine_pull": one.engine_pull, "pull": one.pull, **asdict(one.deviation)}
        for one in capillary_errors(case)
    ]
    return {**asdict(found), "contacts": contacts}


def _checks(all_of: list[Condition]) -> list[dict[str, Any]]:
    """What must hold of the reference, the largest difference that was found, and what was expected."""
    collocated, energetic = [], []
    middle = POINTS // 2
    for one in all_of:
        exact = reference(one)
        energetic.append(abs(float(np.trapezoid(exact.forces, exact.gaps)) / exact.work - 1.0))
        if (one.volume_fraction, one.contact_angle) in (shipped(), PILES):
            solved = bridge(*one.bridge, float(exact.gaps[middle]))
            collocated.append(abs(solved.force / exact.forces[middle] - 1.0))
    fitted = [abs(deviation(LAWS[-1], one).pull - 1.0) for one in all_of if one.radius_2 != inf]
    return [
        {"what": "force by collocation and in closed form", "largest": max(collocated), "expected": _COLLOCATED},
        {
            "what": "work of the tabulated forces and fall of surface energy",
            "largest": max(energetic),
            "expected": _ENERGY,
        },
        {
            "what": "pull at contact and Bagheri et al.'s fit to their own solutions",
            "largest": max(fitted),
            "expected": _FITTED,
        },
    ]


def _bond_number(case: Case) -> dict[str, float]:
    """ρgR²/γ of the largest bead, and what the drive's peak acceleration makes of it."""
    liquid, radius = case.liquid, max(dimer_of(case).radii)
    if liquid.density is None:
        raise ValueError("liquid.density: expected, for a Bond number")
    at_rest = liquid.density * ACCELERATION_OF_ONE_G * radius**2 / liquid.surface_tension
    return {"at_rest": at_rest, "driven": at_rest * case.drive.peak_acceleration / ACCELERATION_OF_ONE_G}


def _angle_of_wall_pull() -> float:
    """Contact angle at which Young–Laplace gives the engine's pull at a wall with the shipped liquid, rad."""
    wall = Condition(*_flat(WALL), *shipped())
    engine = force_of(ENGINE, wall, np.zeros(1))[0]

    def excess(angle: float) -> float:
        return float(force_curve(*wall.bridge[:3], angle, [0.0]).forces[0] - engine)

    return float(brentq(excess, 0.0, shipped()[1], xtol=1e-4))


def _flat(named: tuple[str, tuple[float, float]]) -> tuple[str, float, float]:
    return named[0], *named[1]


def _coverage(case: Case) -> dict[str, float]:
    """How far bridges at contact reach around the beads of a dimer, rad, and the room between wall and other bead."""
    radii, (large, small, pair) = dimer_of(case).radii, [one.condition for one in capillary_errors(case)]
    on_walls = [bridge(*one.bridge, 0.0).filling_angles[0] for one in (large, small)]
    between = bridge(*pair.bridge, 0.0).filling_angles
    apart = acos((radii[0] - radii[1]) / (radii[0] + radii[1]))
    return {
        "large_wall": on_walls[0],
        "large_pair": between[0],
        "large_room": apart,
        "small_wall": on_walls[1],
        "small_pair": between[1],
        "small_room": pi - apart,
    }


_SHOWN = tuple(law for law in LAWS if "Eq. 12" not in law.name)
_LOOKS = (("#c4473a", "-"), ("#1f4e8c", "--"), ("#8f8f8f", ":"), ("#58b89a", "-."), ("#dd9d1f", "-"), ("#7b52a1", "--"))
_HIGHEST = 2.0


@styled
def figure() -> Figure:
    """Force against gap by Young–Laplace and by the laws, and their differences, between beads and at a wall."""
    panels = (
        ("beads of 0.3 and 0.2 mm", Condition("0.3/0.2 mm", *PAIRS[0], *shipped())),
        ("bead on wall", Condition(*_flat(WALL), *shipped())),
        ("bead on wall", Condition(*_flat(WALL), *PILES)),
    )
    drawing, axes = new_figure(TWO_COLUMNS, 4.9, nrows=2, ncols=3, sharex="col", sharey="row")
    for column, (what, condition) in enumerate(panels):
        _draw(axes[:, column], condition)
        angle = degrees(condition.contact_angle)
        axes[0, column].set_title(f"{what}\nliquid {condition.volume_fraction:g} of a bead, {angle:.3g}°")
        axes[1, column].set_xlabel("gap / rupture distance\nby Young–Laplace")
    axes[0, 0].set(ylabel="pull / pull at contact\nby Young–Laplace", ylim=(0.0, _HIGHEST))
    axes[1, 0].set(ylabel="difference / pull at contact", ylim=(-0.25, 0.5))
    letter_panels(axes.flat)
    drawing.align_ylabels()
    drawing.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return drawing


def _draw(axes: Any, condition: Condition) -> None:
    exact = reference(condition)
    gaps = np.linspace(0.0, 1.4, _GAPS) * exact.rupture
    inside = gaps <= exact.rupture
    pull = np.zeros(_GAPS)
    pull[inside] = force_curve(*condition.bridge, gaps[inside]).forces
    axes[0].plot(
        gaps[inside] / exact.rupture, pull[inside] / pull[0], color="black", linewidth=2.0, label="Young–Laplace"
    )
    axes[0].plot(1.0, exact.forces[-1] / pull[0], "o", color="black", markersize=5)
    axes[1].axhline(0.0, color="black", linewidth=1.0)
    for law, (colour, dashes) in zip(_SHOWN, _LOOKS, strict=True):
        until = gaps <= law.rupture(*condition.bridge)
        forces = force_of(law, condition, gaps)
        width = 2.0 if law is ENGINE else 1.2
        look = {"color": colour, "linestyle": dashes, "linewidth": width}
        axes[0].plot(gaps[until] / exact.rupture, forces[until] / pull[0], label=law.name, **look)
        axes[1].plot(gaps / exact.rupture, (forces - pull) / pull[0], **look)
