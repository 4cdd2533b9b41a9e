"""Directions of view: orthographic cameras of pictures, films, players and ParaView."""

from __future__ import annotations

from math import cos, radians, sin

import numpy as np

from walkers.arrays import FloatArray
from walkers.inputs.tables.case import Case
from walkers.postprocess.measure.motion import Motion

_ELEVATION_OF_ONE, _ELEVATION = radians(35.0), radians(60.0)
"""Elevation of the camera above a floor: for one walker seen from its side, and otherwise."""


def against_gravity(motion: Motion) -> FloatArray:
    """Unit vector against gravity in the frame of the boundary; without gravity the normal of the floor."""
    against = -np.array(motion.case.gravity_vector)
    return against / np.linalg.norm(against) if against.any() else np.array([0.0, 0.0, 1.0])


def axes_toward(toward: FloatArray, upward: FloatArray) -> FloatArray:
    """Unit vectors to the right, up, and toward the camera, as rows; up is the projection of ``upward``."""
    toward = toward / np.linalg.norm(toward)
    up = upward - (upward @ toward) * toward
    up /= np.linalg.norm(up)
    return np.array([np.cross(up, toward), up, toward])


def from_the_side(case: Case) -> bool:
    """Whether a run is seen from the side: in a container, but on a tray, where walkers would hide one another."""
    return case.boundary.closed and (case.loose or not case.meets)


def from_above(case: Case) -> bool:
    """Whether a run in a container is seen along the normal of its floor."""
    return case.boundary.closed and not from_the_side(case)


def camera_axes(motion: Motion) -> FloatArray:
    """The axes (`axes_toward`) of films and players, in the frame of the boundary.

    Containers are seen from the side, closed trays along their normal (`from_the_side`). Open floors are seen obliquely
    from above, from the right of the drive axis or, if tilted, of the uphill direction. Up in the picture is against
    gravity, on closed trays y or uphill.
    """
    case = motion.case
    boundary, along = case.boundary, np.array(case.drive_axis)
    uphill = np.array([cos(boundary.uphill), sin(boundary.uphill), 0.0])
    if from_the_side(case):
        return axes_toward(np.array([0.0, -1.0, 0.0]), against_gravity(motion))
    if boundary.closed:
        return plan_axes(motion, np.array([1.0, 0.0, 0.0]))
    sideways = boundary.bare and (not boundary.tilt or abs(uphill @ along) > 0.5)
    elevation = _ELEVATION_OF_ONE if len(motion.walkers) == 1 and sideways else _ELEVATION
    across = np.cross([0.0, 0.0, 1.0], uphill if boundary.tilt else along)
    toward = np.array([0.0, 0.0, sin(elevation)]) - cos(elevation) * across
    return axes_toward(toward, against_gravity(motion))


def plan_axes(motion: Motion, along: FloatArray) -> FloatArray:
    """The axes (`axes_toward`) of a view along the normal of a floor; up is uphill, or to the left of ``along``."""
    boundary = motion.case.boundary
    upward = np.cross([0.0, 0.0, 1.0], along)
    if boundary.tilt:
        upward = np.array([cos(boundary.uphill), sin(boundary.uphill), 0.0])
    return axes_toward(np.array([0.0, 0.0, 1.0]), upward)


def named_direction(motion: Motion) -> tuple[FloatArray, str]:
    """Direction of the displacement that is written into pictures, and its name."""
    if from_the_side(motion.case):
        return against_gravity(motion), "up"
    right, up, _ = plan_axes(motion, np.array(motion.case.drive_axis))
    return (up, "uphill") if motion.case.boundary.tilt else (right, "along the drive axis")
