"""Liquid necks: the shapes of bridges in pictures, films and the three-dimensional view.

The surface of a neck is a surface of revolution whose meridian is an arc of a circle: the toroidal
approximation of a meniscus. The arc meets the beads, or the bead and the wall, at the contact angle
of the case, and its radius is the one with which the liquid inside has the volume of the bridge
(`walkers.physics.capillary.bridge_volume`). Forces do not depend on these shapes.

W. B. Haines, J. Agric. Sci. 15 (1925) 529–535, doi 10.1017/S0021859600082460 (toroid).
"""

from __future__ import annotations

from math import cos, pi
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from walkers.arrays import BoolArray, FloatArray, IntArray
from walkers.inputs.tables.case import Case
from walkers.physics.capillary import bridge_volume
from walkers.postprocess.measure.motion import Motion, read_bridges

NECK_COLOUR = 0x3FA0FF
"""Colour of necks: red, green, blue."""
NECK_OPACITY = 0.8
"""Opacity of necks."""
NECK_LEGEND = "blue: liquid bridges"
"""What the colour of necks means."""
NO_BRIDGES: IntArray = np.empty((0, 3), dtype=np.int64)
"""Contacts of a frame without bridges."""
_LARGEST_WIDTH = 0.9
"""Largest radius of a neck where it meets a bead, over the radius of the bead."""
_BISECTIONS = 24
"""Number of steps in which the radius of the arc of a neck is found."""
_POINTS_OF_VOLUME = 17
"""Points of the arc with which the volume of a neck is computed."""
_ABOVE = 1.001
"""Distance of the sides of drawn rings from the axis, over that of the surface of the neck."""


class Ends(NamedTuple):
    """Where K bridges begin and end.

    Attributes
    ----------
    first : ndarray, shape (K, 3)
        Centres of the first beads, m.
    second : ndarray, shape (K, 3)
        Centres of the second beads, or the nearest points of walls, m.
    """

    first: FloatArray
    second: FloatArray


class NeckGrid(NamedTuple):
    """How finely necks are drawn.

    Attributes
    ----------
    rings
        Number of rings of points along a neck.
    sides
        Number of points of a ring.
    """

    rings: int
    sides: int


def bridges_at(motion: Motion, frames: npt.ArrayLike) -> list[IntArray]:
    """Contacts with bridges, as recorded in the frame nearest to each of some frames.

    Parameters
    ----------
    motion
        The motion.
    frames : array_like, shape (F,)
        Numbers of frames of the motion, with fractions between two frames.

    Returns
    -------
    list of ndarray, each of shape (K, 3)
        Contacts as in `walkers.postprocess.measure.motion.Bridges`: both beads and -1, or the bead,
        -1 and the wall.
    """
    frames = np.asarray(frames)
    sample_numbers = np.array([number for _, number in motion.frames])
    samples_per_record = motion.case.run.samples_per_bridge_sample
    recorded = np.flatnonzero(sample_numbers % samples_per_record == 0)
    if not len(recorded):
        return [NO_BRIDGES] * len(frames)
    distances = np.abs(np.subtract.outer(frames, recorded))
    nearest = recorded[distances.argmin(axis=1)].tolist()
    contacts = {bridges.frame: bridges.contacts for bridges in read_bridges(motion, set(nearest))}
    return [contacts[frame] for frame in nearest]


def bridges_text(case: Case) -> str:
    """What is blue, and how often the bridges were recorded if not in every frame."""
    stride = case.run.samples_per_bridge_sample
    if stride == 1:
        return NECK_LEGEND
    per_cycle = case.run.samples_per_cycle // stride
    times = "once" if per_cycle == 1 else f"{per_cycle} times"
    return f"{NECK_LEGEND}, recorded {times} per cycle"


def bridge_ends(motion: Motion, position: FloatArray, contacts: IntArray) -> Ends:
    """Ends of the bridges of contacts.

    Parameters
    ----------
    motion
        The motion, for its walls.
    position : ndarray, shape (N, 3)
        Centres of all beads relative to the boundary, m.
    contacts : ndarray of int, shape (K, 3)
        Contacts as in `walkers.postprocess.measure.motion.Bridges`.
    """
    first = position[contacts[:, 0]]
    second = position[contacts[:, 1]]
    for number, wall in enumerate(motion.case.boundary.walls):
        is_at_wall = contacts[:, 2] == number
        second[is_at_wall] = wall.nearest_points(first[is_at_wall])
    return Ends(first, second)


