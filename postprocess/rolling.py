"""How beads have turned: their spins, added up from one sample to the next."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from walkers.postprocess.motion import Motion

FloatArray = npt.NDArray[np.float64]


def turned(motion: Motion) -> FloatArray | None:
    """Rotation of each bead since the first frame.

    A bead turns by its mean spin times the interval between two samples, about the mean spin's axis. The mean is over
    all steps of the engine, so the angle about a fixed axis is exact however often the bead changes its sense within a
    cycle; what is left out is that turns about different axes within one interval do not commute.

    Parameters
    ----------
    motion
        Of the beads.

    Returns
    -------
    ndarray, shape (F, N, 3, 3), or None
        Rotation matrices, the unit in the first frame; None where no mean spins were recorded: of piles, of which
        frames are a cycle apart.
    """
    if motion.mean_spin is None:
        return None
    from scipy.spatial.transform import Rotation

    angles = motion.mean_spin[1:] * np.diff(motion.time)[:, None, None]
    rotation = Rotation.identity(len(motion.radius))
    matrices = [rotation.as_matrix()]
    for angle in angles:
        rotation = Rotation.from_rotvec(angle) * rotation
        matrices.append(rotation.as_matrix())
    return np.stack(matrices)
