"""Scene of a run: beads, walls, colours, motion and camera.

Reports and notebooks (`walkers.postprocess.show.report.player`) and ParaView
(`walkers.postprocess.show.paraview`) show the same.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil
from typing import Any

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray
from walkers.errors import input_error
from walkers.postprocess.measure import piles
from walkers.postprocess.measure.motion import Motion

RUBY = (0xB0203C, 0xE0566C)
GLASS = (0x8C9AA5, 0xC9D2D8)
"""Colours of large and small beads: highlighted beads and the others."""
_PALE, _BRIGHTEST = (
    0.72,
    150.0,
)  # share of white in the pale lunes; largest mean of red, green, blue in the dark ones
_LONG, _ABOUT = 1.5, 1.4
"""The camera follows the beads if the view of their whole path is larger than the view that follows them by more than
the first factor. The second factor is the extent of the following view over the extent of the beads."""


def motion_in_view(motion: Motion, walker: int | None) -> tuple[Motion, bool]:
    """What pictures and films show: the walker with a number, the first of independent walkers, or all beads.

    The second value is whether it is a walker by itself; `InputError` if there is no walker with this number.
    """
    if walker is None and not motion.case.apart:
        return motion, False
    number, count = walker or 0, len(motion.walkers)
    if not 0 <= number < count:
        raise input_error(
            "walker",
            f"{number}: " + (f"expected 0 to {count - 1}" if count else "the run has no walkers"),
        )
    return motion.of_walkers(motion.walkers[number : number + 1]), True


def gathered(motion: Motion, lane: float = 2.0) -> Motion:
    """Independent walkers moved onto parallel lanes for pictures; between walls the first walker alone.

    All other motions are returned unchanged. ``lane`` is the distance of the lanes in lengths of the longest walker.
    """
    case = motion.case
    if not case.apart:
        return motion
    lane *= max(kind.length for kind in case.walkers)
    across = np.cross([0.0, 0.0, 1.0], case.drive_axis)
    shift = np.zeros((len(motion.radius), 3))
    for number, walker in enumerate(motion.walkers):
        shift[list(walker.beads)] = -number * lane * across - [*walker.origin, 0.0]
    moved = replace(motion, position=motion.position + shift)
    return moved if case.boundary.bare else moved.of_walkers(moved.walkers[:1])


def orientations_of(motion: Motion) -> FloatArray | None:
    """Orientations of the beads: quaternions (x, y, z, w) of the rotation since the first frame, shape (F, N, 4).

    The engine has no orientations of spheres; here its spins are integrated, dR/dt = [ω]× R. A bead turns by ω Δt about
    ω between two frames. With walkers, ω is the average over all steps, and the result is exact if the axis is constant
    during the interval. Otherwise ω is the mean of both frames, which is sufficient if the frames resolve the cycle;
    None if they are too far apart.
    """
    from scipy.spatial.transform import Rotation

    if motion.mean_spin is None and not motion.follows_cycles:
        return None
    steps, now = (
        motion.averaged.spin * np.diff(motion.time)[:, None, None],
        Rotation.identity(len(motion.radius)),
    )
    turned = [now.as_quat()]
    for step in steps:
        now = Rotation.from_rotvec(step) * now
        turned.append(now.as_quat())
    return np.array(turned)


def rotations_at(turned: FloatArray, frame: float) -> FloatArray:
    """Rotation matrices of the beads in a frame, or between two (a fraction), shape (N, 3, 3)."""
    from scipy.spatial.transform import Rotation

    number, share = int(frame), frame % 1.0
    begin, end = (
        Rotation.from_quat(quaternions) for quaternions in turned[[number, number + ceil(share)]]
    )
    matrices: FloatArray = (
        Rotation.from_rotvec(share * (end * begin.inv()).as_rotvec()) * begin
    ).as_matrix()
    return matrices


@dataclass(frozen=True)
class Scene:
    """Beads, walls and an orthographic view of them.

    The rows of ``axes`` are unit vectors to the right in the picture, up, and toward the camera; ``low`` and ``high``
    are the limits of the view along them, mm. If ``shaken``, the view is in the laboratory, otherwise in the frame of
    the boundary. ``rolling`` beads have two colours if their orientation is known. ``camera_path`` is the displacement of the
    camera in each frame, mm, shape (F, 3); None for a camera at rest.
    """

    motion: Motion
    axes: FloatArray
    low: FloatArray
    high: FloatArray
    shaken: bool = True
    rolling: bool = False
    camera_path: FloatArray | None = None

    @classmethod
    def around(
        cls,
        motion: Motion,
        axes: FloatArray,
        share: float = 1.0,
        frames: slice = slice(None),
        **options: Any,
    ) -> Scene:
        """A view of the beads in some frames, and of the width and the floor of a container.

        ``share`` is the extent of the picture over that of the beads. Options are ``shaken``, ``rolling`` and ``camera_path``,
        with which the view does not include the container.
        """
        seen = motion.position[frames]
        if options.get("shaken", True):
            seen = seen + motion.substrate[frames, None]
        if (path := options.get("camera_path")) is not None:
            seen = seen - 1e-3 * path[frames, None]
        seen, radius = 1e3 * seen @ axes.T, 1e3 * motion.radius[:, None]
        low, high = (seen - radius).min(axis=(0, 1)), (seen + radius).max(axis=(0, 1))
        if motion.case.boundary.closed and path is None:
            half = (
                5e2 * motion.case.boundary.inner_width * np.array([1.0, axes[2, 2] > 0.5])
            )  # from above also across
            low[:2], high[:2] = np.minimum(low[:2], -half), np.maximum(high[:2], half)
        wider = (share - 1.0) / 2.0 * (high - low)
        return cls(motion, axes, low - wider, high + wider, **options)

    def following(self, aspect: float, share: float = 1.0, frames: slice = slice(None)) -> Scene:
        """The same view (`around`), or, if the path of the beads is long, a closer one that follows the beads."""
        options = {
            "shaken": self.shaken,
            "rolling": self.rolling,
            "camera_path": path_of(self.motion, frames.start or 0),
        }
        near = Scene.around(self.motion, self.axes, _ABOUT * share, frames, **options)
        return near if self.height(aspect) > _LONG * near.height(aspect) else self

    def camera_displacement(self, frame: float) -> FloatArray:
        """Displacement of the camera in a frame, or between two (a fraction), mm."""
        number, share = int(frame), frame % 1.0
        if self.camera_path is None:
            return np.zeros(3)
        return (1.0 - share) * self.camera_path[number] + share * self.camera_path[
            number + ceil(share)
        ]  # type: ignore[no-any-return]

    def height(self, aspect: float) -> float:
        """Height of the picture, mm, for a ratio of width to height."""
        right, up, _ = self.high - self.low
        return float(max(up, right / aspect))

    def camera(self, distance: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """A camera at a distance (mm) from the middle of the view: its position, the middle (mm), upward direction."""
        middle = (self.low + self.high) / 2.0 @ self.axes
        return middle + distance * self.axes[2], middle, self.axes[1]

    @cached_property
    def orientations(self) -> FloatArray | None:
        """Orientations of the beads (`orientations_of`); None if not shown or unknown."""
        return orientations_of(self.motion) if self.rolling else None

    @cached_property
    def highlighted(self) -> npt.NDArray[np.bool_]:
        """Highlighted beads in each frame: walkers and climbing clusters; shape (F, N)."""
        motion = self.motion
        chosen = np.tile(motion.walker_of >= 0, (len(motion.time), 1))
        return chosen | piles.tracks_of(motion)[1] if piles.applies(motion.case) else chosen

    @property
    def colour_legend(self) -> list[str]:
        """What colours of beads mean, if that is not plain."""
        return ["red: climbers"] if self.motion.case.loose and self.highlighted.any() else []

    def colours(self, chosen: npt.NDArray[np.bool_]) -> FloatArray:
        """Red, green, blue (to 255) of the dark and the pale lunes of beads, shape (2, N, 3); chosen ones in ruby."""
        large = self.motion.large
        packed = np.where(chosen, np.where(large, *RUBY), np.where(large, *GLASS))
        plain = (packed[:, None] >> np.array([16, 8, 0]) & 255).astype(np.float64)
        if self.orientations is None:
            return np.stack([plain, plain])
        darker = plain * np.minimum(1.0, _BRIGHTEST / plain.mean(axis=1, keepdims=True))
        return np.stack([darker, plain + _PALE * (255.0 - plain)])


def path_of(motion: Motion, begin: int = 0) -> FloatArray:
    """Displacement of the centre of the beads since a frame, smoothed over a cycle, mm, shape (F, 3)."""
    middle = 1e3 * motion.position.mean(axis=1)
    half = min(motion.case.run.samples_per_cycle, len(middle) - 1) // 2
    beyond = np.pad(
        middle, ((half, half), (0, 0)), "reflect", reflect_type="odd"
    )  # a straight path goes on
    smooth = np.lib.stride_tricks.sliding_window_view(beyond, 2 * half + 1, axis=0).mean(axis=-1)
    return np.asarray(smooth - smooth[begin])