def at_front_walls(motion: Motion, contacts: IntArray, ends: Ends, toward: FloatArray) -> BoolArray:
    """Which contacts are with walls between the beads and the camera.

    Pictures do not draw these walls, so that the beads are visible.

    Parameters
    ----------
    motion
        The motion.
    contacts : ndarray of int, shape (K, 3)
        Contacts.
    ends
        Their ends.
    toward : ndarray, shape (3,)
        Unit vector toward the camera.

    Returns
    -------
    ndarray of bool, shape (K,)
    """
    is_at_wall = contacts[:, 2] >= 0
    nearer = (ends.second - ends.first) @ toward
    # Side walls seen edge-on are about as far from the camera as the beads: they do not count.
    return np.asarray(is_at_wall & (nearer > 0.5 * motion.radius[contacts[:, 0]]))


def neck_surfaces(
    motion: Motion,
    contacts: IntArray,
    ends: Ends,
    grid: NeckGrid,
    share: FloatArray | float = 1.0,
) -> tuple[FloatArray, FloatArray]:
    """Surfaces of the necks of contacts.

    A neck begins at the surface of its first bead and ends at that of the second, or at the wall.

    Parameters
    ----------
    motion
        The motion.
    contacts : ndarray of int, shape (K, 3)
        Contacts as in `walkers.postprocess.measure.motion.Bridges`.
    ends
        Their ends (`bridge_ends`).
    grid
        Number of rings and of points of each ring.
    share : float or ndarray, shape (K,)
        The width that is drawn over the width of the neck.

    Returns
    -------
    points : ndarray, shape (K, rings × sides, 3)
        Points of the surfaces, mm.
    normals : ndarray, shape (K, rings × sides, 3)
        Unit vectors normal to the surfaces, out of the liquid.
    """
    radius = motion.radius[contacts[:, 0]]
    second_radius = np.where(contacts[:, 1] < 0, np.inf, motion.radius[contacts[:, 1]])
    length = np.linalg.norm(ends.second - ends.first, axis=1)
    pairs = _Pairs.touching(radius, second_radius, length, motion.case.liquid.contact_angle)
    arcs = _arcs_of_volume(pairs, _volumes(motion, radius, second_radius))
    height, ring_radius, slope = arcs.points(pairs, grid.rings)
    ring_radius = np.asarray(share)[..., None] * ring_radius

    axis = (ends.second - ends.first) / length[:, None]
    outward = _across(axis, grid.sides)[:, None]
    along = axis[:, None, None]
    points = ends.first[:, None, None] + height[..., None, None] * along
    points = points + ring_radius[..., None, None] * outward
    normals = np.cos(slope)[..., None, None] * outward + np.sin(slope)[..., None, None] * along
    shape = (len(contacts), grid.rings * grid.sides, 3)
    return 1e3 * points.reshape(shape), normals.reshape(shape)


def drawn_share(grid: NeckGrid) -> float:
    """The width of necks to draw, over theirs, so that they do not cut into the facets of beads.

    The middles of the sides of a ring are then outside of the bead as its corners are.
    """
    return _ABOVE / cos(pi / grid.sides)


def _volumes(motion: Motion, radius: FloatArray, second_radius: FloatArray) -> FloatArray:
    """Volumes of K bridges, m³; a wall has an infinite ``second_radius``."""
    liquid = motion.case.liquid.of_bridges
    different, number = np.unique(
        np.stack([radius, second_radius], axis=1), axis=0, return_inverse=True
    )
    volumes = [bridge_volume(first, second, liquid) for first, second in different.tolist()]
    return np.array(volumes)[number.ravel()]


