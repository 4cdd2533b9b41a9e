"""The analysis of walkers: their tables, their velocities, rotation and sliding, their orientation.

The result follows the paper's protocol: each velocity is the mean over replicates, its error bar the largest minus the
smallest, with the walkers that face left and right also apart.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import degrees, nan, sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import numpy.typing as npt

from walkers.inputs.case import Case
from walkers.inputs.loads import contact_loads, dimer_of
from walkers.postprocess.analysis import Analysis, Columns, Described
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.gait import STEADY_SPEED, Gait, Walk, averages, gait, settled_samples, walk
from walkers.postprocess.motion import Bridges, Group, Motion, read_bridges, read_motion
from walkers.postprocess.posture import POSTURES, describe_posture, posture_summary, postures, turned_over_at, ways
from walkers.postprocess.tables import WALKERS, described

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SEPARATED = 0.1
"""Share of the time beyond which beads that no bridge can hold together are no walker."""
SAME = 0.05
"""Walkers that faced either way and differ by more than this share are told apart first of all."""
NEAR = 1.5
"""Walkers whose mass centres come within this many lengths of one have met."""
_DIMERS = [
    *(f"rotation_{bead}" for bead in (1, 2)),
    *(f"{what}_{at}" for what in ("sliding", "open") for at in (1, 2, 3)),
]


class Walking(Analysis):
    """How walkers walk."""

    name = "walking"
    version = 5
    tables = ("trajectory", "walkers", "bridges")
    headlines = ("velocity",)
    derived: ClassVar[Described] = {
        "gamma0": ("", "dimensionless peak force Γ0 = a0 M/(4πγR̄) of dimers"),
        "sin_delta": ("", "asymmetry parameter (R1 - R2)/(R1 + R2) of dimers"),
        "mass_asymmetry": ("", "μ = (m1 - m2)/M of dimers"),
        "radius_1": ("m", "of bead 1"),
        "radius_2": ("m", "of bead 2"),
    }
    columns: ClassVar[Described] = {
        "velocity": ("m/s", "mean over the walkers, along the heading, positive toward the large bead"),
        "smallest": ("m/s", "velocity of the slowest walker"),
        "largest": ("m/s", "velocity of the fastest walker; the paper's error bar is largest minus smallest"),
        "standard_error": ("m/s", "of the velocity"),
        "right_facing": ("m/s", "mean velocity of the walkers that started facing right"),
        "left_facing": ("m/s", "mean velocity of the walkers that started facing left"),
        "axial_velocity": ("m/s", "mean of the mass centres along the drive axis, on a slope up it"),
        # Means over the walkers of what the table of a run says of each.
        **{name: meaning for name, meaning in described("walkers", _DIMERS).items() if name in _DIMERS},
        "separated_fraction": WALKERS["separated_fraction"],
        "orientation_end": ("rad", "mean orientation at the end"),
        "walkers": ("", "replicates"),
        "steady": ("", "how many of them are steady"),
        "turned_round": ("", "how many of them turned by more than 90 degrees"),
        "upright": ("", "on a slope: how many of them end as they were to face, and tilt no more"),
        "cycles": ("", "driven, those to settle among them"),
        "ended_early": ("", "whether that was less than it might have been, for the walkers were steady"),
        "walkers_met": ("", "whether two of them came near each other"),
    }
    places: ClassVar[Mapping[str, str]] = {
        "velocity": "velocity.mean",
        **{name: f"velocity.{name}" for name in ("smallest", "largest", "standard_error")},
        **{name: f"{name}.mean" for name in ("right_facing", "left_facing", "axial_velocity", "orientation_end")},
        "upright": "posture.upright",
        **{name: f"{name[:-2]}.{'bead' if 'rotation' in name else 'contact'}{name[-2:]}" for name in _DIMERS},
    }
    rows = (
        ("walkers", "walkers"),
        ("of them steady", "steady"),
        ("of them turned round by more than 90°", "turned_round"),
        ("beads farther apart than a bridge reaches", "separated_fraction", "share"),
        ("cycles driven", "cycles"),
        ("of them to settle", "settling_cycles"),
        ("dimensionless peak force Γ0", "gamma0"),
        ("asymmetry sin δ", "sin_delta"),
    )

    def applies(self, case: Case) -> bool:
        """Of walkers."""
        return bool(case.walkers)

    def of(self, motion: Motion) -> tuple[dict[str, Columns], dict[str, Any]]:
        """Tables of all walkers; the result is of all of them, its contacts of the first make, and of each make."""
        groups, gaits, walks = motion.groups, [gait(one) for one in motion.groups], [walk(one) for one in motion.groups]
        rows = [_walker_columns(*one) for one in zip(groups, gaits, walks, strict=True)]
        walkers = _stacked(rows)
        tables = {
            "trajectory": _stacked([_trajectory_columns(group, one) for group, one in zip(groups, gaits, strict=True)]),
            "walkers": walkers,
            "bridges": _bridge_columns(motion),
        }
        case, known = motion.case, self.derived_of(motion.case)
        turned = [np.isfinite(row["turned_at"]) for row in rows]
        makes = [_summary(*one) for one in zip(rows, turned, strict=True)]
        summary = {
            **_summary(walkers, np.concatenate(turned)),
            # A contact's number means another one in another make: these are of the first.
            **{name: makes[0][name] for name in ("rotation", "sliding", "open")},
            "walkers_met": walkers_met(groups),
            "meet": case.meets,
            "contacts": _contact_names(groups[0]),
            "cycles": case.run.cycles,
            "settling_cycles": case.run.settling_cycles,
            "ended_early": motion.ended_early,
            "posture": _posture(groups, walkers) if case.goes_uphill else None,
            **{name: known.get(name) for name in ("gamma0", "sin_delta")},
        }
        if len(groups) > 1:
            summary["makes"] = [
                {"radii": list(group.make.radii), **one} for group, one in zip(groups, makes, strict=True)
            ]
        return tables, summary

    def derived_of(self, case: Case) -> dict[str, float]:
        """Of dimers; NaN where walkers are larger clusters."""
        first, second = case.walkers[0].radii[:2]
        known = {"radius_1": first, "radius_2": second}
        if len(case.walkers[0].radii) > 2:
            return known
        dimer = dimer_of(case)
        known |= {"sin_delta": dimer.sin_delta, "mass_asymmetry": dimer.mass_asymmetry}
        return {"gamma0": dimer.gamma0(case.drive.peak_acceleration), **known}

    def lines(self, result: Mapping[str, Any]) -> list[str]:
        """Velocities, rotation, sliding and orientation of all walkers, and velocities of each make."""
        rotation, end, names = result["rotation"], result["orientation_end"], result["contacts"]
        numbers = [result[name] for name in ("gamma0", "sin_delta")]
        drive = result["drive"] + (f", Γ0 = {numbers[0]:.3g}, sin δ = {numbers[1]:.3g}" if None not in numbers else "")
        beads = ", ".join(f"bead {number} {_speed(value)}" for number, value in enumerate(rotation.values(), 1))
        sliding = ", ".join(f"{name} {_speed(result['sliding'][contact])}" for contact, name in names.items())
        lines = [
            *(_of_turned(result, drive) if result["turned_round"] else _of_walkers(result, drive)),
            f"  rotation   {beads} mm/s",
            f"  sliding    {sliding} mm/s",
            f"  orientation at the end {degrees(end['smallest']):.2f}° to {degrees(end['largest']):.2f}°",
        ]
        if any(result["open"].values()):
            shares = ", ".join(f"{name} {100 * result['open'][contact]:.1f} %" for contact, name in names.items())
            lines.append(f"  contacts open: {shares} of the time")
        makes = result.get("makes", [])
        return lines + [
            f"  of {_radii(one)} mm  {_speed(one['velocity']['mean'])} mm/s; {_steady(one)}" for one in makes
        ]

    def rows_of(self, result: Mapping[str, Any]) -> Iterable[tuple[str, ...]]:
        """The same as rows of a table."""
        first, second = ways(uphill=result["goes_uphill"])
        yield "velocity along the heading, positive toward the large bead", "velocity", "m/s"
        yield f"velocity of those that started facing {first}", "right_facing", "m/s"
        yield f"velocity of those that started facing {second}", "left_facing", "m/s"
        if result["turned_round"]:
            yield "velocity of those that kept their heading", "kept_heading", "m/s"
        yield "velocity along the drive axis", "axial_velocity.mean", "m/s"
        yield "velocity across the drive axis", "lateral_velocity.mean", "m/s"
        for bead in result["rotation"]:
            yield f"rotation of {bead.replace('_', ' ')}, −R dφ/dt", f"rotation.{bead}", "m/s"
        for family, told, unit in (("sliding", "sliding", "m/s"), ("open", "contact open", "share")):
            for contact, name in result["contacts"].items():
                yield f"{told}, {name}", f"{family}.{contact}", unit
        yield "orientation at the end", "orientation_end", "rad"
        for number, make in enumerate(result.get("makes", [])):
            yield f"velocity of those of {_radii(make)} mm", f"makes.{number}.velocity", "m/s"
        yield from ((f"walkers that are {posture}", f"posture.{posture}") for posture in POSTURES)
        yield from self.rows

    def warnings(self, result: Mapping[str, Any]) -> list[str]:
        """What makes the velocity doubtful."""
        warnings = []
        if result["steady"] < result["walkers"]:
            warnings.append("some walkers are not steady: the velocity depends on the length of the run")
        if (result["separated_fraction"] or 0.0) > SEPARATED:
            share = f"{100.0 * result['separated_fraction']:.0f} %"
            warnings.append(f"beads of walkers are farther apart than a bridge reaches for {share} of the time")
        if result["walkers_met"] and not result["meet"]:
            warnings.append("walkers came close to each other and are not independent: give them more spacing")
        return warnings

    def figures(self, directory: Path) -> Mapping[str, Figure]:
        """Where they went and turned, and their gait if it was sampled often enough."""
        from walkers.postprocess.figures import walk_figures

        return walk_figures(read_motion(directory).groups)


def _radii(make: Mapping[str, Any]) -> str:
    """Of the beads of a make, mm."""
    return "/".join(f"{radius * 1e3:g}" for radius in make["radii"])


def _stacked(parts: list[Columns]) -> Columns:
    """Tables one below the other; numbers that one lacks are NaN."""
    if len(parts) == 1:
        return parts[0]
    lengths = [len(next(iter(part.values()))) for part in parts]
    return {
        key: np.concatenate(
            [part.get(key, np.full(length, np.nan)) for part, length in zip(parts, lengths, strict=True)]
        )
        for key in dict.fromkeys(key for part in parts for key in part)
    }


def _numbered(name: str, values: FloatArray) -> dict[str, FloatArray]:
    """Columns such as ``rotation_1`` of the last axis."""
    return {f"{name}_{number + 1}": values[..., number] for number in range(values.shape[-1])}


def _trajectory_columns(group: Group, motion: Gait) -> Columns:
    frames, walkers = motion.velocity.shape
    centre = group.mass_centre
    columns: dict[str, FloatArray] = {
        "x": centre[..., 0],
        "y": centre[..., 1],
        "z": centre[..., 2],
        "orientation": group.orientation,
        "velocity": motion.velocity,
        **_numbered("rotation", motion.rotation),
        **_numbered("sliding", motion.sliding),
        **_numbered("gap", motion.gap),
    }
    time = np.tile(group.time, walkers)
    return {
        "walker": np.repeat([walker.walker for walker in group.walkers], frames),
        "time": time,
        "cycle": time * group.case.drive.frequency,
        **{key: values.T.reshape(-1) for key, values in columns.items()},
    }


def _walker_columns(group: Group, motion: Gait, walked: Walk) -> Columns:
    samples, beads, means = settled_samples(group), len(group.radii), averages(group)
    between = motion.gap[samples, :, beads:]
    reach = np.array(contact_loads(group.case, group.make).rupture[beads:])
    return {
        "walker": np.array([walker.walker for walker in group.walkers], dtype=np.int64),
        "make": np.array([walker.make for walker in group.walkers], dtype=np.int64),
        "facing": np.array([walker.facing for walker in group.walkers], dtype=np.int64),
        "start_angle": np.array([walker.start_angle for walker in group.walkers]),
        "velocity": walked.velocity,
        "standard_error": walked.standard_error,
        "first_half": walked.first_half,
        "second_half": walked.second_half,
        "steady": walked.steady,
        "axial_velocity": walked.axial,
        "lateral_velocity": walked.lateral,
        "orientation_mean": group.orientation[samples].mean(axis=0),
        "orientation_end": group.orientation[-1],
        "turned_at": turned_over_at(group),
        "separated_fraction": (between > reach).any(axis=-1).mean(axis=0),
        **_numbered("rotation", means.rotation),
        **_numbered("sliding", means.sliding),
        **_numbered("open", means.open),
    }


def _bridge_columns(motion: Motion) -> Columns:
    """Columns of the table ``bridges``, sorted by time, walker and contact."""
    contact_of = {
        (walker.beads[one] - motion.first_id, walker.beads[other] - motion.first_id): len(walker.beads) + number
        for walker in motion.walkers
        for number, (one, other) in enumerate(motion.case.walkers[walker.make].pairs, 1)
    }
    bead_of = {bead - motion.first_id: place for one in motion.walkers for place, bead in enumerate(one.beads, 1)}
    parts = [_bridge_rows(motion, bridges, contact_of, bead_of) for bridges in read_bridges(motion)]
    merged = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    order = np.lexsort((merged["bead_2"], merged["contact"], merged["walker"], merged["time"]))
    return {key: values[order] for key, values in merged.items()}


def _bridge_rows(
    motion: Motion, bridges: Bridges, contact_of: Mapping[tuple[int, int], int], bead_of: Mapping[int, int]
) -> Columns:
    """The rows of a frame: bridges between beads, then those to walls."""
    pairs, walls = np.sort(bridges.beads, axis=1), len(bridges.wall_beads)
    first = np.concatenate([pairs[:, 0], bridges.wall_beads])
    second = np.concatenate([pairs[:, 1], np.full(walls, -1)])
    owner = motion.walker_of
    gap = np.concatenate([bridges.gap, bridges.wall_gap])
    joined = np.where(second >= 0, owner[second], owner[first])
    contacts = [contact_of.get((one, other), 0) for one, other in pairs.tolist()]
    contacts += [bead_of.get(bead, 0) for bead in bridges.wall_beads.tolist()]
    return {
        "time": np.full(len(first), motion.time[bridges.frame]),
        "walker": owner[first],
        "contact": np.array(contacts, dtype=np.int64),
        "bead_1": first,
        "bead_2": second,
        "wall": np.concatenate([np.full(len(pairs), -1), bridges.walls]),
        "other_walker": np.where(joined == owner[first], -1, joined),
        "gap": gap,
        "touching": gap <= 0.0,
        "normal_force": np.concatenate([bridges.force, bridges.wall_force]),
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


def _summary(walkers: Columns, turned: npt.NDArray[np.bool_]) -> dict[str, Any]:
    velocity, facing = walkers["velocity"], walkers["facing"]
    axial = walkers["axial_velocity"]

    def means(family: str, named: str) -> dict[str, float | None]:
        columns = [name for name in walkers if name.rpartition("_")[0] == family]
        return {f"{named}_{name.rpartition('_')[2]}": _mean(walkers[name]) for name in columns}

    return {
        "velocity": _spread(velocity, float(walkers["standard_error"][0])),
        "right_facing": _spread(velocity[facing > 0]),
        "left_facing": _spread(velocity[facing < 0]),
        "kept_heading": _spread(velocity[~turned]),
        "axial_velocity": {
            "mean": _mean(axial),
            "right_facing": _mean(axial[facing > 0]),
            "left_facing": _mean(axial[facing < 0]),
        },
        "lateral_velocity": {"mean": _mean(walkers["lateral_velocity"])},
        "rotation": means("rotation", "bead"),
        "sliding": means("sliding", "contact"),
        "open": means("open", "contact"),
        "separated_fraction": _mean(walkers["separated_fraction"]),
        "orientation_end": _spread(walkers["orientation_end"]),
        "steady": int(np.sum(walkers["steady"])),
        "turned_round": int(np.sum(turned)),
        "walkers": len(velocity),
    }


def _posture(groups: Iterable[Group], walkers: Columns) -> dict[str, Any]:
    found = [posture for group in groups for posture in postures(group)]
    return posture_summary(found, walkers["turned_at"], walkers["orientation_end"])


def _mean(values: FloatArray) -> float | None:
    """Mean over those that have the number."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else None


