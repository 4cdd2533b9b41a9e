"""Directions of view: the orthographic cameras of pictures, films, players and ParaView.

A view is given by its axes: unit vectors to the right in the picture, up, and toward the camera, as
the rows of an array, in the frame of the boundary.
"""

from __future__ import annotations

from math import cos, radians, sin

import numpy as np

from walkers.arrays import FloatArray
from walkers.inputs.tables.case import Case
from walkers.postprocess.measure.motion import Motion

CAMERA_DISTANCE = 10.0
"""Distance of the camera from the middle of a view, over the height of the view.

In a parallel projection it does not change sizes; all beads must be in front of the camera."""
_ELEVATION = radians(60.0)
"""Elevation of the camera above an open floor."""
_ELEVATION_OF_ONE = radians(35.0)
"""Elevation of the camera above an open floor for one walker that is seen from its side."""
ANGLE_OF_VIEW = 15.0
"""Angle of view of a perspective, degrees."""
_TOWARD_CONTAINER = (-0.3, -1.0, 0.22)
"""Direction toward the camera of a perspective of a container."""


def against_gravity(motion: Motion) -> FloatArray:
    """Unit vector against gravity; without gravity the normal of the floor."""
    upward = -np.array(motion.case.gravity_vector)
    if not upward.any():
        return np.array([0.0, 0.0, 1.0])
    return np.asarray(upward / np.linalg.norm(upward))


def axes_toward(toward: FloatArray, upward: FloatArray) -> FloatArray:
    """The axes of a view.

    Parameters
    ----------
    toward : ndarray, shape (3,)
        Direction toward the camera.
    upward : ndarray, shape (3,)
        Direction whose projection is up in the picture.

    Returns
    -------
    ndarray, shape (3, 3)
        Unit vectors to the right, up, and toward the camera, as rows.
    """
    toward = toward / np.linalg.norm(toward)
    up = upward - (upward @ toward) * toward
    up /= np.linalg.norm(up)
    return np.array([np.cross(up, toward), up, toward])


def from_the_side(case: Case) -> bool:
    """Whether a run is seen from the side: in a container that is not a tray.

    On a tray, walkers would hide one another.
    """
    return case.boundary.closed and (case.loose or not case.meets)


def from_above(case: Case) -> bool:
    """Whether a run in a container is seen along the normal of its floor."""
    return case.boundary.closed and not from_the_side(case)


def camera_axes(motion: Motion) -> FloatArray:
    """The axes (`axes_toward`) of films and players.

    Containers are seen from the side, closed trays along their normal (`from_the_side`). Open
    floors are seen obliquely from above, from the right of the drive axis or, if tilted, of the
    uphill direction. Up in the picture is against gravity, on closed trays y or uphill.
    """
    case = motion.case
    boundary = case.boundary
    if from_the_side(case):
        return axes_toward(np.array([0.0, -1.0, 0.0]), against_gravity(motion))
    if boundary.closed:
        return plan_axes(motion, np.array([1.0, 0.0, 0.0]))
    drive_axis = np.array(case.drive_axis)
    forward = _uphill(motion) if boundary.tilt else drive_axis
    is_driven_forward = not boundary.tilt or abs(forward @ drive_axis) > 0.5  # within 60°
    elevation = _ELEVATION
    if boundary.is_open_floor and is_driven_forward and len(motion.walkers) == 1:
        elevation = _ELEVATION_OF_ONE
    left = np.cross([0.0, 0.0, 1.0], forward)
    toward = np.array([0.0, 0.0, sin(elevation)]) - cos(elevation) * left
    return axes_toward(toward, against_gravity(motion))


def oblique_axes(motion: Motion) -> FloatArray:
    """The axes (`axes_toward`) of a perspective of a container, which shows its depth."""
    return axes_toward(np.array(_TOWARD_CONTAINER), against_gravity(motion))


def plan_axes(motion: Motion, right: FloatArray) -> FloatArray:
    """The axes (`axes_toward`) of a view along the normal of a floor.

    On a tilted floor up in the picture is uphill; otherwise ``right``, a direction in the plane of
    the floor, is to the right.
    """
    upward = np.cross([0.0, 0.0, 1.0], right)
    if motion.case.boundary.tilt:
        upward = _uphill(motion)
    return axes_toward(np.array([0.0, 0.0, 1.0]), upward)


def _uphill(motion: Motion) -> FloatArray:
    """Unit vector uphill in the plane of a tilted floor."""
    angle = motion.case.boundary.uphill
    return np.array([cos(angle), sin(angle), 0.0])


def named_direction(motion: Motion) -> tuple[FloatArray, str]:
    """Direction (unit vector) of the displacement that is written into pictures, and its name."""
    if from_the_side(motion.case):
        return against_gravity(motion), "up"
    right, up, _ = plan_axes(motion, np.array(motion.case.drive_axis))
    if motion.case.boundary.tilt:
        return up, "uphill"
    return right, "along the drive axis"
