"""The drawing of docs/reference/notation.md: a walker with its symbols, from three sides.

It shows no run: beads, bridges and angles are as large as their labels need.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle, Polygon, Rectangle

from walkers.postprocess.show.drawing import TWO_COLUMNS, letter_panels, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from walkers.arrays import FloatArray

    _Point = FloatArray | tuple[float, float]

_RADII = (1.0, 0.5)
"""Radii of the large and the small bead, in units of the large one."""
_MENISCUS = 0.09
"""Radius of the menisci, in the same unit."""
_ANGLE = 28.0
"""Angle ψ between the walker and the drive axis, degrees."""
_TILT = 20.0
"""Tilt of the substrate, degrees."""
LARGE_BEAD = "#b3392f"
"""Colour of the large bead."""
SMALL_BEAD = "#d98c3f"
"""Colour of the small bead."""
_BEADS = (LARGE_BEAD, SMALL_BEAD)
_LIQUID = "#7fb2dc"
_GROUND = "0.82"
_MOTION = "#1f4e8c"
"""Colour of the heading and of what is counted along it."""
_SMALL_PRINT = 7.0
"""Size of the names in case files and results, points."""


@styled
def figure() -> Figure:
    """A walker from the side, from above, and on a tilted substrate."""
    drawn = new_figure(TWO_COLUMNS, 3.5)
    grid = drawn.add_gridspec(2, 2, width_ratios=(1.45, 1.0), height_ratios=(1.0, 0.92))
    side = drawn.add_subplot(grid[:, 0])
    above = drawn.add_subplot(grid[0, 1])
    tilted = drawn.add_subplot(grid[1, 1])
    _draw_from_the_side(side)
    _draw_from_above(above)
    _draw_on_a_slope(tilted)
    for axes, title in (
        (side, "from the side"),
        (above, "from above"),
        (tilted, "tilted substrate"),
    ):
        axes.set(aspect="equal", title=title)
        axes.axis("off")
    letter_panels([side, above, tilted])
    return drawn


# --- the three views ------------------------------------------------------------------------------


def _draw_from_the_side(axes: Axes) -> None:
    """Draw radii, δ, contacts, bridges, heading and drive."""
    large, small = _centres()
    _draw_ground(axes, -1.0, 3.15, 0.16)
    for liquid in _bridges(large, small):
        axes.add_patch(Polygon(liquid, facecolor=_LIQUID, edgecolor="none", zorder=1))
    _draw_beads(axes, large, small)
    _draw_radius(axes, large, _RADII[0], 62.0, "$R_1$")
    _draw_radius(axes, small, _RADII[1], 118.0, "$R_2$")
    _draw_delta(axes, large, small)
    _draw_contacts(axes, large, small)
    _draw_meniscus(axes, large)
    _draw_rolling(axes, large, 0.7)
    _draw_arrow(axes, (0.1, 2.25), (1.4, 2.25), _MOTION)
    axes.text(0.75, 2.33, "heading, velocity > 0", color=_MOTION, ha="center", va="bottom")
    _draw_arrow(axes, (0.0, -0.42), (1.42, -0.42), both=True)
    axes.text(0.71, -0.5, r"drive $a_0\,\cos\,2\pi f t$", ha="center", va="top")
    axes.text(3.15, -0.24, "substrate", ha="right", va="top")
    axes.set(xlim=(-1.05, 3.2), ylim=(-0.9, 2.6))


def _draw_from_above(axes: Axes) -> None:
    """Draw the angle ψ between the heading and the drive axis, and the direction across it."""
    large, small = _centres()
    along = _direction(_ANGLE)
    axes.plot((-1.0, 3.3), (0.0, 0.0), color="0.4", lw=0.8, ls=(0, (6, 3)), zorder=0)
    _draw_arrow(axes, (2.55, -0.3), (3.3, -0.3), both=True)
    axes.text(2.92, -0.4, "drive axis $x$", ha="center", va="top")
    _draw_beads(axes, (large[0] - small[0]) * along, np.zeros(2))
    _draw_arrow(axes, -0.3 * along, 3.1 * along, _MOTION)
    place = 3.2 * along
    axes.text(place[0], place[1], "heading", color=_MOTION, ha="left", va="center")
    _draw_angle(axes, (0.0, 0.0), 2.65, _ANGLE)
    place = 2.84 * _direction(0.5 * _ANGLE)
    axes.text(place[0], place[1], r"$\psi$", ha="center", va="center")
    _draw_arrow(axes, (-0.85, 0.3), (-0.85, 1.0), "0.4")
    axes.text(-0.85, 1.06, "$y$: to the left", color="0.3", ha="center", va="bottom")
    axes.set(xlim=(-1.5, 3.95), ylim=(-0.75, 1.8))


def _draw_on_a_slope(axes: Axes) -> None:
    """Draw tilt, uphill and gravity."""
    along = _direction(_TILT)
    matrix = np.column_stack((along, (-along[1], along[0])))
    large, small = (matrix @ np.array([1.75 + x, z]) for x, z in _centres())
    end = 4.4 * along
    corners = np.array([[0.0, 0.0], end, [end[0], 0.0]])
    axes.add_patch(Polygon(corners, facecolor=_GROUND, edgecolor="none", zorder=0))
    axes.plot((0.0, end[0]), (0.0, end[1]), color="0.3", lw=1.3)
    _draw_beads(axes, large, small)
    _draw_angle(axes, (0.0, 0.0), 1.35, _TILT)
    axes.text(1.45, 0.22, "tilt", ha="left", va="center")
    _draw_arrow(axes, matrix @ (0.1, 0.25), matrix @ (1.0, 0.25), _MOTION)
    _write_along(axes, matrix @ (0.55, 0.36), "uphill", "bottom", _MOTION)
    _draw_arrow(axes, matrix @ (2.7, -0.25), matrix @ (3.8, -0.25), both=True)
    _write_along(axes, matrix @ (3.25, -0.36), "drive", "top", "k")
    _draw_arrow(axes, (4.75, 2.3), (4.75, 1.5))
    axes.text(4.85, 1.9, "$g$", ha="left", va="center")
    axes.set(xlim=(-0.3, 5.1), ylim=(-0.05, 3.2))


def _write_along(axes: Axes, place: FloatArray, words: str, side: str, colour: str) -> None:
    """Write words along the slope; `side` is their vertical alignment."""
    axes.text(
        place[0],
        place[1],
        words,
        color=colour,
        rotation=_TILT,
        rotation_mode="anchor",
        ha="center",
        va=side,
    )


# --- parts ----------------------------------------------------------------------------------------


def _centres() -> tuple[FloatArray, FloatArray]:
    """Centres of the large and the small bead on a level substrate; the small one touches at 0."""
    large, small = _RADII
    return np.array([2.0 * np.sqrt(large * small), large]), np.array([0.0, small])


def _direction(degrees: float) -> FloatArray:
    """The unit vector at an angle to the axis of x."""
    angle = np.radians(degrees)
    return np.array([np.cos(angle), np.sin(angle)])


def _draw_beads(axes: Axes, large: FloatArray, small: FloatArray) -> None:
    """Draw the two beads at their centres; the large one hides the edge of the small one."""
    places = zip((large, small), _RADII, _BEADS, (3, 2), strict=True)
    for centre, radius, colour, order in places:
        axes.add_patch(Circle(tuple(centre), radius, facecolor="w", zorder=order))
        axes.add_patch(
            Circle(tuple(centre), radius, facecolor=(colour, 0.3), edgecolor=colour, zorder=order)
        )


def _draw_ground(axes: Axes, left: float, right: float, depth: float) -> None:
    """Draw a level substrate with its surface at 0."""
    axes.add_patch(
        Rectangle((left, -depth), right - left, depth, facecolor=_GROUND, edgecolor="none")
    )
    axes.plot((left, right), (0.0, 0.0), color="0.3", lw=1.3, zorder=3)


def _draw_arrow(
    axes: Axes, start: _Point, end: _Point, colour: str = "k", *, both: bool = False
) -> None:
    """Draw an arrow from one point to another, with heads at both ends if `both`."""
    style = "<|-|>" if both else "-|>"
    looks = {"arrowstyle": style, "color": colour, "lw": 1.1, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", xy=tuple(end), xytext=tuple(start), arrowprops=looks, zorder=4)


def _draw_radius(axes: Axes, centre: FloatArray, radius: float, angle: float, name: str) -> None:
    """Draw a radius with its name, and the centre."""
    along = _direction(angle)
    _draw_arrow(axes, centre, centre + radius * along)
    axes.plot(*centre, "o", color="k", ms=2.2, zorder=4)
    beside = centre + 0.58 * radius * along + 0.13 * _direction(angle - 90.0)
    axes.text(beside[0], beside[1], name, ha="center", va="center", zorder=4)


def _draw_angle(axes: Axes, corner: _Point, radius: float, degrees: float) -> None:
    """Draw the arc of an angle from the axis of x."""
    size = 2.0 * radius
    axes.add_patch(
        Arc(tuple(corner), size, size, theta1=0.0, theta2=degrees, color="k", lw=0.9, zorder=4)
    )


def _draw_delta(axes: Axes, large: FloatArray, small: FloatArray) -> None:
    """Draw the line of centres and its angle to the substrate."""
    across, up = large - small
    axes.plot((small[0], large[0]), (small[1], large[1]), color="k", lw=0.8, zorder=4)
    level = (small[1], small[1])
    axes.plot((small[0], small[0] + 1.3), level, color="k", lw=0.8, ls="--", zorder=4)
    rise = float(np.degrees(np.arctan2(up, across)))
    _draw_angle(axes, small, 1.1, rise)
    place = small + 0.94 * _direction(0.5 * rise)
    axes.text(place[0], place[1], r"$\delta$", ha="center", va="center", zorder=4)


def _draw_contacts(axes: Axes, large: FloatArray, small: FloatArray) -> None:
    """Draw the three contacts, their numbers in equations and their names in results."""
    toward_large = (large - small) / np.linalg.norm(large - small)
    between = small + _RADII[1] * toward_large
    _draw_contact(axes, (large[0], 0.0), (2.3, -0.6), "1", "bead 1")
    _draw_contact(axes, (small[0], 0.0), (-0.75, -0.6), "2", "bead 2")
    _draw_contact(axes, (between[0], between[1]), (-0.4, 1.55), "3", "pair 1")


def _draw_contact(
    axes: Axes, point: tuple[float, float], place: tuple[float, float], number: str, name: str
) -> None:
    """Draw a contact, and at a place beside the beads its number and its name."""
    axes.plot((point[0], place[0]), (point[1], place[1]), color="0.35", lw=0.6, zorder=4)
    axes.plot(point[0], point[1], "o", color="k", ms=3.0, zorder=5)
    frame = {"boxstyle": "circle,pad=0.2", "facecolor": "w", "lw": 0.8}
    axes.text(place[0], place[1], number, ha="center", va="center", zorder=6, bbox=frame)
    axes.text(place[0] - 0.16, place[1], name, ha="right", va="center", size=_SMALL_PRINT)


def _draw_meniscus(axes: Axes, large: FloatArray) -> None:
    """Draw the circle of which the edge of a bridge is an arc, and name its radius."""
    centre = (float(large[0]) + _beside_wall(_RADII[0]), _MENISCUS)
    axes.add_patch(
        Circle(centre, _MENISCUS, facecolor="none", edgecolor=_MOTION, lw=0.8, ls=":", zorder=4)
    )
    looks = {"arrowstyle": "-", "lw": 0.6, "color": "0.35", "shrinkA": 1.0, "shrinkB": 0.0}
    axes.annotate(
        "bridge, its\nmeniscus\nradius $r$",
        xy=centre,
        xytext=(2.62, 0.58),
        ha="left",
        va="center",
        arrowprops=looks,
    )


def _draw_rolling(axes: Axes, centre: FloatArray, radius: float) -> None:
    """Draw the sense in which a bead turns that rolls along the heading."""
    angles = np.linspace(18.0, -38.0, 30)
    rim = np.array([centre + radius * _direction(angle) for angle in angles])
    axes.plot(rim[:-1, 0], rim[:-1, 1], color=_MOTION, lw=1.1, zorder=4)
    _draw_arrow(axes, rim[-3], rim[-1], _MOTION)
    axes.text(
        centre[0] + 0.36,
        centre[1] - 0.06,
        "rotation\n> 0",
        color=_MOTION,
        ha="center",
        va="center",
        size=_SMALL_PRINT,
        zorder=4,
    )


# --- liquid ---------------------------------------------------------------------------------------


def _beside_wall(radius: float) -> float:
    """Distance along the substrate from the contact of a bead to the centre of its meniscus."""
    return 2.0 * float(np.sqrt(radius * _MENISCUS))


def _bridges(large: FloatArray, small: FloatArray) -> list[FloatArray]:
    """Outlines of the three bridges: circular menisci that meet all surfaces at an angle of 0."""
    outlines = []
    for centre, radius in ((large, _RADII[0]), (small, _RADII[1])):
        contact = np.array([centre[0], 0.0])
        offset = np.array([_beside_wall(radius), 0.0])
        height = np.array([0.0, _MENISCUS])
        right = _meniscus(contact + offset + height, contact + offset, centre)
        left = _meniscus(contact - offset + height, contact - offset, centre)
        outlines.append(np.vstack((right, [centre], left[::-1])))
    apart = float(np.linalg.norm(large - small))
    from_large = _RADII[0] + _MENISCUS
    from_small = _RADII[1] + _MENISCUS
    along = (from_large**2 - from_small**2 + apart**2) / (2.0 * apart)
    across = np.sqrt(from_large**2 - along**2)
    axis = (small - large) / apart
    normal = np.array([-axis[1], axis[0]])
    upper, lower = (large + along * axis + side * across * normal for side in (1.0, -1.0))
    outlines.append(
        np.vstack((_meniscus(upper, small, large), _meniscus(lower, small, large)[::-1]))
    )
    return outlines


def _meniscus(centre: FloatArray, one_side: FloatArray, bead: FloatArray) -> FloatArray:
    """The shorter arc of a meniscus from the side of one point to that of the centre of a bead."""
    ends = []
    for target in (one_side, bead):
        away = target - centre
        ends.append(np.arctan2(away[1], away[0]))
    first, last = np.unwrap(ends)
    angles = np.linspace(first, last, 30)
    return centre + _MENISCUS * np.column_stack((np.cos(angles), np.sin(angles)))
