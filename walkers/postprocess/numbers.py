"""Numbers of results: name, unit, label and meaning of each, once; and as rows of text.

The printed result, reports, notebooks and columns of sweeps follow from these declarations.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import chain
from math import isfinite, nan
from typing import TYPE_CHECKING, Any

from walkers.postprocess.quantities import Q, Quantity
from walkers.postprocess.quantities import declared as declared_in
from walkers.rounding import rounded, with_decimals

if TYPE_CHECKING:
    from walkers.postprocess.tables import Columns

STEADY_DIFFERENCE = 0.05
"""A walker is steady if the velocities of the two halves of the measured cycles differ by less than this share, or by
a hundredth of a millimetre per second."""


@dataclass(frozen=True)
class Measured:
    """What a module measures of a run: tables, numbers (SI units, by the names of `NUMBERS`), reasons to doubt them.

    A number that is not defined is None or NaN.
    """

    tables: Mapping[str, Columns]
    numbers: Mapping[str, Any]
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Row:
    """A number of a result as text: label, value, its displayed unit, and its errors in this unit."""

    name: str
    label: str
    text: str
    unit: str
    error: str = ""


_DRIVE = (
    Q("frequency", "Hz", "frequency", "frequency of the drive"),
    Q("peak_acceleration", "m/s^2", "peak acceleration", "peak acceleration of the boundary"),
    Q("peak_velocity", "m/s", "peak velocity", "peak velocity of the boundary"),
    Q("amplitude", "m", "amplitude", "amplitude of the boundary's displacement"),
    Q("goes_uphill", "", "uphill", "whether the drive axis goes up a slope"),
    Q("truncated", "", "truncated", "whether the dump ends within a frame"),
)
_UP = "on a slope of those that started facing up"
_WALL, _PAIR = "a bead and its wall", "a pair of beads that touch at the start"
_OPEN = "share of the time, in steps of a tenth of a sample, without contact of"
_WALKING = (
    Q(
        "velocity",
        "m/s",
        "velocity",
        f"mean velocity of the walkers along the heading, {_UP}; positive from small to large beads, of equal ones "
        "from the last to the first",
        "scatter",
    ),
    Q(
        "scatter",
        "m/s",
        "scatter of the velocity",
        "standard deviation of the velocities of the copies; not an error of the mean",
    ),
    Q("smallest", "m/s", "smallest velocity", "velocity of the slowest walker"),
    Q(
        "largest",
        "m/s",
        "largest velocity",
        "velocity of the fastest walker; the error bars of the paper are largest minus smallest",
    ),
    Q(
        "right_facing",
        "m/s",
        "velocity, facing right (up)",
        "mean velocity along the heading of the walkers that started facing right; on a slope up",
        "right_scatter",
    ),
    Q(
        "left_facing",
        "m/s",
        "velocity, facing left (down)",
        "mean velocity along the heading of the walkers that started facing left; on a slope down",
        "left_scatter",
    ),
    Q("right_scatter", "m/s", "scatter, facing right (up)", "standard deviation over these walkers"),
    Q("left_scatter", "m/s", "scatter, facing left (down)", "standard deviation over these walkers"),
    Q(
        "axial_velocity",
        "m/s",
        "velocity along the drive axis",
        "mean velocity along the drive axis (uphill) of the walkers that started facing right (on a slope, up)",
    ),
    Q(
        "axial_left_facing",
        "m/s",
        "velocity along the drive axis, facing left (down)",
        "mean velocity along the drive axis (uphill) of the walkers that started facing left (on a slope, down)",
    ),
    Q("lateral_velocity", "m/s", "velocity across the drive axis", "mean velocity across the drive axis"),
    Q("velocity_make_*", "m/s", "velocity of make *", "mean velocity of a make (body of the case)"),
    Q("rotation_*", "m/s", "rotation of bead *", f"rotation velocity −R dφ/dt of a bead, {_UP}"),
    Q("sliding_*", "m/s", "sliding of bead *", f"sliding velocity of {_WALL}, {_UP}"),
    Q("sliding_pair_*", "m/s", "sliding of pair *", f"sliding velocity of {_PAIR}, {_UP}"),
    Q("open_*", "share", "bead * off its wall", f"{_OPEN} {_WALL}, {_UP}"),
    Q("open_pair_*", "share", "pair * open", f"{_OPEN} {_PAIR}, {_UP}"),
    Q(
        "work",
        "J",
        "work of the drive per cycle",
        f"work of the drive (of the inertial force in the frame of the walls) on a walker per cycle, mean, {_UP}",
    ),
    Q(
        "cost_of_transport",
        "",
        "cost of transport",
        f"power of the drive, without that of gravity, over weight times walking speed, mean, {_UP}",
    ),
    Q(
        "separated_fraction",
        "share",
        "beads apart",
        "share of the samples in which two beads are farther apart than the rupture distance of a bridge",
    ),
    Q(
        "orientation_end",
        "rad",
        "orientation at the end",
        "mean orientation at the end of the run, from the direction given by facing",
    ),
    Q("orientation_smallest", "rad", "smallest orientation at the end", "of the walker with the smallest"),
    Q("orientation_largest", "rad", "largest orientation at the end", "of the walker with the largest"),
    Q("walkers", "", "walkers", "number of walkers"),
    Q("facing_right", "", "walkers facing right (up)", "number of walkers that start facing right, up"),
    Q("facing_left", "", "walkers facing left (down)", "number of walkers that start facing left, down"),
    Q("walkers_make_*", "", "walkers of make *", "number of walkers of a make"),
    Q(
        "steady",
        "",
        "steady walkers",
        f"number of walkers whose velocities in both halves agree within {100.0 * STEADY_DIFFERENCE:g} %",
    ),
    Q("steady_make_*", "", "steady walkers of make *", "number of steady walkers of a make"),
    Q(
        "turned_round",
        "",
        "walkers that turned round",
        "number of walkers that turned by more than 90° since their start",
    ),
    Q(
        "upright",
        "",
        "upright walkers",
        "on a slope: number of walkers that end within 15° of the direction of facing and do not tilt further",
    ),
    Q("leaning", "", "leaning walkers", "on a slope: number of walkers neither turned over nor upright"),
    Q(
        "turned_over",
        "",
        "walkers that turned over",
        "on a slope: number of walkers that turned by more than 90° since their start",
    ),
    Q("climbing", "", "walkers that climb", "on a slope: number of walkers that go up"),
    Q("descending", "", "walkers that go down", "on a slope: number of walkers that go down"),
    Q("turned_first", "s", "first turning over", "on a slope: time at which the first walker turned over"),
    Q("turned_last", "s", "last turning over", "on a slope: time at which the last walker turned over"),
    Q(
        "ends_within",
        "rad",
        "largest orientation at the end",
        "on a slope: largest angle from the direction of facing at the end, of walkers that did not turn over",
    ),
    Q("cycles", "", "cycles driven", "cycles of the drive, including settling"),
    Q("settling_cycles", "", "settling cycles", "cycles that are not measured"),
    Q(
        "ended_early",
        "",
        "ended early",
        "whether the run ended early, with all velocities constant within 0.2 %",
    ),
    Q("walkers_met", "", "walkers met", "whether two walkers came close to each other"),
    Q("meets", "", "may meet", "whether the walkers may meet"),
    Q("came_apart", "", "came apart", "whether beads of walkers are apart for more than a tenth of the time"),
    Q(
        "facings_differ",
        "",
        "directions differ",
        "whether the mean velocities of walkers facing right (up) and left (down) differ by more than 5 %",
    ),
    Q("depends_on_start", "", "depends on the start", "whether steady copies differ by more than 5 %"),
    Q("gamma0", "", "Γ0", "dimensionless peak force Γ0 = a0 M/(4πγR̄) of dimers"),
    Q("sin_delta", "", "sin δ", "asymmetry parameter (R1 - R2)/(R1 + R2) of dimers"),
    Q("mass_asymmetry", "", "μ", "mass asymmetry μ = (m1 - m2)/M of dimers"),
    Q("radius_1", "m", "R1", "radius of bead 1"),
    Q("radius_2", "m", "R2", "radius of bead 2"),
    Q("numerical_error", "m/s", "numerical error", "numerical error of the main velocity, of time step and stiffness"),
)
_MEETINGS = (
    Q("merged", "", "meetings", "number of events in which two walkers merge"),
    Q("parted", "", "partings", "number of events in which two walkers separate"),
    Q("largest_group", "", "largest group", "largest number of walkers joined by bridges at any time"),
    Q("meeting_rate", "1/s", "meeting rate", "number of meetings of a walker per second"),
    Q("clustered_share", "share", "walkers in clusters", "share of walkers joined to others in the last frame"),
    Q(
        "largest_cluster",
        "",
        "walkers in the largest cluster",
        "cluster size in the last frame; 1 if none are joined",
    ),
    Q(
        "held_share",
        "share",
        "walkers held by side walls",
        "share of walkers joined to a side wall in the last frame, directly or through others",
    ),
    Q(
        "nematic_order",
        "",
        "nematic order along the drive axis",
        "mean of cos 2θ over all walkers and the last tenth of the drive, θ: angle from the drive axis to the heading; "
        "1 if all are along the axis, 0 if random, -1 if all are across it",
    ),
    Q(
        "polar_order",
        "",
        "polar order",
        "length of the mean heading vector of all walkers, averaged over the last tenth of the drive: 1 if all "
        "headings are equal, 0.89/√N for N random headings",
    ),
    Q(
        "free_speed",
        "m/s",
        "speed of free walkers",
        "mean speed from cycle to cycle, settling included, of walkers that are not joined to a walker or a side wall",
    ),
    Q(
        "joined_speed",
        "m/s",
        "speed of joined walkers",
        "mean speed, from cycle to cycle, of walkers in clusters that are not joined to a side wall",
    ),
    Q("speed_ratio", "", "speed of joined walkers over speed of free walkers", "joined_speed over free_speed"),
    Q(
        "slow_share",
        "share",
        "slow walkers at the end",
        "share of walkers whose net speed over the last tenth of the drive is below a tenth of free_speed",
    ),
    Q(
        "coverage",
        "",
        "coverage",
        "projected area of the beads over the floor area of the container; on an open substrate, over the area of "
        "the squares on which the walkers start",
    ),
)
EVENTS = ("freed", "split", "merged", "rejoined", "detached")
_PILES = (
    Q("climbs", "", "climbs", "number of climbs"),
    Q("onset", "s", "start of the first climb", "start of the first climb"),
    Q("speed", "m/s", "mean speed of the climbs", "mean speed of the climbs"),
    Q("highest", "m", "height of the highest climb", "largest height of a climb"),
    Q("led_by_large", "", "climbs led by a large bead", "number of climbs led by a large bead"),
    Q(
        "clusters",
        "",
        "clusters free of the pile and held by a wall",
        "number of clusters that are free of the pile and held by a wall",
    ),
    *(Q(f"events_{one}", "", f"clusters {one}", f"number of events: {one}") for one in EVENTS),
    Q("beads", "", "beads", "number of beads"),
    Q("large", "", "large beads", "number of large beads"),
    Q("driven", "s", "time of shaking", "time of shaking"),
    Q("duration", "s", "duration of the drive", "duration of the drive"),
    Q("settling", "s", "settling time", "settling time before the drive"),
    Q("surface_start", "m", "surface at the start", "height of the pile's surface at the start"),
    Q("surface_end", "m", "surface at the end", "height of the pile's surface at the end"),
    Q("brazil_nut_start", "", "Brazil-nut index at the start", "Brazil-nut index at the start"),
    Q("brazil_nut_end", "", "Brazil-nut index at the end", "Brazil-nut index at the end"),
    Q("contacts_at_rest", "", "contacts per bead, at rest", "contacts per bead, at rest"),
    Q("bridges_at_rest", "", "bridges per bead, at rest", "bridges per bead, at rest"),
    Q("contacts_shaken", "", "contacts per bead, while shaken", "contacts per bead, while shaken"),
    Q("bridges_shaken", "", "bridges per bead, while shaken", "bridges per bead, while shaken"),
)
GROUPS: Mapping[str, tuple[Quantity, ...]] = {
    "walking": _WALKING,
    "meetings": _MEETINGS,
    "piles": _PILES,
    "drive": _DRIVE,
}
"""Numbers of the results of each module of `walkers.postprocess.results`, and of all."""
NUMBERS: Mapping[str, Quantity] = {one.name: one for one in chain(*GROUPS.values())}
MAIN = ("velocity", "right_facing", "axial_velocity", "climbs", "highest", "speed")
"""Main numbers, of which a spread measures bands."""
_BAND = {"low": "5 %", "high": "95 %"}
_ENDS = {name: f"{share} of the draws over the ranges of uncertain values" for name, share in _BAND.items()}
_ENDS |= {"error": "numerical error, of time step and stiffness"}
"""Ends of names: of bands, and of numerical errors."""
_HIDDEN = frozenset(
    {
        *("scatter", "smallest", "largest", "right_scatter", "left_scatter", "axial_velocity", "axial_left_facing"),
        *("facing_right", "facing_left", "walkers_met", "meets", "came_apart", "facings_differ", "depends_on_start"),
        *("mass_asymmetry", "radius_1", "radius_2", "numerical_error", "goes_uphill"),
        *("orientation_smallest", "orientation_largest", "turned_first", "turned_last", "ended_early", "duration"),
        *("gamma0", "sin_delta"),
        *(one.name for one in _DRIVE),
    }
)
"""Numbers that rows leave out: errors of others, values of the case, and what the headline says."""
_IF_ANY = (
    "events_*",
    "open_*",
    "open_pair_*",
    "separated_fraction",
    "turned_round",
    "leaning",
    "turned_over",
    "upright",
)
"""Numbers that rows leave out if they are zero."""


def declared(name: str) -> Quantity:
    """The quantity of a number; ``velocity_low`` is an end of the band of ``velocity``. `KeyError` if there is none."""
    with suppress(KeyError):
        return declared_in(name, NUMBERS.values())
    stem, _, end = name.rpartition("_")
    whole = declared_in(stem, NUMBERS.values() if end in _ENDS else ())
    label = f"{whole.label}, {_BAND.get(end, 'numerical error')}"
    return replace(whole, name=name, label=label, meaning=f"{_ENDS[end]}: {whole.meaning}", error="")


def is_declared(name: str) -> bool:
    """Whether a name is that of a number of a result."""
    with suppress(KeyError):
        return bool(declared(name))
    return False


def ordered(names: Iterable[str]) -> list[str]:
    """Names of numbers in the order of their declarations; both ends of a band follow the number."""
    places = {name: place for place, name in enumerate(NUMBERS)}

    def place_of(name: str) -> tuple[int, str, int]:
        stem, _, end = name.rpartition("_")
        bare, further = (stem, [*_ENDS].index(end) + 1) if end in _ENDS and name not in places else (name, 0)
        return places.get(bare, places.get(f"{bare.rpartition('_')[0]}_*", -1)), bare, further

    return sorted(names, key=place_of)


def headline(numbers: Mapping[str, Any]) -> str:
    """Name of the main number of a result: climbs of piles, or a velocity that walkers have.

    On a slope the velocity up the slope if some walkers do not stay upright; the velocity of those that face right (up)
    if it differs from that of the others. Empty without walkers and piles.
    """
    if "velocity" not in numbers:
        return "climbs" if "climbs" in numbers else ""
    if fell(numbers):
        return "axial_velocity"
    return "right_facing" if numbers["facings_differ"] else "velocity"


def fell(numbers: Mapping[str, Any]) -> bool:
    """Whether walkers turned over or lean on a slope: then a velocity along the heading says little about their way."""
    return bool("upright" in numbers and (numbers["turned_round"] or numbers["upright"] < numbers["walkers"]))


def rows(numbers: Mapping[str, Any]) -> list[Row]:
    """The numbers of a result as text, in displayed units, in the order of their declarations.

    Velocities of walkers that came apart are left out, as is the mean of two directions that differ.
    """
    main, hidden = headline(numbers), set(_HIDDEN)
    if main == "axial_velocity" or (main == "right_facing" and numbers["goes_uphill"]):
        hidden -= {"axial_velocity", "axial_left_facing"}
    if main != "velocity":
        hidden.add("velocity")
    if numbers.get("came_apart"):
        hidden |= {"velocity", "right_facing", "left_facing", "lateral_velocity", "axial_velocity", "axial_left_facing"}
    listed = []
    for name in ordered(numbers):
        number = numbers[name]
        if isinstance(number, (bool, str)) or not isfinite(number) or name.rpartition("_")[2] in _ENDS:
            continue
        one = declared(name)
        starred = next((key for key in _IF_ANY if key == name or (key.endswith("*") and name.startswith(key[:-1]))), "")
        if name not in hidden and (number or not starred):
            text, unit = shown(number, one.unit)
            listed.append(Row(name, one.label, text, unit, _errors(numbers, one)))
    return listed


def shown(number: float, unit: str) -> tuple[str, str]:
    """A number (SI) as text in the displayed unit, and this unit; velocities have all decimals."""
    usual, factor = Q("", unit, "", "").shown
    value = number if factor == 1.0 else number * factor
    return (with_decimals(value, 3) if usual == "mm/s" else rounded(value, usual)), usual


def _errors(numbers: Mapping[str, Any], one: Quantity) -> str:
    """Scatter, band and numerical error of a number in its displayed unit."""
    parts = []
    if isfinite(scatter := numbers.get(one.error, nan)):
        text = shown(scatter, one.unit)[0]
        parts.append(f"scatter {'below 0.001' if text == '0' and one.unit == 'm/s' else text}")
    low, high = (numbers.get(f"{one.name}_{end}") for end in _BAND)
    if low is not None and high is not None:
        parts.append(f"band {band_text(low, high, one.unit)}")
    if isfinite(error := numbers.get(f"{one.name}_error", nan)):
        text = shown(float(f"{error:.2g}"), one.unit)[0]
        parts.append(f"numerical error {'below 0.001' if text == '0' else text}")
    return ", ".join(parts)


def band_text(low: float, high: float, unit: str) -> str:
    """Both ends of a band in the displayed unit, with three digits, without the unit: ``0.489 to 5.83``."""
    usual, factor = Q("", unit, "", "").shown
    return " to ".join(rounded(float(f"{end * factor:.3g}"), usual) for end in (low, high))
