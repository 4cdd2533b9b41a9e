"""From a run directory's dumps to its tables and its result.

The result follows the paper's protocol: each velocity is the mean over replicates, its error bar the largest minus the
smallest, with the walkers that face left and right also apart.
"""

from __future__ import annotations

from math import nan, sqrt
from pathlib import Path
from typing import Any

import numpy as np

from walkers.inputs.case import WalkerCase
from walkers.inputs.dimer import contact_loads, dimer_of
from walkers.postprocess.bridges import Columns, bridge_columns
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.gait import Gait, Walk, gait, settled_samples, walk
from walkers.postprocess.tables import intact, write_table
from walkers.postprocess.trajectory import Trajectory, read_trajectory
from walkers.runner.files import read_json, write_json

RESULT_NAME = "result.json"
_NEWEST_KEYS = {"velocity", "walkers", "gamma0", "separated_fraction", "kept_heading", "goes_uphill", "drive"}
"""Of a result; one that lacks any is of an earlier version."""
NEAR = 1.5
"""Walkers whose mass centres come within this many lengths of a dimer have met."""


def tabulate(directory: str | Path) -> dict[str, Any]:
    """Write the tables and ``result.json`` of a run directory.

    Parameters
    ----------
    directory
        A run directory with its dumps.

    Returns
    -------
    dict
        The result, as in ``result.json``: SI units.

    Raises
    ------
    postprocess.dump.DumpError
        If a dump cannot be read.
    """
    directory = Path(directory)
    trajectory = read_trajectory(directory)
    motion, walked = gait(trajectory), walk(trajectory)
    walkers = _walker_columns(trajectory, motion, walked)
    write_table(directory, "trajectory", _trajectory_columns(trajectory, motion))
    write_table(directory, "walkers", walkers)
    write_table(directory, "bridges", bridge_columns(directory, trajectory.case, trajectory.layout))
    outcome = _result(trajectory, walkers)
    write_json(directory / RESULT_NAME, outcome)
    return outcome


def read_result(directory: str | Path) -> dict[str, Any]:
    """The result of a run, as `tabulate` wrote it."""
    return read_json(Path(directory) / RESULT_NAME)


def current_result(directory: str | Path) -> dict[str, Any]:
    """The result of a finished run; tabulated anew if it or a table is gone or damaged."""
    directory = Path(directory)
    try:
        result = read_result(directory)
        if result.keys() >= _NEWEST_KEYS and intact(directory):
            return result
    except (OSError, ValueError):
        pass
    return tabulate(directory)


def _trajectory_columns(trajectory: Trajectory, motion: Gait) -> Columns:
    frames, walkers = motion.velocity.shape
    centre = trajectory.mass_centre
    columns: dict[str, FloatArray] = {
        "x": centre[..., 0],
        "y": centre[..., 1],
        "z": centre[..., 2],
        "orientation": trajectory.orientation,
        "velocity": motion.velocity,
        **{f"rotation_{bead + 1}": motion.rotation[..., bead] for bead in range(2)},
        **{f"sliding_{contact + 1}": motion.sliding[..., contact] for contact in range(3)},
        **{f"gap_{contact + 1}": motion.gap[..., contact] for contact in range(3)},
    }
    time = np.tile(trajectory.time, walkers)
    return {
        "walker": np.repeat([walker.walker for walker in trajectory.layout.walkers], frames),
        "time": time,
        "cycle": time * trajectory.case.drive.frequency,
        **{key: values.T.reshape(-1) for key, values in columns.items()},
    }


def _walker_columns(trajectory: Trajectory, motion: Gait, walked: Walk) -> Columns:
    samples = settled_samples(trajectory)
    placed = trajectory.layout.walkers
    rotation, sliding = motion.rotation[samples].mean(axis=0), motion.sliding[samples].mean(axis=0)
    opened = (motion.gap[samples] > 0.0).mean(axis=0)
    orientation = trajectory.orientation
    return {
        "walker": np.array([walker.walker for walker in placed], dtype=np.int64),
        "facing": np.array([walker.facing for walker in placed], dtype=np.int64),
        "start_angle": np.array([walker.start_angle for walker in placed]),
        "velocity": walked.velocity,
        "standard_error": walked.standard_error,
        "first_half": walked.first_half,
        "second_half": walked.second_half,
        "steady": walked.steady,
        "axial_velocity": walked.axial,
        "lateral_velocity": walked.lateral,
        "orientation_mean": orientation[samples].mean(axis=0),
        "orientation_end": orientation[-1],
        **{f"rotation_{bead + 1}": rotation[:, bead] for bead in range(2)},
        **{f"sliding_{contact + 1}": sliding[:, contact] for contact in range(3)},
        **{f"open_{contact + 1}": opened[:, contact] for contact in range(3)},
        "separated_fraction": (motion.gap[samples, :, 2] > contact_loads(trajectory.case).rupture[2]).mean(axis=0),
    }


