"""Published laws of bridges beside the Young–Laplace equation, and walkers by other laws."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from math import acos, degrees, inf, pi, radians
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from walkers.check.bridge_laws import LAWS, Law
from walkers.check.validate import Chapter
from walkers.inputs.case import Case
from walkers.inputs.loads import dimer_of
from walkers.inputs.reading import load_case
from walkers.inputs.text import rendered
from walkers.inputs.units import ACCELERATION_OF_ONE_G
from walkers.physics.bridge import Surfaces
from walkers.physics.laplace import ForceCurve, force_curve
from walkers.pipeline import run
from walkers.postprocess.drawing import TWO_COLUMNS, letter_panels, new_figure, series_look, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CASES = ("fig1b", "fig4a", "climber-dimer")
"""Whose Bond numbers are told."""
COMPARED = ("fig1b", "climber-dimer")
"""With whose bridges published laws are compared: of the walkers' liquid, and of the piles'."""
WALKED = ("fig1b", "fig4a")
WALKED_BY = ("young-laplace", "willett", "rabinovich", "soulie")
"""Cases and laws of the velocities."""
_FRACTIONS, _ANGLES = (0.01, 0.05, 0.25), (0.0, radians(40.0))
_GAPS = 280

Shape = tuple[float, float, float, float]


def shapes(names: tuple[str, ...] = CASES) -> dict[str, Surfaces]:
    """Bridges of the dimers of shipped cases: between their beads, and of the large one at a wall.

    In units of the bead's radius that at a wall is the same for all beads.
    """
    found = {}
    for name in names:
        case = load_case(name)
        large, small = dimer_of(case).radii
        for place, other in (("beads", small), ("wall", inf)):
            found[f"{name}, {place}"] = Surfaces.of(large, other, case.liquid, case.contact.minimum_separation_ratio)
    return found


def shape_of(surfaces: Surfaces) -> Shape:
    """Arguments of a law's: radii, m, volume, m³, and contact angle, rad."""
    return surfaces.radius, surfaces.other_radius, surfaces.volume, surfaces.liquid.contact_angle


@cache
def reference(shape: Shape) -> ForceCurve:
    """Young–Laplace's curve, lengths in m."""
    return force_curve(*shape)


class Deviation(NamedTuple):
    """A law over Young–Laplace: pull at contact, work from contact to rupture, each to its own, and largest gap."""

    pull: float
    work: float
    rupture: float


def deviation(law: Law, surfaces: Surfaces) -> Deviation:
    """A law over Young–Laplace for a bridge."""
    shape = shape_of(surfaces)
    exact, rupture = reference(shape), law.rupture(*shape)
    gaps = 0.5 * rupture * (1.0 - np.cos(np.linspace(0.0, pi, _GAPS)))
    forces = law.pull(*shape, gaps)
    return Deviation(
        pull=float(forces[0] / exact.forces[0]),
        work=float(np.trapezoid(forces, gaps)) / exact.work,
        rupture=rupture / exact.rupture,
    )


def chapter(out: Path, *, quick: bool = False) -> Chapter:
    """Published laws beside the Young–Laplace equation, and walkers by other laws.

    Parameters
    ----------
    out
        Folder of the run directories.
    quick
        No walkers.
    """
    compared = shapes(COMPARED)
    numbers = {
        "laws": [
            {"name": law.name, **{key: deviation(law, one)._asdict() for key, one in compared.items()}} for law in LAWS
        ],
        "soulie_at_walls": [deviation(LAWS[0], one)._asdict() for one in _walls()],
        "velocities": {} if quick else _velocities(out),
        "bond_numbers": {name: _bond_number(load_case(name)) for name in CASES},
        "coverage": _coverage(CASES[0]),
    }
    return Chapter(
        name="bridges",
        title="Capillary bridges by the Young–Laplace equation",
        text=_text_of(numbers, compared),
        figures={"bridges": figure(compared)},
        numbers=numbers,
    )