def _contact_names(group: Group) -> dict[str, str]:
    """What the contacts of the first make are called."""
    count, pairs = len(group.radii), group.make.pairs
    names = [f"bead {bead}" for bead in range(1, count + 1)]
    names += ["bead on bead"] if len(pairs) == 1 else [f"beads {one + 1}-{other + 1}" for one, other in pairs]
    return {f"contact_{number}": name for number, name in enumerate(names, 1)}


def walkers_met(groups: Iterable[Group]) -> bool:
    """Whether two walkers came so near each other that they are no longer independent replicates."""
    groups = list(groups)
    centre = np.concatenate([one.mass_centre[:: one.case.run.samples_per_cycle, :, :2] for one in groups], axis=1)
    return came_near(centre, NEAR * max(one.make.length for one in groups))


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


def _of_walkers(result: Mapping[str, Any], drive: str) -> list[str]:
    """How fast walkers are that kept their heading."""
    velocity = result["velocity"]
    error, count = velocity["standard_error"], velocity["n"]
    of_what = f"over {count} walkers" if count > 1 else "of the fit"
    doubt = f" (standard error {_speed(error)} {of_what})" if error is not None else ""
    toward = {0.0: "toward bead 1", None: "along the heading"}.get(result["sin_delta"], "toward the large bead")
    first, second = ways(uphill=result["goes_uphill"])
    one, other = (result[side]["mean"] for side in ("right_facing", "left_facing"))
    headline = f"{_speed(velocity['mean'])} mm/s, positive {toward}{doubt}"
    if (
        None not in (one, other)
        and abs(one - other) > SAME * max(abs(one), abs(other))
        and abs(one - other) > STEADY_SPEED
    ):
        # The mean over both is no walker's.
        headline = f"facing {first} {_speed(one)}, facing {second} {_speed(other)} mm/s, positive {toward}"
    return [
        *_headlines(result, drive),
        f"  velocity   {headline}",
        f"    smallest {_speed(velocity['smallest'])}, largest {_speed(velocity['largest'])}; {_steady(result)}",
        f"    started facing {first} {_side(result['right_facing'])}, {second} {_side(result['left_facing'])}",
    ]


