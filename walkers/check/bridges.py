"""Published bridge laws compared with the Young–Laplace equation, and velocities of walkers with other laws.

A published law gives the pull divided by the surface tension, F/γ, of a bridge of constant volume against the gap; laws
for equal spheres use Derjaguin's radius (`walkers.physics.capillary.derjaguin_radius`). Some are laws of the program
(`walkers.physics.laws`); coefficients and equation numbers of the others are those in the source of YADE
(ViscElCapPhys).

References
----------
T. Weigert, S. Ripperger, Part. Part. Syst. Charact. 16 (1999) 238–242,
doi 10.1002/(SICI)1521-4117(199910)16:5<238::AID-PPSC238>3.0.CO;2-E.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib import import_module
from math import acos, cos, degrees, inf, pi, radians, sin, sqrt
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from walkers.api import run
from walkers.check.report import Chapter, Line
from walkers.inputs.loads import dimer_of
from walkers.inputs.reading import load_case
from walkers.physics import capillary, laws
from walkers.physics.bridge import FloatArray, Surfaces
from walkers.physics.capillary import derjaguin_radius
from walkers.physics.laplace import force_curve
from walkers.physics.laws import rabinovich, soulie, willett, young_laplace
from walkers.postprocess.drawing import TWO_COLUMNS, letter_panels, new_figure, series_look, styled
from walkers.text import rendered

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COMPARED = ("fig1b", "climber-dimer")
"""Cases whose bridges are compared: the liquid of the walkers and that of the piles."""
WALKED, WALKED_BY = ("fig1b", "fig4a"), ("young-laplace", "willett", "rabinovich", "soulie")
"""Cases and laws of the velocities."""
_FRACTIONS, _ANGLES = (0.01, 0.05, 0.25), (0.0, radians(40.0))
_GAPS = 280


def weigert(radius_1: float, radius_2: float, volume: float, contact_angle: float, gaps: FloatArray) -> FloatArray:
    """Weigert and Ripperger (1999), Eqs. 5, 6, 15–17, 21, 22: a toroid, its filling angle by a fit."""
    radius = derjaguin_radius(radius_1, radius_2)
    spread = (1.0 + 3.0 * gaps / radius) * (1.0 + 1.1 * sin(contact_angle))
    angle = np.arcsin(np.minimum(1.0, (volume / (0.96 * radius**3 * spread)) ** 0.25))
    meridian = (2.0 * radius * (1.0 - np.cos(angle)) + gaps) / (2.0 * np.cos(angle + contact_angle))
    neck = radius * np.sin(angle) + meridian * (np.sin(angle + contact_angle) - 1.0)
    line = radius * np.sin(angle)
    pressure = 1.0 / meridian - 1.0 / neck
    return pi * line**2 * pressure + 2.0 * pi * line * np.sin(angle + contact_angle)


def willett_simple(
    radius_1: float, radius_2: float, volume: float, contact_angle: float, gaps: FloatArray
) -> FloatArray:
    """Willett et al. (2000), Eq. 12, for small volumes: F = 2πRγ cos θ / (1 + 2.1 s + 10 s²)."""
    radius = derjaguin_radius(radius_1, radius_2)
    s = gaps / 2.0 / sqrt(volume / radius)
    return 2.0 * pi * radius * cos(contact_angle) / (1.0 + 2.1 * s + 10.0 * s**2)


class Law(NamedTuple):
    """A published law: its ``pull`` (radii, volume, contact angle, gaps → F/γ) and its ``rupture`` distance.

    The default rupture distance is that of Lian et al. (1993), for any radii. ``error`` is the published relative error
    of the pull at contact, for fits to solutions of the Young–Laplace equation.
    """

    name: str
    pull: Callable[[float, float, float, float, FloatArray], FloatArray]
    rupture: Callable[[float, float, float, float], float] = lambda *bridge: capillary.rupture_distance(*bridge[2:])
    error: float = inf


def _shipped() -> Iterator[Law]:
    """The laws of `walkers.physics.laws` that were published as a pull (modules with ``PUBLISHED``)."""
    for name in laws.LAWS:
        contents = vars(import_module(laws.by_name(name).__module__))
        if "PUBLISHED" in contents:
            given = {key: contents[key] for key in ("pull", "rupture") if key in contents}
            yield Law(contents["PUBLISHED"], error=contents.get("ERROR", inf), **given)


LAWS = (
    *_shipped(),
    Law("Willett 2000, Eq. 12", willett_simple, willett.rupture),
    Law("Lambert 2008", rabinovich.lambert),
    Law("Weigert 1999", weigert),
)
FITS = tuple(law for law in LAWS if law.error < inf)
SOULIE = next(law for law in LAWS if law.pull is soulie.pull)


def shapes(names: tuple[str, ...]) -> dict[str, Surfaces]:
    """Bridges of the dimers of shipped cases: between their beads, and of the large one at a wall."""
    found = {}
    for name in names:
        case = load_case(name)
        large, small = dimer_of(case).radii
        for place, other in (("beads", small), ("wall", inf)):
            found[f"{name}, {place}"] = Surfaces.of(
                large, other, case.liquid.of_bridges, case.contact.minimum_separation_ratio
            )
    return found


def shape_of(surfaces: Surfaces) -> tuple[float, float, float, float]:
    """Arguments of a law's: radii, m, volume, m³, and contact angle, rad."""
    return surfaces.radius, surfaces.other_radius, surfaces.volume, surfaces.liquid.contact_angle


