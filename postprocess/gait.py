"""How walkers walk: velocities, rotation and sliding, orientation, contacts.

Velocities are along the walker's heading, from the small bead to the large one, relative to the substrate. With e the
heading, z the normal of the substrate and ω a bead's angular velocity, the rotation velocity R ω·(z × e) is the paper's
−R dφ/dt (Fig. 4), and the sliding velocity at a contact with the substrate, v·e − R ω·(z × e), its R dφ/dt + v_x. At
the contact between the beads the sliding velocity is R1 dφ1/dt + R2 dφ2/dt.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from walkers.postprocess.dump import DumpError, FloatArray
from walkers.postprocess.trajectory import Trajectory

STEADY_DIFFERENCE = 0.05
"""A walker is steady if the velocities of the two halves of the fitted cycles differ by less than this share …"""
STEADY_SPEED = 1e-5
"""… or by less than this, m/s."""


@dataclass(frozen=True)
class Gait:
    """Time series of F frames and W walkers; SI units. Contacts 0, 1: beads on the substrate, 2: bead on bead.

    Attributes
    ----------
    velocity : ndarray, shape (F, W)
        Of the mass centre along the heading.
    rotation : ndarray, shape (F, W, 2)
        Rotation velocity of the beads.
    sliding, gap : ndarray, shape (F, W, 3)
        Sliding velocity and gap (negative: overlap) at the contacts.
    """

    velocity: FloatArray
    rotation: FloatArray
    sliding: FloatArray
    gap: FloatArray


def gait(trajectory: Trajectory) -> Gait:
    """Rotation, sliding and gaps through the run."""
    radii = trajectory.radii
    heading = trajectory.heading
    across = np.cross([0.0, 0.0, 1.0], heading)
    along = np.einsum("fwbx,fwx->fwb", trajectory.velocity, heading)
    rotation = radii * np.einsum("fwbx,fwx->fwb", trajectory.spin, across)
    weights = radii**3 / np.sum(radii**3)
    distance = np.linalg.norm(trajectory.position[:, :, 0] - trajectory.position[:, :, 1], axis=-1)
    return Gait(
        velocity=along @ weights,
        rotation=rotation,
        sliding=np.concatenate([along - rotation, -rotation.sum(axis=-1, keepdims=True)], axis=-1),
        gap=np.concatenate([trajectory.position[..., 2] - radii, (distance - radii.sum())[..., None]], axis=-1),
    )


@dataclass(frozen=True)
class Walk:
    """Velocities of W walkers after the settling cycles, m/s, each of shape (W,).

    ``velocity`` is the slope of the distance walked along the heading, one sample a cycle, with the standard error of
    the least-squares fit; ``axial`` and ``lateral`` are the mass centre's velocities along and across the drive axis in
    the frame of the substrate; ``steady`` says whether the first and the second half agree.
    """

    velocity: FloatArray
    standard_error: FloatArray
    first_half: FloatArray
    second_half: FloatArray
    axial: FloatArray
    lateral: FloatArray
    steady: npt.NDArray[np.bool_]


def distance_walked(trajectory: Trajectory) -> tuple[FloatArray, FloatArray]:
    """Distance along the heading at the end of each cycle, as a stroboscope sees it.

    Returns
    -------
    time : ndarray, shape (cycles + 1,)
        s.
    distance : ndarray, shape (cycles + 1, W)
        m; each cycle's displacement is projected on the mean of the headings at its ends, so that a walker that turns
        is followed around the curve.
    """
    strobe = trajectory.case.run.samples_per_cycle
    centre, heading = trajectory.mass_centre[::strobe], trajectory.heading[::strobe]
    steps = np.einsum("fwx,fwx->fw", np.diff(centre, axis=0), (heading[1:] + heading[:-1]) / 2.0)
    distance = np.concatenate([np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0)])
    return trajectory.time[::strobe], distance


def fit_slopes(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Slopes of the columns of ``values`` against time and their standard errors (least squares).

    Parameters
    ----------
    time : ndarray, shape (N,)
    values : ndarray, shape (N, K)

    Returns
    -------
    slope, standard_error : ndarray, shape (K,)
        The error is NaN for fewer than three points.
    """
    # Moving the origin keeps rounding out of the sums: positions reach metres, steps micrometres.
    time, values = time - time.mean(), values - values.mean(axis=0)
    square = float(np.sum(time**2))
    slope = time @ values / square
    freedom = len(time) - 2
    residuals = np.sum((values - np.outer(time, slope)) ** 2, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        error = np.sqrt(residuals / freedom / square) if freedom > 0 else np.full(slope.shape, np.nan)
    return slope, error


def walk(trajectory: Trajectory) -> Walk:
    """Fit the velocities of a run's walkers.

    Raises
    ------
    postprocess.dump.DumpError
        If the dump was cut short within the settling cycles.
    """
    settled = trajectory.case.run.settling_cycles
    time, distance = distance_walked(trajectory)
    if len(time) < settled + 2:
        raise DumpError(f"the dump holds {len(time) - 1} cycles, no more than the {settled} settling ones")
    time, distance = time[settled:], distance[settled:]
    velocity, error = fit_slopes(time, distance)
    middle = (len(time) + 1) // 2
    if middle >= 2:
        first, _ = fit_slopes(time[:middle], distance[:middle])
        second, _ = fit_slopes(time[middle - 1 :], distance[middle - 1 :])
    else:
        first = second = velocity
    strobe = trajectory.case.run.samples_per_cycle
    centre = trajectory.mass_centre[::strobe][settled:]
    allowed = np.maximum(STEADY_DIFFERENCE * np.abs(velocity), STEADY_SPEED)
    return Walk(
        velocity=velocity,
        standard_error=error,
        first_half=first,
        second_half=second,
        axial=fit_slopes(time, centre @ trajectory.drive_axis)[0],
        lateral=fit_slopes(time, centre @ trajectory.across_axis)[0],
        steady=np.abs(first - second) <= allowed,
    )


def settled_samples(trajectory: Trajectory) -> slice:
    """The samples of whole cycles after the settling ones, each phase equally often."""
    run = trajectory.case.run
    return slice(run.settling_cycles * run.samples_per_cycle, run.cycles * run.samples_per_cycle)