class _Pairs(NamedTuple):
    """K pairs of surfaces with a neck: bead and bead, or bead and wall.

    Attributes
    ----------
    radius : ndarray, shape (K,)
        Radii of the first beads, m.
    second_radius : ndarray, shape (K,)
        Radii of the second beads, m; infinite for walls.
    length : ndarray, shape (K,)
        Distances from the centre of the first bead to that of the second, or to the wall, m.
        Surfaces that overlap are taken as touching.
    contact_angle
        Contact angle, rad.
    """

    radius: FloatArray
    second_radius: FloatArray
    length: FloatArray
    contact_angle: float

    @classmethod
    def touching(
        cls,
        radius: FloatArray,
        second_radius: FloatArray,
        length: FloatArray,
        contact_angle: float,
    ) -> _Pairs:
        """Pairs at these distances, at least as far apart as they touch."""
        beyond = np.where(np.isfinite(second_radius), second_radius, 0.0)
        return cls(radius, second_radius, np.maximum(length, radius + beyond), contact_angle)

    @property
    def gap(self) -> FloatArray:
        """Gaps, m, shape (K,)."""
        beyond = np.where(np.isfinite(self.second_radius), self.second_radius, 0.0)
        return np.asarray(self.length - self.radius - beyond)


class _Arcs(NamedTuple):
    """The meridians of K necks: circles around points beside the axis, in m.

    Heights are along the axis from the centre of the first bead.

    Attributes
    ----------
    arc_radius : ndarray, shape (K,)
        Radii of the circles.
    height : ndarray, shape (K,)
        Heights of their centres.
    distance : ndarray, shape (K,)
        Distances of their centres from the axis.
    """

    arc_radius: FloatArray
    height: FloatArray
    distance: FloatArray

    @classmethod
    def of_radius(cls, pairs: _Pairs, arc_radius: FloatArray) -> _Arcs:
        """The circles of a radius (m, shape (K,)) that meet both surfaces at the contact angle."""
        cosine = np.cos(pairs.contact_angle)
        to_first = pairs.radius**2 + arc_radius**2 + 2.0 * pairs.radius * arc_radius * cosine
        is_bead = np.isfinite(pairs.second_radius)
        second = np.where(is_bead, pairs.second_radius, 0.0)
        to_second = second**2 + arc_radius**2 + 2.0 * second * arc_radius * cosine
        between_beads = (pairs.length**2 + to_first - to_second) / (2.0 * pairs.length)
        height = np.where(is_bead, between_beads, pairs.length - arc_radius * cosine)
        distance = np.sqrt(np.maximum(to_first - height**2, 0.0))
        return cls(arc_radius, height, distance)

    def ends(self, pairs: _Pairs) -> tuple[FloatArray, FloatArray]:
        """Angles of the arcs where they begin and end, rad from the axis' normal, shape (K,) each.

        The point of a circle at an angle a is at the height of its centre + ρ sin a, at the
        distance of its centre − ρ cos a from the axis.
        """
        # Triangle of both centres and the point on the bead, whose angle there is π − θ.
        to_first = np.hypot(self.height, self.distance)
        first = _angle_in_triangle(self.arc_radius, to_first, pairs.radius)
        low = first - np.arctan2(self.height, self.distance)
        is_bead = np.isfinite(pairs.second_radius)
        above = pairs.length - self.height
        second_radius = np.where(is_bead, pairs.second_radius, 1.0)
        to_second = np.where(is_bead, np.hypot(above, self.distance), 1.0)
        second = _angle_in_triangle(self.arc_radius, to_second, second_radius)
        high_at_bead = np.arctan2(above, self.distance) - second
        high_at_wall = np.arcsin(np.clip(above / self.arc_radius, -1.0, 1.0))
        return low, np.where(is_bead, high_at_bead, high_at_wall)

    def points(self, pairs: _Pairs, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Points of the arcs, evenly spaced from one end to the other.

        Returns
        -------
        height, distance : ndarray, shape (K, count)
            Heights, and distances from the axis, m.
        slope : ndarray, shape (K, count)
            Angle of the normal out of the liquid from the direction away from the axis, rad,
            positive toward the second surface.
        """
        low, high = self.ends(pairs)
        share = np.linspace(0.0, 1.0, count)
        angle = low[:, None] + (high - low)[:, None] * share
        height = self.height[:, None] + self.arc_radius[:, None] * np.sin(angle)
        distance = self.distance[:, None] - self.arc_radius[:, None] * np.cos(angle)
        return height, np.maximum(distance, 0.0), -angle

    def volume(self, pairs: _Pairs) -> FloatArray:
        """Volumes inside of the arcs and outside of the beads, m³, shape (K,)."""
        height, distance, _ = self.points(pairs, _POINTS_OF_VOLUME)
        inside = np.pi * np.trapezoid(distance**2, height, axis=1)
        first_cap = _cap(pairs.radius, height[:, 0])
        to_second = pairs.length - height[:, -1]
        is_bead = np.isfinite(pairs.second_radius)
        second_cap = _cap(np.where(is_bead, pairs.second_radius, to_second), to_second)
        return np.asarray(inside - first_cap - second_cap)


def _angle_in_triangle(beside: FloatArray, also_beside: FloatArray, opposite: FloatArray) -> Any:
    """The angle between two sides of triangles, rad, from the lengths of all three."""
    cosine = (beside**2 + also_beside**2 - opposite**2) / (2.0 * beside * also_beside)
    return np.arccos(np.clip(cosine, -1.0, 1.0))


def _cap(radius: FloatArray, distance: FloatArray) -> FloatArray:
    """Volumes of the caps of balls beyond planes at distances from their centres, m³."""
    height = radius - distance
    return np.asarray(np.pi * height**2 * (radius - height / 3.0))


def _arcs_of_volume(pairs: _Pairs, volume: FloatArray) -> _Arcs:
    """The arcs of necks with volumes (m³, shape (K,)).

    A neck that would be wider than `_LARGEST_WIDTH` has this width; one that is too long for its
    volume is as thin as an arc can be.
    """
    # The volume rises with the radius of the arc, from a waist without width on.
    is_bead = np.isfinite(pairs.second_radius)
    second_radius = np.where(is_bead, pairs.second_radius, 0.0)
    smallest = np.minimum(pairs.radius, pairs.second_radius)
    low = np.maximum(pairs.gap / 2.0, 1e-6 * smallest)
    high = low + 4.0 * smallest
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2.0
        arcs = _Arcs.of_radius(pairs, middle)
        _, distance, _ = arcs.points(pairs, 2)
        is_wide = distance[:, 0] > _LARGEST_WIDTH * pairs.radius
        # On a wall, a neck that is as wide as its bead would be seen around the bead.
        is_wide |= distance[:, 1] > np.where(is_bead, _LARGEST_WIDTH * second_radius, pairs.radius)
        is_larger = is_wide | (arcs.volume(pairs) > volume)
        is_larger &= arcs.distance > middle  # otherwise it has no waist
        high = np.where(is_larger, middle, high)
        low = np.where(is_larger, low, middle)
    return _Arcs.of_radius(pairs, (low + high) / 2.0)


def _across(axis: FloatArray, count: int) -> FloatArray:
    """Unit vectors across axes, evenly around them.

    Parameters
    ----------
    axis : ndarray, shape (K, 3)
        Unit vectors.
    count
        Number of vectors around each axis.

    Returns
    -------
    ndarray, shape (K, count, 3)
    """
    first = np.cross(axis, np.eye(3)[np.abs(axis).argmin(axis=1)])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(axis, first)
    angle = 2.0 * np.pi * np.arange(count) / count
    across: FloatArray = (
        np.cos(angle)[:, None] * first[:, None] + np.sin(angle)[:, None] * second[:, None]
    )
    return across


def neck_triangles(count: int, grid: NeckGrid) -> npt.NDArray[Any]:
    """Triangles of a number of necks, as indices of their points in the order of `neck_surfaces`.

    Parameters
    ----------
    count
        Number of necks.
    grid
        Number of rings and of points of each ring.

    Returns
    -------
    ndarray of int, shape (T, 3)
        Corners of triangles, counterclockwise as seen from outside.
    """
    rings, sides = grid
    corner = np.arange((rings - 1) * sides)  # of all rings but the last
    side = corner % sides
    neighbour = corner - side + (side + 1) % sides  # the next point of the same ring
    lower = np.stack([corner, neighbour, corner + sides], 1)
    upper = np.stack([neighbour, neighbour + sides, corner + sides], 1)
    corners = np.concatenate([lower, upper])
    first_points = rings * sides * np.arange(count)
    triangles: npt.NDArray[Any] = (corners + first_points[:, None, None]).reshape(-1, 3)
    return triangles
