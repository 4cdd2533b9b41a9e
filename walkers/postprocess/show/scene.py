"""Scene of a run: what a picture shows of the beads, in which colours, and how the camera follows.

`walkers.postprocess.show.window` draws scenes for pictures and films. Reports and notebooks
(`walkers.postprocess.show.report.player`) and ParaView (`walkers.postprocess.show.paraview`) show
the same. Directions of view are in `walkers.postprocess.show.camera`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, radians, tan

import numpy as np

from walkers.arrays import BoolArray, FloatArray
from walkers.errors import input_error
from walkers.postprocess.measure import piles
from walkers.postprocess.measure.motion import Motion
from walkers.postprocess.show.camera import CAMERA_DISTANCE
from walkers.postprocess.show.meshes import walls_of

RUBY = (0xB0203C, 0xE0566C)
"""Colours of large and small highlighted beads: red, green, blue."""
GLASS = (0x8C9AA5, 0xC9D2D8)
"""Colours of the other large and small beads: red, green, blue."""
_PALE = 0.72
"""Share of white in the pale lunes."""
_BRIGHTEST = 150.0
"""Largest mean of red, green and blue in the dark lunes, of 255."""
_LONG_PATH = 1.5
"""The camera follows the beads if the view of their whole path is larger than the view that follows
them by more than this factor."""
_FOLLOWING_EXTENT = 1.4
"""Extent of a view that follows the beads over the extent of the beads."""


def motion_in_view(motion: Motion, walker: int | None) -> tuple[Motion, bool]:
    """Select what pictures and films show of a motion.

    Parameters
    ----------
    motion
        The motion.
    walker
        Number of a walker to show by itself; None: the first of independent walkers, otherwise all
        beads.

    Returns
    -------
    motion
        The motion of what is shown.
    is_single
        Whether it is one walker by itself.

    Raises
    ------
    InputError
        If there is no walker with this number.
    """
    if walker is None and not motion.case.apart:
        return motion, False
    number = walker or 0
    count = len(motion.walkers)
    if not 0 <= number < count:
        expected = f"expected 0 to {count - 1}" if count else "the run has no walkers"
        raise input_error("walker", f"{number}: {expected}")
    return motion.of_walkers(motion.walkers[number : number + 1]), True


def gathered(motion: Motion, lane: float = 2.0) -> Motion:
    """Move independent walkers onto parallel lanes for pictures.

    In a deck, independent walkers start far apart (``walker.origin``). In a picture, the first one
    starts at the origin, and the others beside it, to the right of the drive axis. Between walls
    the first walker is shown alone. A motion with loose beads, or whose walkers may meet, is
    returned unchanged (`walkers.inputs.tables.case.Case.apart`).

    Parameters
    ----------
    motion
        The motion.
    lane
        Distance of the lanes in lengths of the longest walker.
    """
    case = motion.case
    if not case.apart:
        return motion
    distance = lane * max(kind.length for kind in case.walkers)
    across = np.cross([0.0, 0.0, 1.0], case.drive_axis)
    shift = np.zeros((len(motion.radius), 3))
    for number, walker in enumerate(motion.walkers):
        shift[list(walker.beads)] = -number * distance * across - [*walker.origin, 0.0]
    on_lanes = replace(motion, position=motion.position + shift)
    if case.boundary.is_open_floor:
        return on_lanes
    return on_lanes.of_walkers(on_lanes.walkers[:1])


def orientations_of(motion: Motion) -> FloatArray | None:
    """Orientations of the beads, integrated from their spins: dR/dt = [ω]× R.

    The engine has no orientations of spheres. Here a bead turns by ω Δt about ω between two frames.
    With walkers, ω is the average over all steps, and the result is exact if the axis is constant
    during the interval. Otherwise ω is the mean of both frames, which is sufficient if the frames
    resolve the cycle.

    Returns
    -------
    ndarray, shape (F, N, 4), or None
        Quaternions (x, y, z, w) of the rotation since the first frame; None if the frames are too
        far apart.
    """
    from scipy.spatial.transform import Rotation

    if motion.mean_spin is None and not motion.follows_cycles:
        return None
    steps = motion.averaged.spin * np.diff(motion.time)[:, None, None]
    now = Rotation.identity(len(motion.radius))
    orientations = [now.as_quat()]
    for step in steps:
        now = Rotation.from_rotvec(step) * now
        orientations.append(now.as_quat())
    return np.array(orientations)


def rotations_at(orientations: FloatArray, frame: float) -> FloatArray:
    """Rotation matrices of the beads at a time.

    Parameters
    ----------
    orientations : ndarray, shape (F, N, 4)
        Quaternions of the beads in all frames (`orientations_of`).
    frame
        Number of a frame, with a fraction between two frames.

    Returns
    -------
    ndarray, shape (N, 3, 3)
    """
    from scipy.spatial.transform import Rotation

    number = int(frame)
    fraction = frame % 1.0
    before = Rotation.from_quat(orientations[number])
    after = Rotation.from_quat(orientations[number + ceil(fraction)])
    turn = (after * before.inv()).as_rotvec()
    rotations = Rotation.from_rotvec(fraction * turn) * before
    matrices: FloatArray = rotations.as_matrix()
    return matrices


@dataclass(frozen=True)
class FloorGrid:
    """Lines on an open floor along x and y.

    Attributes
    ----------
    step
        Distance of the lines, mm.
    origin
        x and y of a crossing, mm.
    """

    step: float
    origin: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Scene:
    """Beads, walls and a view of them, orthographic or in perspective.

    Attributes
    ----------
    motion
        The motion, of F frames of N beads.
    axes : ndarray, shape (3, 3)
        Unit vectors to the right in the picture, up, and toward the camera, as rows.
    low, high : ndarray, shape (3,)
        Limits of the view along these axes, mm.
    shaken
        Whether the view is in the laboratory, so that the boundary shakes; otherwise it is in the
        frame of the boundary.
    rolling
        Whether beads have two colours, if their orientations are known, so that they are seen to
        roll.
    camera_path : ndarray, shape (F, 3), or None
        Displacement of the camera in each frame, mm; None for a camera at rest.
    has_tables
        Whether the run has been measured, so that its tables tell which clusters climb.
    grid
        Lines on an open floor; None: at round places.
    angle_of_view
        Angle of view of a perspective, degrees; 0: the view is orthographic. The limits are those
        at the front of what is shown, the nearest to the camera.
    """

    motion: Motion
    axes: FloatArray
    low: FloatArray
    high: FloatArray
    shaken: bool = True
    rolling: bool = False
    camera_path: FloatArray | None = None
    has_tables: bool = True
    grid: FloorGrid | None = None
    angle_of_view: float = 0.0

    @classmethod
    def around(
        cls,
        motion: Motion,
        axes: FloatArray,
        extent_factor: float = 1.0,
        frames: slice = slice(None),
        *,
        shaken: bool = True,
    ) -> Scene:
        """A view, with a camera at rest, of the beads and of the width and floor of a container.

        Parameters
        ----------
        motion
            The motion.
        axes : ndarray, shape (3, 3)
            The axes of the view.
        extent_factor
            Extent of the view over that of what it shows.
        frames
            Frames in which all beads are in the view.
        shaken
            Whether the view is in the laboratory.
        """
        position = motion.position[frames]
        if shaken:
            position = position + motion.substrate[frames, None]
        low, high = _limits(position, motion.radius, axes)
        boundary = motion.case.boundary
        if boundary.closed:
            # The camera is more than 30° above the floor, as that of trays.
            is_from_above = axes[2, 2] > 0.5
            half = 5e2 * boundary.inner_width * np.array([1.0, is_from_above])
            low[:2] = np.minimum(low[:2], -half)
            high[:2] = np.maximum(high[:2], half)
        margin = (extent_factor - 1.0) / 2.0 * (high - low)
        return cls(motion, axes, low - margin, high + margin, shaken)

    def on_path(
        self, camera_path: FloatArray, extent_factor: float, frames: slice = slice(None)
    ) -> Scene:
        """The same view with a moving camera; it does not include the container.

        Parameters
        ----------
        camera_path : ndarray, shape (F, 3)
            Displacement of the camera in each frame, mm.
        extent_factor
            Extent of the view over that of the beads.
        frames
            Frames in which all beads are in the view.
        """
        position = self.motion.position[frames]
        if self.shaken:
            position = position + self.motion.substrate[frames, None]
        position = position - 1e-3 * camera_path[frames, None]
        low, high = _limits(position, self.motion.radius, self.axes)
        margin = (extent_factor - 1.0) / 2.0 * (high - low)
        return replace(self, low=low - margin, high=high + margin, camera_path=camera_path)

    def following(
        self, aspect: float, extent_factor: float = 1.0, frames: slice = slice(None)
    ) -> Scene:
        """The same view, or a closer one that follows the beads if their path is long.

        Parameters
        ----------
        aspect
            Width over height of the picture.
        extent_factor
            As in `around`.
        frames
            Frames in which all beads are in the view.
        """
        camera_path = _smoothed_path(self.motion, frames.start or 0)
        closer = self.on_path(camera_path, _FOLLOWING_EXTENT * extent_factor, frames)
        if self.height(aspect) > _LONG_PATH * closer.height(aspect):
            return closer
        return self

    def camera_displacement(self, frame: float) -> FloatArray:
        """Displacement of the camera in a frame, or between two frames (a fraction), mm."""
        if self.camera_path is None:
            return np.zeros(3)
        number = int(frame)
        fraction = frame % 1.0
        before = self.camera_path[number]
        after = self.camera_path[number + ceil(fraction)]
        displacement: FloatArray = (1.0 - fraction) * before + fraction * after
        return displacement

    def with_walls(self, frames: slice = slice(None)) -> Scene:
        """The same view, which also includes the walls of a container up to the highest bead.

        Parameters
        ----------
        frames
            Frames in which all beads are below the upper end of the view.
        """
        corners = 1e3 * np.concatenate(walls_of(self.motion))
        tops = self.motion.position[frames, :, 2] + self.motion.radius
        corners[:, 2] = np.minimum(corners[:, 2], 1e3 * float(tops.max()))
        seen = corners @ self.axes.T
        low = np.minimum(self.low, seen.min(axis=0))
        high = np.maximum(self.high, seen.max(axis=0))
        return replace(self, low=low, high=high)

    @property
    def shortening(self) -> float:
        """Size in the middle of the view over that at its front; 1 if it is orthographic."""
        if not self.angle_of_view:
            return 1.0
        height = float(self.high[1] - self.low[1])
        half_depth = float(self.high[2] - self.low[2]) / 2.0
        distance = self.camera_distance(height)
        return (distance - half_depth) / distance

    def camera_distance(self, height: float) -> float:
        """Distance of the camera from the middle of a view of a height, mm."""
        if not self.angle_of_view:
            return CAMERA_DISTANCE * height
        half_depth = float(self.high[2] - self.low[2]) / 2.0
        return half_depth + height / 2.0 / tan(radians(self.angle_of_view / 2.0))

    def height(self, aspect: float) -> float:
        """Height of the picture, mm, for a ratio of width to height."""
        width, height, _ = self.high - self.low
        return float(max(height, width / aspect))

    def camera(self, distance: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """A camera at a distance from the middle of the view.

        Parameters
        ----------
        distance
            The distance, mm.

        Returns
        -------
        position, middle : ndarray, shape (3,)
            Position of the camera, and the middle of the view, mm.
        up : ndarray, shape (3,)
            Unit vector that is up in the picture.
        """
        middle = (self.low + self.high) / 2.0 @ self.axes
        return middle + distance * self.axes[2], middle, self.axes[1]

    @cached_property
    def orientations(self) -> FloatArray | None:
        """Orientations of the beads (`orientations_of`); None if not shown or unknown."""
        return orientations_of(self.motion) if self.rolling else None

    @cached_property
    def highlighted(self) -> BoolArray:
        """Highlighted beads in each frame: walkers and climbing clusters; shape (F, N)."""
        motion = self.motion
        highlighted = np.tile(motion.walker_of >= 0, (len(motion.time), 1))
        if self.has_tables and piles.applies(motion.case):
            _, is_climber = piles.tracks_of(motion)
            highlighted = highlighted | is_climber
        return highlighted

    @property
    def colour_legend(self) -> list[str]:
        """What colours of beads mean, if that is not plain."""
        if self.motion.case.loose and self.highlighted.any():
            return ["red: climbers"]
        return []

    def colours(self, highlighted: BoolArray) -> FloatArray:
        """Colours of the dark and of the pale lunes of the beads.

        Parameters
        ----------
        highlighted : ndarray of bool, shape (N,)
            Beads in ruby; the others are grey.

        Returns
        -------
        ndarray, shape (2, N, 3)
            Red, green, blue from 0 to 255, of dark lunes, then of pale ones.
        """
        large = self.motion.large
        ruby = np.where(large, *RUBY)
        glass = np.where(large, *GLASS)
        packed = np.where(highlighted, ruby, glass)
        # The bytes of red, green and blue.
        plain = (packed[:, None] >> np.array([16, 8, 0]) & 255).astype(np.float64)
        if self.orientations is None:
            return np.stack([plain, plain])
        dark = plain * np.minimum(1.0, _BRIGHTEST / plain.mean(axis=1, keepdims=True))
        pale = plain + _PALE * (255.0 - plain)
        return np.stack([dark, pale])


def _limits(
    position: FloatArray, radius: FloatArray, axes: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest coordinates of beads along the axes of a view, mm, shape (3,) each.

    Parameters
    ----------
    position : ndarray, shape (F, N, 3)
        Centres of the beads, m.
    radius : ndarray, shape (N,)
        Radii of the beads, m.
    axes : ndarray, shape (3, 3)
        Axes of the view, as rows.
    """
    seen = 1e3 * position @ axes.T
    margin = 1e3 * radius[:, None]
    return (seen - margin).min(axis=(0, 1)), (seen + margin).max(axis=(0, 1))


def _smoothed_path(motion: Motion, start: int) -> FloatArray:
    """Displacement of the mean position of the beads, smoothed over a cycle, mm, shape (F, 3).

    It is zero in the frame ``start``.
    """
    middle = 1e3 * motion.position.mean(axis=1)
    half = min(motion.case.run.samples_per_cycle, len(middle) - 1) // 2
    # The odd reflection continues a straight path straight on.
    extended = np.pad(middle, ((half, half), (0, 0)), "reflect", reflect_type="odd")
    windows = np.lib.stride_tricks.sliding_window_view(extended, 2 * half + 1, axis=0)
    smooth = windows.mean(axis=-1)
    return np.asarray(smooth - smooth[start])