def _headlines(result: Mapping[str, Any], drive: str, level: str = "") -> list[str]:
    """The drive; before it, on a slope, whether walkers stay as they were to face, and what is to be said elsewhere."""
    told = level if result["posture"] is None else describe_posture(result["posture"])
    return [f"{result['case']}: {told}", f"  drive      {drive}"] if told else [f"{result['case']}: {drive}"]


def _of_turned(result: Mapping[str, Any], drive: str) -> list[str]:
    """What became of walkers of which some turned by more than 90°: a velocity along their heading says nothing."""
    axial, kept = result["axial_velocity"], result["kept_heading"]
    tilted = result["goes_uphill"]
    first, second = ways(uphill=tilted)
    round_ones = f"{result['turned_round']} of {result['walkers']} turned round"
    return [
        *_headlines(result, drive, f"{round_ones}, axial velocity {_speed(axial['mean'])} mm/s"),
        f"  axial velocity, positive {'up' if tilted else 'to the right'}: started facing {first} "
        f"{_speed(axial['right_facing'])}, {second} {_speed(axial['left_facing'])} mm/s; {_steady(result)}",
        f"  velocity   {_speed(kept['mean'])} mm/s along the heading, of the {kept['n']} that kept it"
        if kept["n"]
        else "  velocity   none: no walker kept its heading",
    ]


def _steady(result: Mapping[str, Any]) -> str:
    cycles = f" after {result['cycles']} cycles" if result.get("ended_early") else ""
    return f"{result['steady']} of {result['walkers']} steady{cycles}"


def _speed(value: float | None) -> str:
    """A speed in m/s as text in mm/s: three decimals, or its order of magnitude where these would all be zero."""
    if value is None:
        return "-"
    return f"{value * 1e3:.3f}" if abs(value) >= 5e-7 or value == 0.0 else f"{value * 1e3:.1e}"


def _side(side: Mapping[str, Any]) -> str:
    return f"{_speed(side['mean'])} ({side['n']})" if side["n"] else "none"