def _spread(values: FloatArray, error_of_one: float = nan) -> dict[str, Any]:
    """Mean, extremes and standard error of the mean over replicates (of a single one: that of its fit)."""
    count = len(values)
    if count == 0:
        return {"n": 0, "mean": None, "smallest": None, "largest": None, "standard_error": None}
    error = float(np.std(values, ddof=1)) / sqrt(count) if count > 1 else error_of_one
    return {
        "n": count,
        "mean": float(values.mean()),
        "smallest": float(values.min()),
        "largest": float(values.max()),
        "standard_error": error if np.isfinite(error) else None,
    }


def _result(trajectory: Trajectory, walkers: Columns) -> dict[str, Any]:
    case = trajectory.case
    velocity, facing = walkers["velocity"], walkers["facing"]
    turned = np.abs(trajectory.orientation).max(axis=0) > np.pi / 2.0
    return {
        "case": case.name,
        "kind": "walker",
        "goes_uphill": case.goes_uphill,
        "units": "SI: m/s, rad, s",
        "velocity": _spread(velocity, float(walkers["standard_error"][0])),
        "right_facing": _spread(velocity[facing > 0]),
        "left_facing": _spread(velocity[facing < 0]),
        "kept_heading": _spread(velocity[~turned]),
        "axial_velocity": {
            "mean": _mean(walkers["axial_velocity"]),
            "right_facing": _mean(walkers["axial_velocity"][facing > 0]),
            "left_facing": _mean(walkers["axial_velocity"][facing < 0]),
        },
        "rotation": {f"bead_{bead}": _mean(walkers[f"rotation_{bead}"]) for bead in (1, 2)},
        "sliding": {f"contact_{contact}": _mean(walkers[f"sliding_{contact}"]) for contact in (1, 2, 3)},
        "open": {f"contact_{contact}": _mean(walkers[f"open_{contact}"]) for contact in (1, 2, 3)},
        "separated_fraction": _mean(walkers["separated_fraction"]),
        "orientation_end": _spread(walkers["orientation_end"]),
        "steady": int(np.sum(walkers["steady"])),
        "turned_round": int(np.sum(turned)),
        "walkers": len(velocity),
        "walkers_met": walkers_met(trajectory),
        "truncated": trajectory.truncated,
        **_drive(case),
    }


def _mean(values: FloatArray) -> float | None:
    return float(values.mean()) if len(values) else None


def _drive(case: WalkerCase) -> dict[str, Any]:
    dimer = dimer_of(case)
    return {
        "frequency": case.drive.frequency,
        "peak_acceleration": case.drive.peak_acceleration,
        "drive": case.drive.described(),
        "gamma0": dimer.gamma0(case.drive.peak_acceleration),
        "sin_delta": dimer.sin_delta,
    }


def walkers_met(trajectory: Trajectory) -> bool:
    """Whether two walkers came so near each other that they are no longer independent replicates."""
    centre = trajectory.mass_centre[:: trajectory.case.run.samples_per_cycle, :, :2]
    return came_near(centre, NEAR * dimer_of(trajectory.case).length)


def came_near(centre: FloatArray, near: float) -> bool:
    """Whether two of several points ever came within a distance of each other.

    Parameters
    ----------
    centre : ndarray, shape (F, W, 2)
        Their places in F frames, m.
    near
        The distance, m.
    """
    # Only walkers whose ranges overlap can have met: of a thousand, a few pairs are left to be followed.
    middle = (centre.max(axis=0) + centre.min(axis=0)) / 2.0
    reach = np.linalg.norm(centre - middle, axis=-1).max(axis=0)
    for number in range(len(middle) - 1):
        apart = np.linalg.norm(middle[number + 1 :] - middle[number], axis=-1)
        within = number + 1 + np.flatnonzero(apart < reach[number + 1 :] + reach[number] + near)
        if np.any(np.linalg.norm(centre[:, within] - centre[:, number, None], axis=-1) < near):
            return True
    return False
