"""Analysis of walkers: velocity, rotation, sliding, orientation.

The result follows the protocol of the paper: a velocity is the mean over copies, its error bar the largest minus the
smallest; walkers that start facing left and right are also averaged separately. The copies differ only in how they
start: their scatter is not an uncertainty of the velocity.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from itertools import product
from math import degrees, nan
from typing import Any, ClassVar

import numpy as np

from walkers.inputs.case import Case
from walkers.inputs.loads import contact_loads, dimer_of
from walkers.inputs.run import CONSTANT
from walkers.postprocess.analysis import Analysis, Described, Quantity
from walkers.postprocess.caption import radii_text
from walkers.postprocess.cycles import cycles_of
from walkers.postprocess.dump import FloatArray, IntArray
from walkers.postprocess.gait import (
    POSTURES,
    STEADY_DIFFERENCE,
    Gait,
    averages,
    came_near,
    gait,
    looks_between,
    postures,
    settled_samples,
    turned_over_at,
    walk,
)
from walkers.postprocess.motion import Bridges, Group, Motion, read_bridges
from walkers.postprocess.sides import (
    REST,
    SAME,
    SEPARATED,
    alike,
    came_apart,
    differ,
    fell,
    of_tray,
    sides,
    sides_apart,
    uphill_velocities,
    ways,
)
from walkers.postprocess.tables import Columns, numbered
from walkers.postprocess.uncertainty import (
    LEAST_PER_VALUE,
    accuracy_text,
    band_of,
    band_text,
    bands_text,
    not_known,
    wrapped,
)
from walkers.rounding import percent, with_decimals

NEAR = 1.5
"""Walkers whose centres of mass come closer than this multiple of their length have met."""

_WAYS = {"climb": ("climbs", "climb"), "down": ("goes down", "go down")}
"""Ways of walkers on slopes: of a single walker, of several."""
_ROTATION = "rotation velocity -R dphi/dt of a bead"
_SLIDING = "sliding velocity of"
_OPEN = "fraction of the time, in steps of a tenth of a sample, without contact of"
_WALL, _PAIR = "a bead and its wall", "a pair of beads that touch at the start"
_SEPARATED = "fraction of the samples in which two beads are farther apart than the rupture distance of a bridge"


class Walking(Analysis):
    """Velocity, rotation, sliding and orientation of walkers."""

    order = 0
    name = "walking"
    version = 10
    tables = ("trajectory", "walkers", "cycles", "bridges")
    headlines = ("velocity",)
    derived: ClassVar[Described] = {
        "gamma0": ("", "dimensionless peak force Γ0 = a0 M/(4πγR̄) of dimers"),
        "sin_delta": ("", "asymmetry parameter (R1 - R2)/(R1 + R2) of dimers"),
        "mass_asymmetry": ("", "mass asymmetry μ = (m1 - m2)/M of dimers"),
        "radius_1": ("m", "radius of bead 1"),
        "radius_2": ("m", "radius of bead 2"),
    }

    def applies(self, case: Case) -> bool:
        """Cases with walkers."""
        return bool(case.walkers)

    def of(self, motion: Motion) -> tuple[dict[str, Columns], dict[str, Any]]:
        """Tables and result of all walkers and of each make; contacts are those of the first make."""
        case, groups = motion.case, motion.groups
        gaits = [gait(group) for group in groups]
        rows = [_rows(*one) for one in zip(groups, gaits, strict=True)]
        tables = {
            "trajectory": _stacked([_trajectory(*one) for one in zip(groups, gaits, strict=True)]),
            "walkers": _stacked(rows),
            "cycles": _stacked([cycles_of(group) for group in groups]),
            "bridges": _bridges(motion),
        }
        known, makes = self.derived_of(case), [_summary(one, case) for one in rows]
        summary = {
            **_summary(tables["walkers"], case),
            # The numbers of contacts differ between makes: these are those of the first make.
            **{name: makes[0][name] for name in ("rotation", "sliding", "open")},
            "open_resolution": 1.0 / (looks_between(motion) * case.run.samples_per_cycle),
            "walkers_met": walkers_met(groups),
            "meet": case.meets,
            "contacts": _contact_names(groups[0]),
            "cycles": case.run.cycles,
            "settling_cycles": case.run.settling_cycles,
            "ended_early": motion.ended_early,
            "posture": _posture(groups, tables["walkers"]) if case.goes_uphill else None,
            **{name: known.get(name) for name in ("gamma0", "sin_delta")},
        }
        if len(groups) > 1:
            summary["makes"] = [
                {"radii": list(group.make.radii), **one} for group, one in zip(groups, makes, strict=True)
            ]
        return tables, summary

    def derived_of(self, case: Case) -> dict[str, float]:
        """Derived columns of dimers; NaN for larger clusters."""
        first, second = case.walkers[0].radii[:2]
        known = {"radius_1": first, "radius_2": second}
        if len(case.walkers[0].radii) > 2:
            return known
        dimer = dimer_of(case)
        known |= {"sin_delta": dimer.sin_delta, "mass_asymmetry": dimer.mass_asymmetry}
        return {"gamma0": dimer.gamma0(case.excitation.peak_acceleration), **known}

    def quantities(self, result: Mapping[str, Any]) -> Iterator[Quantity]:
        """Quantities of all walkers: velocities, contacts, makes, postures; sweeps have the contacts of dimers."""
        first, second = ways(uphill=result.get("goes_uphill", False))
        label = f"along the heading, positive {_toward(result)}".removesuffix(", positive along the heading")
        shown = "" if uphill_velocities(result) or came_apart(result) else f"velocity {label}"  # on slopes by direction
        told = f"mean velocity of the walkers, on a slope of those that started facing up, {label}"
        yield Quantity("velocity", shown, "m/s", "velocity", told)
        yield Quantity("velocity.smallest", "", "m/s", "smallest", "velocity of the slowest walker")
        told = "velocity of the fastest walker; the error bars of the paper are largest minus smallest"
        yield Quantity("velocity.largest", "", "m/s", "largest", told)
        told = "standard deviation of the velocities of the copies; not an error of the mean"
        yield Quantity("velocity.scatter", "", "m/s", "scatter", told)
        for name, way in () if came_apart(result) else (("right", first), ("left", second)):
            label = f"velocity along the heading, walkers that started facing {way}"
            told = f"mean velocity of the walkers that started facing {name}"
            yield Quantity(f"{name}_facing", label, "m/s", f"{name}_facing", told)
            if uphill_velocities(result):
                label = f"velocity up the slope, walkers that started facing {way}"
                yield Quantity(f"axial_velocity.{name}_facing", label, "m/s")
        for part, column, way in (
            ("mean", "axial_velocity", "right (on a slope, up)"),
            ("left_facing", "axial_left_facing", "left (on a slope, down)"),
        ):
            told = f"mean velocity of the walkers that started facing {way} along the drive axis (uphill)"
            yield Quantity(f"axial_velocity.{part}", "", "m/s", column, told)
        yield Quantity("lateral_velocity.mean", "" if came_apart(result) else "velocity across the drive axis", "m/s")
        these = ", walkers that started facing up" if result.get("goes_uphill") else ""
        for bead in result.get("rotation", ("bead_1", "bead_2")):
            number = bead.partition("_")[2]
            label = f"rotation of bead {number}{these}, −R dφ/dt"
            yield Quantity(f"rotation.{bead}", label, "m/s", f"rotation_{number}", _ROTATION)
        contacts = result.get("contacts", dict.fromkeys(("bead_1", "bead_2", "pair_1"), ""))
        families = {"sliding": ("sliding", "m/s", _SLIDING), "open": ("contact open", "share", _OPEN)}
        for (family, (label, unit, text)), (contact, name) in product(families.items(), contacts.items()):
            column, meaning = f"{family}_{contact.removeprefix('bead_')}", _PAIR if contact[0] == "p" else _WALL
            yield Quantity(f"{family}.{contact}", f"{label}, {name}{these}", unit, column, f"{text} {meaning}")
        label = "beads farther apart than the rupture distance"
        yield Quantity("separated_fraction", label, "share", "separated_fraction", _SEPARATED)
        label = "orientation at the end, from the direction of facing"
        told = "mean orientation at the end of the run, from the direction given by facing"
        yield Quantity("orientation_end", label, "rad", "orientation_end", told)
        for number, make in enumerate(result.get("makes", [])):
            yield Quantity(
                f"makes.{number}.velocity", f"velocity of walkers with radii {radii_text(make['radii'])} mm", "m/s"
            )
        yield Quantity("walkers", "walkers", column="walkers", meaning="number of walkers")
        label = f"steady walkers: both halves agree within {percent(STEADY_DIFFERENCE)}"
        yield Quantity("steady", label, column="steady", meaning=f"number of {label}")
        told = "number of walkers that turned by more than 90° since their start"
        yield Quantity("turned_round", "walkers that turned by more than 90°", column="turned_round", meaning=told)
        told = "on a slope: number of walkers that end within 15° of the direction of facing and do not tilt further"
        yield Quantity("posture.upright", "walkers that are upright", column="upright", meaning=told)
        yield from (Quantity(f"posture.{one}", f"walkers that are {one}") for one in POSTURES[1:])
        yield from (Quantity(f"posture.{way}", f"walkers that {words[1]}") for way, words in _WAYS.items())
        yield Quantity("cycles", "cycles driven", column="cycles", meaning="cycles of the drive, including settling")
        yield Quantity("settling_cycles", "settling cycles")
        told = f"whether the run ended early, with all velocities constant within {percent(CONSTANT)}"
        yield Quantity("ended_early", column="ended_early", meaning=told)
        yield Quantity("walkers_met", column="walkers_met", meaning="whether two walkers came close to each other")
        yield Quantity("gamma0", "dimensionless peak force Γ0")
        yield Quantity("sin_delta", "asymmetry sin δ")

    def lines(self, result: Mapping[str, Any]) -> list[str]:
        """Velocities, rotation, sliding and orientation of all walkers, and velocities of each make."""
        end, names, open_ones = result["orientation_end"], result["contacts"], result["open"]
        drive, told = result["drive"], bool(_band(result))  # the band, by the headline
        if None not in (result["gamma0"], result["sin_delta"]):
            drive += f", Γ0 = {result['gamma0']:.3g}, sin δ = {result['sin_delta']:.3g}"
        beads = ", ".join(f"bead {place} {_speed(one)}" for place, one in enumerate(result["rotation"].values(), 1))
        sliding = ", ".join(f"{name} {_speed(result['sliding'][contact])}" for contact, name in names.items())
        some = result["goes_uphill"] and 0 < result["right_facing"]["n"] < result["walkers"]
        these = "started facing up: " if some else ""
        lines = [
            *_of_walkers(result, drive),
            *wrapped(self.uncertainty(result)[told:]),
            *_of_sides(result),
            f"  rotation   {these}{beads} mm/s",
            f"  sliding    {these}{sliding} mm/s",
        ]
        if not result["meet"]:  # on trays each from its own direction: the figure and the orders say more
            angles = f"{_angle(end['smallest'])}° to {_angle(end['largest'])}°"
            lines.append(f"  orientation at the end {angles} from the direction of facing")
        if any(open_ones.values()):
            shares = ", ".join(f"{name} {100 * open_ones[contact]:.1f} %" for contact, name in names.items())
            lines.append(f"  contacts open: {shares} of the time, in steps of {percent(result['open_resolution'])}")
        return lines + [
            f"  of {radii_text(one['radii'])} mm  {_speed(one['velocity']['mean'])} mm/s; {_steady(one)}"
            for one in result.get("makes", [])
        ]

    def uncertainty(self, result: Mapping[str, Any]) -> list[str]:
        """Uncertainty of the velocity: unmeasured values, numerical error, and scatter of the copies."""
        known = super().uncertainty(result)
        if came_apart(result):
            return known
        if fell(result):
            told = bands_text(result, {"axial_velocity": "m/s"}, {"axial_velocity": result["axial_velocity"]["mean"]})
            return [*([told] if told else not_known(result["rests_on"])), *_numerical(result, "axial_velocity")]
        if result.get("bands") and (apart := sides_apart(result)):
            told = bands_text(result, {"right_facing": "m/s"}, {"right_facing": next(iter(apart.values()))})
            known = [told or "no band: the spread has that of the mean over both ways, which is no walker's velocity"]
        return [*known, *_numerical(result), *_scatter(result)]

    def warnings(self, result: Mapping[str, Any]) -> list[str]:
        """Reasons to doubt the velocity."""
        warnings = []
        if (lacking := result["walkers"] - result["steady"]) and not result["meet"]:  # on trays walkers stop
            told = f"{lacking} of {result['walkers']} walkers {'is' if lacking == 1 else 'are'} not steady"
            warnings.append(f"{told}: the velocity depends on the length of the run")
        if result["depends_on_start"]:
            warnings.append(f"steady copies differ by more than {percent(SAME)}: the velocity depends on the start")
        if result["walkers_met"] and not result["meet"]:
            warnings.append("walkers came close to each other and are not independent: increase the spacing")
        return warnings


def _stacked(parts: list[Columns]) -> Columns:
    """Concatenated tables; missing columns are NaN."""
    lengths = [len(part["walker"]) for part in parts]
    keys = dict.fromkeys(key for part in parts for key in part)
    return {
        key: np.concatenate([part.get(key, np.full(rows, nan)) for part, rows in zip(parts, lengths, strict=True)])
        for key in keys
    }


def _trajectory(group: Group, motion: Gait) -> Columns:
    """Rows of one walker after the other."""

    def along(values: FloatArray) -> FloatArray:
        return np.moveaxis(values, 0, 1).reshape(-1, *values.shape[2:])

    time = np.tile(group.time, len(group.walkers))
    return {
        "walker": np.repeat([walker.walker for walker in group.walkers], len(group.time)),
        "time": time,
        "cycle": time * group.case.excitation.frequency,
        **dict(zip("xyz", along(group.mass_centre).T, strict=True)),
        "orientation": along(group.orientation),
        "velocity": along(motion.velocity),
        **numbered("rotation", along(motion.rotation)),
        **_by_kind(group, sliding=along(motion.sliding), gap=along(motion.gap)),
    }


def _by_kind(group: Group, **contacts: FloatArray) -> Columns:
    """Columns of values at contacts (`Gait`): of beads with walls, and ``…_pair_…`` of pairs of beads."""
    beads = len(group.radii)
    columns: Columns = {}
    for name, values in contacts.items():
        columns |= numbered(name, values[..., :beads]) | numbered(f"{name}_pair", values[..., beads:])
    return columns


def _rows(group: Group, motion: Gait) -> Columns:
    """Rows of the walkers of a group."""
    samples, beads, mean = settled_samples(group), len(group.radii), averages(group)
    reach = np.array([load.rupture for load in contact_loads(group.case, group.make)[beads:]])
    starts = ("walker", "make", "facing", "start_angle")
    return {
        **{name: np.array([getattr(walker, name) for walker in group.walkers]) for name in starts},
        **vars(walk(group)),
        "orientation_mean": group.orientation[samples].mean(axis=0),
        "orientation_end": group.orientation[-1],
        "turned_at": turned_over_at(group),
        "separated_fraction": (motion.gap[samples, :, beads:] > reach).any(axis=-1).mean(axis=0),
        **numbered("rotation", mean.rotation),
        **_by_kind(group, sliding=mean.sliding, open=mean.open),
    }


def _bridges(motion: Motion) -> Columns:
    """Rows sorted by time, walker and contact."""
    contact_of: dict[tuple[int, int], int] = {}  # by two beads, or by a bead and −1 for a wall
    for walker in motion.walkers:
        touching = [(bead, -1) for bead in walker.beads]
        touching += [(walker.beads[one], walker.beads[other]) for one, other in motion.case.walkers[walker.make].pairs]
        contact_of |= {ends: number for number, ends in enumerate(touching, 1)}
    parts = [_bridge_rows(motion, bridges, contact_of) for bridges in read_bridges(motion)]
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    order = np.lexsort([columns[name] for name in ("bead_2", "contact", "walker", "time")])
    return {name: values[order] for name, values in columns.items()}


def _bridge_rows(motion: Motion, bridges: Bridges, contact_of: Mapping[tuple[int, int], int]) -> Columns:
    """Rows of a frame: bridges between beads, then bridges to walls."""
    rows = bridges.rows()
    first, second = rows["bead_1"], rows["bead_2"]
    owner = motion.walker_of[first]
    joined = np.where(second >= 0, motion.walker_of[second], owner)
    ends = zip(first.tolist(), second.tolist(), strict=True)
    return {
        "time": np.full(len(first), motion.time[bridges.frame]),
        "walker": owner,
        "contact": np.array([contact_of.get(one, 0) for one in ends], dtype=np.int64),
        "other_walker": np.where(joined == owner, -1, joined),
        **rows,
    }


def spread(values: FloatArray) -> dict[str, Any]:
    """Mean, extremes and scatter (standard deviation) over copies; no scatter for a single one."""
    count = len(values)
    if count == 0:
        return {"n": 0, "mean": None, "smallest": None, "largest": None, "scatter": None}
    return {
        "n": count,
        "mean": float(values.mean()),
        "smallest": float(values.min()),
        "largest": float(values.max()),
        "scatter": float(np.std(values, ddof=1)) if count > 1 else None,
    }


def _mean(values: FloatArray) -> float | None:
    """Mean of the finite values."""
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else None


def _summary(walkers: Columns, case: Case) -> dict[str, Any]:
    """Result of rows of the table of walkers."""
    velocity, axial = walkers["velocity"], walkers["axial_velocity"]
    facing = sides(walkers["facing"], walkers["start_angle"])
    turned, same = np.isfinite(walkers["turned_at"]), alike(facing, uphill=case.goes_uphill)

    def means(family: str) -> dict[str, float | None]:
        """By the names of beads and pairs."""
        kinds = {family: "bead", f"{family}_pair": "pair"}
        split = [(name, *name.rpartition("_")[::2]) for name in walkers]
        return {f"{kinds[kind]}_{number}": _mean(walkers[name][same]) for name, kind, number in split if kind in kinds}

    return {
        "velocity": spread(velocity[same]),
        "right_facing": spread(velocity[facing > 0]),
        "left_facing": spread(velocity[facing < 0]),
        "axial_velocity": {
            "mean": _mean(axial[alike(facing, uphill=case.goes_uphill or not case.meets)]),
            "right_facing": _mean(axial[facing > 0]),
            "left_facing": _mean(axial[facing < 0]),
        },
        "lateral_velocity": {"mean": _mean(walkers["lateral_velocity"])},
        **{family: means(family) for family in ("rotation", "sliding", "open")},
        "separated_fraction": _mean(walkers["separated_fraction"]),
        "orientation_end": spread(walkers["orientation_end"]),
        "steady": int(np.sum(walkers["steady"])),
        "depends_on_start": _depends_on_start(walkers, facing, case),
        "turned_round": int(np.sum(turned)),
        "walkers": len(velocity),
    }


def _depends_on_start(walkers: Columns, facing: IntArray, case: Case) -> bool:
    """Whether steady walkers of one make differ; both directions are one if boundary and drive are symmetric."""
    drive = case.excitation.harmonics
    symmetric = not case.boundary.tilt and len(drive) == 1 and abs(drive[0].direction[2]) in (0.0, 1.0)
    kept = walkers["steady"] & np.isnan(walkers["turned_at"]) & (walkers["separated_fraction"] < SEPARATED)
    kind = 2 * walkers["make"] + (0 if symmetric else facing > 0)
    alike = (walkers["velocity"][kept & (kind == one)] for one in set(kind[kept].tolist()))
    return not case.meets and any(differ(float(one.min()), float(one.max())) for one in alike)


def _posture(groups: Iterable[Group], walkers: Columns) -> dict[str, Any]:
    """Numbers of walkers by posture and way, times of turning over (s), largest final angle of the others (rad)."""
    counts = Counter(posture for group in groups for posture in postures(group))
    turned_at, end = walkers["turned_at"], np.abs(walkers["orientation_end"])
    uphill = walkers["axial_velocity"]
    over, kept = turned_at[np.isfinite(turned_at)], end[np.isnan(turned_at)]
    return {
        **{name: counts[name] for name in POSTURES},
        "climb": int(np.sum(uphill > REST)),
        "down": int(np.sum(uphill < -REST)),
        "turned_at": [float(over.min()), float(over.max())] if len(over) else None,
        "ends_within": float(kept.max()) if len(kept) else None,
    }


def _contact_names(group: Group) -> dict[str, str]:
    pairs = group.make.pairs
    names = ["bead on bead"] if len(pairs) == 1 else [f"beads {one + 1}-{other + 1}" for one, other in pairs]
    beads = {f"bead_{number}": f"bead {number}" for number in range(1, len(group.radii) + 1)}
    return beads | {f"pair_{number}": name for number, name in enumerate(names, 1)}


def walkers_met(groups: Iterable[Group]) -> bool:
    """Whether two walkers came so close that they are not independent."""
    groups = list(groups)
    centre = np.concatenate([one.mass_centre[:: one.case.run.samples_per_cycle, :, :2] for one in groups], axis=1)
    return came_near(centre, NEAR * max(one.make.length for one in groups))


def _toward(result: Mapping[str, Any]) -> str:
    """The positive direction of velocities along the heading, as text; without a result, that of all walkers."""
    if not result:
        return "from small to large beads, of equal ones from the last to the first"
    return {0.0: "toward bead 1", None: "along the heading"}.get(result.get("sin_delta", nan), "toward the large bead")


def _of_walkers(result: Mapping[str, Any], drive: str) -> list[str]:
    """Drive and velocity."""
    velocity, toward = result["velocity"], _toward(result)
    headline = f"{_speed(velocity['mean'])} mm/s{_band(result)}, positive {toward}"
    headline += "; mean of all, slow ones too" if result["meet"] else ""
    if velocity["n"] and abs(velocity["mean"]) < REST:
        headline = f"at rest (below {1e3 * REST:g} mm/s){_band(result)}"
    # On slopes velocities are positive up; where the directions differ, no walker has the mean velocity.
    apart, uphill = sides_apart(result), list(uphill_velocities(result).values())
    if apart or max(map(abs, uphill), default=0.0) >= REST:
        toward, speeds = ("up the slope", uphill) if uphill else (toward, list(apart.values()))
        named = [f"facing {way} " for way in ways(uphill=result["goes_uphill"])] if len(speeds) > 1 else [""]
        own = [f"{way}{_speed(speed)}" for way, speed in zip(named, speeds, strict=True)]
        own[0] += f" mm/s{band}" if (band := _band(result)) else ""
        headline = f"{', '.join(own)}{' mm/s' if not band or len(own) > 1 else ''}, positive {toward}"
    if result["turned_round"] and not result["posture"]:
        headline += f"; {result['turned_round']} of {result['walkers']} turned by more than 90°"
    headline += "; depends on the start" if result["depends_on_start"] else ""
    if told := came_apart(result):
        headline = f"none: walkers {told}"
    return [*_headlines(result, drive), f"  velocity   {headline}"]


def _of_sides(result: Mapping[str, Any]) -> list[str]:
    """Velocities by direction at the start, and number of walkers that are steady; nothing if they came apart."""
    if came_apart(result):
        return []
    first, second = ways(uphill=result["goes_uphill"])
    right, left = (
        f"{_speed(side['mean'])} mm/s ({side['n']})" if side["n"] else "none"
        for side in (result["right_facing"], result["left_facing"])
    )
    told = "" if result["meet"] or result["posture"] else f"started facing {first} {right}, {second} {left}; "
    return wrapped([told + _steady(result)])


def _band(result: Mapping[str, Any]) -> str:
    """Band of the velocity from a spread; if the directions differ, that of walkers facing right or up."""
    name = "right_facing" if sides_apart(result) else "velocity"
    band = band_of(result, name, result[name]["mean"])
    if band is None or fell(result):
        return ""
    points, values = result["bands"][name]["points"], sum(one["range"] is not None for one in result["rests_on"])
    draws = f" of {points} draws" if points < LEAST_PER_VALUE * values else ""
    return f" ({band_text(band, 'm/s')}, 5 to 95 %{draws} over the uncertain values)"


def _numerical(result: Mapping[str, Any], name: str = "velocity") -> list[str]:
    """Numerical error of a velocity; on slopes ``velocity`` is that of the walkers that started facing up."""
    own = result[name]["mean"]
    return [] if own is None or result.get("by_hand") else [accuracy_text(result, name, own)]


def _scatter(result: Mapping[str, Any]) -> list[str]:
    """Scatter of several copies."""
    velocity, count = result["velocity"], result["velocity"]["n"]
    if result["walkers"] < 2:
        return []
    what = "walkers" if result["meet"] or "makes" in result else "copies"
    some = result["goes_uphill"] and count < result["walkers"]
    if some or sides_apart(result):  # the difference of the directions is not scatter
        sides = zip(ways(uphill=result["goes_uphill"]), (result["right_facing"], result["left_facing"]), strict=True)
        each = [
            f"the {side['n']} {what} facing {way} {_error(side['scatter'])}"
            for way, side in sides
            if side["scatter"] is not None
        ]
        return [f"scatter of {', of '.join(each)} (standard deviation)"] if each else []
    low, high = _speed(velocity["smallest"]), _speed(velocity["largest"])
    ends = "" if low == high else f"; {low} to {high} mm/s"
    return [f"scatter of the {count} {what} {_error(velocity['scatter'])} (standard deviation{ends})"]


def _headlines(result: Mapping[str, Any], drive: str) -> list[str]:
    """The drive; before it, on a slope, the posture of the walkers; after it what is true of a tray."""
    speed, *end = of_tray(result) or [""]
    tray = [f"  tray       {speed}; at the end {', '.join(end)}"] if end else []
    if result["posture"] is None:
        return [f"{result['case']}: {drive}", *tray]
    first = "; ".join([*_told_ways(result), _told_posture(result)])
    return [f"{result['case']}: {first}", f"  drive      {drive}", *tray]


def _told_ways(result: Mapping[str, Any]) -> list[str]:
    """Numbers of walkers by their way on a slope: "all 6 go down", or "3 climb, 3 rest"."""
    count, numbers = result["walkers"], [result["posture"][way] for way in _WAYS]
    told = zip([*numbers, count - sum(numbers)], [*_WAYS.values(), ("rests", "rest")], strict=True)
    said = [f"{'all ' * (1 < number == count)}{number} {words[number > 1]}" for number, words in told if number]
    return [] if came_apart(result) else [", ".join(said)]


def _told_posture(result: Mapping[str, Any]) -> str:
    """Postures as text: "upright to the end, within 0.1°"; walkers that face down keep their heading."""
    summary = result["posture"]
    count = sum(summary[name] for name in POSTURES)
    within = "" if summary["ends_within"] is None else f", within {max(degrees(summary['ends_within']), 0.1):.1f}°"
    first, last = (f"{time:.2f}" for time in summary["turned_at"] or (nan, nan))
    when = f" after {first} s" if first == last else f" after {first} to {last} s"
    told = {
        "upright": f"{'kept the heading' if result['left_facing']['n'] else 'upright'} to the end",
        "leaning": "leaning at the end",
        "turned over": f"turned over{when if summary['turned_at'] else ''}",
    }
    there = [name for name in POSTURES if summary[name]]
    last_kept = [name for name in there if name != "turned over"][-1:]
    return "; ".join(
        ("" if summary[name] == count else f"{summary[name]} of {count} ")
        + told[name]
        + (within if name in last_kept else "")
        for name in there
    )


def _steady(result: Mapping[str, Any]) -> str:
    """Number of steady walkers and reason for an early end of the run, with criteria."""
    told = f"{result['steady']} of {result['walkers']} steady (both halves agree within {percent(STEADY_DIFFERENCE)})"
    if result.get("ended_early"):
        told += f"; ended after {result['cycles']} cycles (constant within {percent(CONSTANT)})"
    return told


def _speed(value: float | None) -> str:
    """A speed (m/s) as text in mm/s."""
    return "-" if value is None else with_decimals(value * 1e3, 3)


def _error(value: float) -> str:
    """An error of a speed (m/s) as text in mm/s."""
    return f"{told} mm/s" if (told := _speed(value)) != "0" else "below 0.001 mm/s"


def _angle(value: float | None) -> str:
    """An angle (rad) as text in degrees."""
    return "-" if value is None else with_decimals(degrees(value), 2)