def exact(surfaces: Surfaces) -> tuple[FloatArray, FloatArray]:
    """Gaps from contact to rupture, m, and F/γ of Young–Laplace at these gaps, m."""
    curve = young_laplace.law(surfaces)
    gaps = _even(curve.rupture)
    return gaps, curve.forces(gaps).pull / surfaces.liquid.surface_tension


def _even(rupture: float) -> FloatArray:
    return 0.5 * rupture * (1.0 - np.cos(np.linspace(0.0, pi, _GAPS)))


class Deviation(NamedTuple):
    """Ratios of a law to Young–Laplace: pull at contact, work from contact to rupture, rupture distance."""

    pull: float
    work: float
    rupture: float


def deviation(law: Law, surfaces: Surfaces) -> Deviation:
    """Ratios of a law to Young–Laplace for a bridge."""
    shape, (places, true) = shape_of(surfaces), exact(surfaces)
    gaps = _even(law.rupture(*shape))
    forces = law.pull(*shape, gaps)
    work = float(np.trapezoid(forces, gaps) / np.trapezoid(true, places))
    return Deviation(float(forces[0] / true[0]), work, float(gaps[-1] / places[-1]))


def chapter(out: Path, *, quick: bool = False) -> Chapter:
    """Published laws compared with Young–Laplace, and, unless ``quick``, velocities of walkers with other laws."""
    compared = shapes(COMPARED)
    published = {law: {key: deviation(law, one) for key, one in compared.items()} for law in LAWS}
    lines = []
    for law, found in published.items():
        for key, one in found.items():
            what = f"{law.name}, {key}"
            lines.append(Line(f"{what}: pull at contact relative to Young–Laplace", 1.0, one.pull, law.error))
            lines.append(Line(f"{what}: work relative to Young–Laplace", 1.0, one.work))
    velocities: dict[str, dict[str, float]] = {}
    for name in () if quick else WALKED_BY:
        runs = {case: run(load_case(case, {"liquid.law": name}), out) for case in WALKED}
        velocities[name] = {case: one.result["velocity"]["mean"] for case, one in runs.items()}
    text = rendered(
        "walkers.check",
        "bridges.md.j2",
        degrees=degrees,
        compared=compared,
        laws={law.name: found for law, found in published.items()},
        best_pull=max(abs(one.pull - 1.0) for law in FITS for one in published[law].values()),
        soulie_at_walls=[deviation(SOULIE, one) for one in _walls()],
        fractions=_FRACTIONS,
        angles=_ANGLES,
        walked=WALKED,
        velocities=velocities,
        coverage=_coverage(COMPARED[0]),
        covered=COMPARED[0],
    )
    title = "Capillary bridges by the Young–Laplace equation"
    return Chapter("bridges", title, tuple(lines), text, {"bridges": figure(compared)})


def _walls() -> list[Surfaces]:
    """Bridges at a wall with small and large volumes and contact angles."""
    case = load_case(COMPARED[0])
    liquids = [
        replace(case.liquid.of_bridges, volume_fraction=part, contact_angle=one)
        for part in _FRACTIONS
        for one in _ANGLES
    ]
    return [Surfaces.of(1.0, inf, liquid, case.contact.minimum_separation_ratio) for liquid in liquids]


def _coverage(name: str) -> dict[str, float]:
    """Angles over which bridges extend around the beads of a dimer at contact, and the angles available, rad."""
    beads, wall = shapes((name,)).values()
    (small, large), (at_wall, _) = (
        force_curve(*shape_of(one), [0.0]).bridges[0, :2] / (one.radius, one.other_radius) for one in (beads, wall)
    )
    apart = acos((beads.other_radius - beads.radius) / (beads.other_radius + beads.radius))
    return {"wall": at_wall, "large": large, "large_room": apart, "small": small, "small_room": pi - apart}


@styled
def figure(compared: dict[str, Surfaces]) -> Figure:
    """Pull against gap by Young–Laplace and by the published laws."""
    drawing, axes = new_figure(TWO_COLUMNS, 5.0, nrows=2, ncols=2, sharex=True, sharey=True)
    for panel, (name, surfaces) in zip(axes.flat, compared.items(), strict=True):
        shape, (places, true) = shape_of(surfaces), exact(surfaces)
        for number, law in enumerate(LAWS):
            gaps = np.linspace(0.0, law.rupture(*shape), _GAPS)
            pull = law.pull(*shape, gaps) / true[0]
            panel.plot(gaps / places[-1], pull, label=law.name, **{**series_look(number), "marker": ""})
        panel.plot(places / places[-1], true / true[0], "k", lw=2.0, label="Young–Laplace")
        panel.plot(1.0, true[-1] / true[0], "ko", ms=5)
        panel.set(
            title=f"{name}: liquid {surfaces.liquid.volume_fraction:g}, {degrees(shape[3]):.3g}°",
            xlabel="gap / rupture distance\n(Young–Laplace)",
            ylabel="pull / pull at contact\n(Young–Laplace)",
        )
        panel.label_outer()
    axes[0, 0].set_ylim(0.0, None)
    letter_panels(axes.flat)
    drawing.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return drawing