def _walls() -> list[Surfaces]:
    """Bridges at a wall of little and much liquid that wets well and badly."""
    case = load_case(CASES[0])
    liquids = [replace(case.liquid, volume_fraction=part, contact_angle=one) for part in _FRACTIONS for one in _ANGLES]
    return [Surfaces.of(1.0, inf, liquid, case.contact.minimum_separation_ratio) for liquid in liquids]


def _velocities(out: Path) -> dict[str, dict[str, float]]:
    """Velocities of walkers by law and case, m/s."""
    return {
        law: {name: run(load_case(name, {"liquid.law": law}), out).result["velocity"]["mean"] for name in WALKED}
        for law in WALKED_BY
    }


def _bond_number(case: Case) -> dict[str, float]:
    """ρgR²/γ of the largest bead, and what the drive's peak acceleration makes of it."""
    liquid, radius = case.liquid, max(dimer_of(case).radii)
    if liquid.density is None:
        raise ValueError("liquid.density: expected, for a Bond number")
    at_rest = liquid.density * ACCELERATION_OF_ONE_G * radius**2 / liquid.surface_tension
    return {"at_rest": at_rest, "driven": at_rest * case.drive.peak_acceleration / ACCELERATION_OF_ONE_G}


def _coverage(name: str) -> dict[str, float]:
    """How far bridges at contact reach around the beads of a dimer, rad, and the room between wall and other bead."""
    beads, wall = shapes((name,)).values()
    small, large = _filling_angles(beads)
    apart = acos((beads.other_radius - beads.radius) / (beads.other_radius + beads.radius))
    return {
        "wall": _filling_angles(wall)[0],
        "large": large,
        "large_room": apart,
        "small": small,
        "small_room": pi - apart,
    }


def _filling_angles(surfaces: Surfaces) -> list[float]:
    """Angles from the axis to the wetting lines at contact, rad."""
    arcs = reference(shape_of(surfaces)).arcs[0].tolist()
    return [arc / radius for arc, radius in zip(arcs, (surfaces.radius, surfaces.other_radius), strict=True)]


def _text_of(numbers: dict[str, Any], compared: dict[str, Surfaces]) -> str:
    """The chapter's Markdown."""
    fits = [row for row in numbers["laws"] if row["name"] in {LAWS[1].name, LAWS[-1].name}]
    return rendered(
        "walkers.check",
        "bridges.md.j2",
        degrees=degrees,
        compared=compared,
        walked=WALKED,
        fractions=_FRACTIONS,
        angles=_ANGLES,
        best_pull=max(abs(row[key]["pull"] - 1.0) for row in fits for key in compared),
        **numbers,
    )


@styled
def figure(compared: dict[str, Surfaces]) -> Figure:
    """Pull against gap by Young–Laplace and by the published laws."""
    drawing, axes = new_figure(TWO_COLUMNS, 5.0, nrows=2, ncols=2, sharex=True, sharey=True)
    for panel, (name, surfaces) in zip(axes.flat, compared.items(), strict=True):
        shape = shape_of(surfaces)
        exact = reference(shape)
        for number, law in enumerate(LAWS):
            gaps = np.linspace(0.0, law.rupture(*shape), _GAPS)
            pull = law.pull(*shape, gaps) / exact.forces[0]
            panel.plot(gaps / exact.rupture, pull, label=law.name, **{**series_look(number), "marker": ""})
        panel.plot(exact.gaps / exact.rupture, exact.forces / exact.forces[0], "k", lw=2.0, label="Young–Laplace")
        panel.plot(1.0, exact.forces[-1] / exact.forces[0], "ko", ms=5)
        panel.set(
            title=f"{name}: liquid {surfaces.liquid.volume_fraction:g}, {degrees(shape[3]):.3g}°",
            xlabel="gap / rupture distance\nby Young–Laplace",
            ylabel="pull / pull at contact\nby Young–Laplace",
        )
        panel.label_outer()
    axes[0, 0].set_ylim(0.0, None)
    letter_panels(axes.flat)
    drawing.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return drawing
