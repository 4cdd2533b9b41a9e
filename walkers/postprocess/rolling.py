"""How beads have turned: orientations from recorded spins.

The engine keeps no orientation of a sphere; it is the integral of the angular velocity, dR/dt = [ω]× R, here by the
exponential map over each interval between frames (a rotation by ω Δt about ω).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from walkers.postprocess.dump import FloatArray
from walkers.postprocess.motion import Motion


def follows_cycles(motion: Motion) -> bool:
    """Whether frames follow each other closely enough to show what happens within a cycle of the drive."""
    return motion.case.run.samples_per_cycle >= 8


@dataclass(frozen=True)
class Turns:
    """Quaternions (x, y, z, w) from the axes at the first frame to those of each frame, shape (F, N, 4).

    And rotation vectors from each frame to the next one, rad, shape (F, N, 3); of the last frame nothing.
    """

    turned: FloatArray
    step: FloatArray

    def at(self, frame: int, share: float) -> FloatArray:
        """Rotation matrices of the beads, shape (N, 3, 3), at a share of the way from a frame to the next one."""
        from scipy.spatial.transform import Rotation

        further = Rotation.from_rotvec(share * self.step[frame])
        matrices: FloatArray = (further * Rotation.from_quat(self.turned[frame])).as_matrix()
        return matrices


def turns_of(motion: Motion) -> Turns | None:
    """Integrate the spins of a motion; None where they are not known well enough.

    Where there are walkers the engine averaged spins over all steps between frames, and the sum is exact for axes that
    keep their direction between two frames. Elsewhere spins are known at the frames alone: their means do (trapezoids)
    if the frames follow the cycle, and nothing is known if they are whole cycles apart.
    """
    from scipy.spatial.transform import Rotation

    if motion.mean_spin is None and not follows_cycles(motion):
        return None
    step = np.zeros_like(motion.spin)
    step[:-1] = motion.averaged.spin * np.diff(motion.time)[:, None, None]
    turned = np.empty((*step.shape[:2], 4))
    now = Rotation.identity(step.shape[1])
    for frame, vectors in enumerate(step):
        turned[frame] = now.as_quat()
        now = Rotation.from_rotvec(vectors) * now
    return Turns(turned, step)
