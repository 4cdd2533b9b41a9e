"""What runs give: name, unit, label and meaning of each column of a table and of each number of a result, once.

Files, axes, reports, printed results, columns of sweeps and the reference take them from here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from walkers.rounding import SHOWN_UNITS


@dataclass(frozen=True)
class Quantity:
    """A column or a number.

    Attributes
    ----------
    name
        Its name; one that ends in ``_*`` has one per bead or contact: ``rotation_1``, ``rotation_2``, …
    unit
        SI unit; ``share`` for a number that is shown in per cent.
    label
        Label of axes and rows, without the unit; ``*`` is the number of the bead or contact.
    meaning
        Definition, for the reference and the files.
    error
        Name of the number that is its error or scatter, if there is one.
    """

    name: str
    unit: str
    label: str
    meaning: str
    error: str = ""

    def names(self, name: str) -> bool:
        """Whether it is the column or number of this name."""
        number = name.removeprefix(self.name[:-1])
        return name == self.name or (self.name.endswith("_*") and number.isdigit())

    @property
    def si_unit(self) -> str:
        """The unit of the stored number: a share has none."""
        return "" if self.unit == "share" else self.unit

    @property
    def shown(self) -> tuple[str, float]:
        """The displayed unit, and how many of it one SI unit is."""
        return SHOWN_UNITS.get(self.unit, (self.unit, 1.0))


Q = Quantity
TIME = Q("time", "s", "time", "time since the start of the drive")
WALKER = Q("walker", "", "walker", "index of the walker, from 0")
BEAD = Q("bead", "", "bead", "index of the bead, from 0")
LARGE = Q("large", "", "large bead", "whether the bead is large")
HEIGHT = Q("height", "m", "height", "height of the bead's centre")
TRACK = Q("track", "", "cluster", "index of the cluster")


def _more(column: Quantity, text: str) -> Quantity:
    """A column whose meaning goes on."""
    return replace(column, meaning=column.meaning + text)


_WALL, _PAIR = "a bead and its wall", "a pair of beads that touch at the start"
_OPEN = "fraction of the time, in steps of a tenth of a sample, without contact of"
ORIENTATION = Q(
    "orientation", "rad", "orientation", "angle by which the walker is turned from the direction given by facing"
)
ROTATION = Q("rotation_*", "m/s", "rotation of bead *", "rotation velocity -R dphi/dt of a bead")
SLIDING = Q("sliding_*", "m/s", "sliding of bead * on its wall", f"sliding velocity of {_WALL}")
SLIDING_PAIR = Q("sliding_pair_*", "m/s", "sliding of pair * of beads", f"sliding velocity of {_PAIR}")
OPEN = Q("open_*", "share", "bead * off its wall", f"{_OPEN} {_WALL}")
OPEN_PAIR = Q("open_pair_*", "share", "pair * of beads open", f"{_OPEN} {_PAIR}")
SEPARATED = Q(
    "separated_fraction",
    "share",
    "beads farther apart than the rupture distance",
    "fraction of the samples in which two beads are farther apart than the rupture distance of a bridge",
)

TABLES: Mapping[str, tuple[Quantity, ...]] = {
    "trajectory": (  # one row per sample and walker
        WALKER,
        TIME,
        Q("cycle", "", "cycle of the drive", "time in cycles of the drive"),
        Q("x", "m", "x", "x of the centre of mass relative to the substrate"),
        Q("y", "m", "y", "y of the centre of mass relative to the substrate"),
        Q("z", "m", "height", "height of the centre of mass above the substrate"),
        ORIENTATION,
        Q(
            "velocity",
            "m/s",
            "velocity along the heading",
            "velocity of the centre of mass relative to the substrate, along the heading (from small to large beads)",
        ),
        ROTATION,
        SLIDING,
        SLIDING_PAIR,
        Q("gap_*", "m", "gap of bead * and its wall", f"gap, negative for overlap, of {_WALL}"),
        Q("gap_pair_*", "m", "gap of pair * of beads", f"gap, negative for overlap, of {_PAIR}"),
    ),
    "walkers": (  # one row per walker; means are over the cycles after the settling ones
        WALKER,
        Q("make", "", "make", "index of the walker's make (body of the case), from 0: dimers, then clusters"),
        Q("facing", "", "facing", "1 or -1: start_angle is from the drive axis (right) or opposite (left)"),
        Q("start_angle", "rad", "angle at the start", "orientation at the start, from the direction given by facing"),
        Q(
            "velocity",
            "m/s",
            "velocity",
            "velocity along the heading after the settling cycles, positive toward the large (foremost) beads",
        ),
        Q("first_half", "m/s", "velocity, first half", "velocity in the first half of the fitted cycles"),
        Q("second_half", "m/s", "velocity, second half", "velocity in the second half of the fitted cycles"),
        Q("steady", "", "steady", "whether first_half and second_half agree within 5 %"),
        Q(
            "axial_velocity",
            "m/s",
            "velocity along the drive axis",
            "velocity of the centre of mass along the drive axis",
        ),
        Q(
            "lateral_velocity",
            "m/s",
            "velocity across the drive axis",
            "velocity of the centre of mass across the drive axis",
        ),
        Q("orientation_mean", "rad", "mean orientation", "mean orientation after the settling cycles"),
        Q(
            "orientation_end",
            "rad",
            "orientation at the end",
            "orientation at the end, from the direction given by facing",
        ),
        Q(
            "turned_at",
            "s",
            "time of turning round",
            "end of the first cycle with the heading more than 90° from that at the start; NaN if none",
        ),
        SEPARATED,
        ROTATION,
        SLIDING,
        SLIDING_PAIR,
        OPEN,
        OPEN_PAIR,
    ),
    "cycles": (  # one row per walker and cycle, at the beginning of the cycle; the last row is the end
        WALKER,
        Q("cycle", "", "cycle of the drive", "cycles of the drive since its start"),
        TIME,
        Q(
            "distance",
            "m",
            "distance along the heading",
            "distance along the heading, which follows a walker that turns",
        ),
        Q(
            "along",
            "m",
            "along the drive axis",
            "displacement of the centre of mass along the drive axis; on a slope uphill",
        ),
        Q(
            "across",
            "m",
            "across the drive axis",
            "displacement of the centre of mass across the drive axis, to the left",
        ),
        ORIENTATION,
        Q(
            "work",
            "J",
            "work of the drive",
            "work of the drive on the walker in this cycle; NaN at the end and below 8 samples per cycle",
        ),
    ),
    "bridges": (  # one row per bridge and frame
        TIME,
        WALKER,
        Q(
            "contact",
            "",
            "contact",
            "index of the contact, from 1: beads with walls, then pairs of beads; 0 for other bridges",
        ),
        Q("bead_1", "", "bead", "index of the bead in the run, from 0"),
        Q("bead_2", "", "other bead", "index of the other bead, -1 for a wall"),
        Q("wall", "", "wall", "index of the wall, 0 for the floor if there is one, -1 for none"),
        Q("other_walker", "", "other walker", "index of the walker at the other end, -1 for none"),
        Q("gap", "m", "gap", "gap, negative for overlap"),
        Q("touching", "", "touching", "whether the surfaces touch"),
        Q(
            "normal_force",
            "N",
            "normal force",
            "net normal force (capillary, viscous, elastic), positive for attraction",
        ),
    ),
    "meetings": (  # one row per event between two walkers that may meet
        TIME,
        Q("event", "", "event", "merged: the first bridge between two walkers forms; parted: the last one breaks"),
        Q("walker", "", "walker", "index of one walker"),
        Q("other", "", "other walker", "index of the other walker"),
        Q("size", "", "walkers in the cluster", "number of walkers in the cluster of `walker` after the event"),
        Q(
            "angle",
            "rad",
            "angle between the headings",
            "angle between the two headings at the event: 0 parallel, pi opposite",
        ),
    ),
    "bed": (  # one row per frame of a pile
        _more(TIME, "; negative while the pile settles"),
        Q(
            "surface",
            "m",
            "height of the surface",
            "height of the bulk surface: median over x-y cells of the top of the highest bead",
        ),
        Q("surface_low", "m", "height of the surface, 10th percentile", "10th percentile of these heights"),
        Q("surface_high", "m", "height of the surface, 90th percentile", "90th percentile of these heights"),
        Q(
            "brazil_nut",
            "",
            "Brazil-nut index",
            "Brazil-nut index (z_large - z_small)/(z_large + z_small) of mean heights",
        ),
        Q("brazil_nut_of_bulk", "", "Brazil-nut index of the bulk", "Brazil-nut index of the beads of the bulk"),
        Q(
            "mean_square_velocity",
            "m^2/s^2",
            "mean square velocity",
            "mean square velocity of the beads relative to the container, at the drive phase of the frame",
        ),
        Q(
            "contacts",
            "",
            "touching beads per bead",
            "touching beads per bead, without walls: twice the number of touching pairs over the number of beads",
        ),
        Q(
            "bridges",
            "",
            "bridges per bead",
            "bridges per bead, without walls: twice the number of bridges between beads over the number of beads",
        ),
        Q("touching", "", "touching pairs", "number of bridges between touching beads"),
        Q("opened", "", "open bridges", "number of open bridges between beads (the beads do not touch)"),
        Q(
            "mean_force",
            "N",
            "mean force of bridges",
            "mean normal force of the bridges between beads, positive for attraction",
        ),
        Q("bulk", "", "beads in the bulk", "number of beads in the bulk"),
        Q("at_wall", "", "beads at side walls", "number of beads with a bridge to a side wall"),
        Q("large_at_wall", "", "large beads at side walls", "number of large beads with a bridge to a side wall"),
        Q("clusters", "", "clusters", "number of clusters free of the bulk and held by a side wall"),
        Q(
            "highest",
            "m",
            "height of the highest cluster",
            "height of the topmost bead of these clusters; height of the surface if there are none",
        ),
    ),
    "clusters": (  # one row per cluster of a pile
        _more(TRACK, ", followed through time"),
        Q("first", "s", "first time", "first time at which the cluster is free of the bulk and held by a side wall"),
        Q("last", "s", "last time", "last time at which the cluster is free of the bulk and held by a side wall"),
        Q("begin", "s", "start of the rise", "start of the largest rise"),
        Q("end", "s", "end of the rise", "end of the largest rise"),
        Q(
            "out_of_pile",
            "",
            "out of the pile",
            "whether most of the cluster's first beads were in the bulk for 0.1 s or longer "
            "after the start of the drive",
        ),
        Q("onset", "s", "onset of the climb", "start of the first rise that counts as a climb; NaN if there is none"),
        Q(
            "qualified",
            "s",
            "time at which the climb counts",
            "time at which this rise reaches the minimum rise of a climb; NaN if there is none",
        ),
        Q("gain", "m", "rise", "largest rise: increase of the mean height of the cluster's beads"),
        Q("speed", "m/s", "speed of the rise", "gain over the duration of the rise", "standard_error"),
        Q(
            "standard_error",
            "m/s",
            "standard error of the speed",
            "standard error of the speed, from ten parts of the rise",
        ),
        Q("climbed", "", "climbed", "whether a rise of the cluster counts as a climb"),
        Q("leader", "", "leader", "index of the bead that is most often topmost during the rise, from 0"),
        Q("leader_large", "", "large leader", "whether the leader is large"),
        Q("height", "m", "height of the leader", "height of the leader at the end of the rise"),
        Q(
            "above_surface",
            "m",
            "height above the surface",
            "height of the leader above the surface of the bulk at the end of the rise",
        ),
        Q("size", "", "beads", "number of beads at the end of the rise"),
        Q("large", "", "large beads", "number of large beads at the end of the rise"),
        Q("walls", "", "walls", "number of side walls that hold the cluster at the end of the rise: two in a corner"),
        Q("wall_names", "", "names of the walls", "names of these walls: -x, +x, -y, +y; side for a cylinder"),
        Q("merged_into", "", "merged into", "index of the cluster into which this cluster merged, -1 for none"),
    ),
    "events": (  # one row per event of a cluster
        TIME,
        Q("event", "", "event", "freed, split, merged, rejoined or detached"),
        TRACK,
        Q(
            "other",
            "",
            "other cluster",
            "index of the cluster from which it split or into which it merged, -1 for none",
        ),
        Q("height", "m", "height of the leader", "height of the cluster's leader at the event"),
    ),
    "members": (TIME, TRACK, BEAD, LARGE, HEIGHT),  # one row per frame and bead of a cluster free of the bulk and held
    "assembly": (  # one row per climb, bead of the cluster and frame, from rest until the climb qualifies
        _more(TIME, "; the first frame is the last frame before the drive"),
        _more(TRACK, " that climbed"),
        BEAD,
        LARGE,
        HEIGHT,
        Q("in_bulk", "", "in the bulk", "whether the bead belongs to the bulk"),
        Q("at_wall", "", "at a side wall", "whether the bead has a bridge to a side wall"),
        Q("neighbours", "", "neighbours", "number of bridges to other beads of the later climbing cluster"),
        Q(
            "joined",
            "",
            "joined to the cluster",
            "whether bridges within the later climbing cluster connect the bead to most of the other beads",
        ),
    ),
}
"""The columns of the tables of runs, in their order."""

NUMBERS: Mapping[str, Quantity] = {}
"""The numbers of results by name."""


def declared(name: str, known: Iterable[Quantity]) -> Quantity:
    """The quantity of a name; ``rotation_2`` is found as ``rotation_*``, and its label has the number.

    Raises
    ------
    KeyError
        If there is none.

    Examples
    --------
    >>> declared("sliding_pair_2", TABLES["walkers"]).label
    'sliding of pair 2 of beads'
    """
    quantity = next((quantity for quantity in known if quantity.names(name)), None)
    if quantity is None:
        raise KeyError(name)
    return replace(quantity, name=name, label=quantity.label.replace("*", name.rpartition("_")[2]))


def axis(table: str, name: str) -> tuple[str, float]:
    """Label of an axis with the displayed unit, and the factor from SI units.

    Examples
    --------
    >>> axis("members", "height"), axis("walkers", "open_2")
    (('height (mm)', 1000.0), ('bead 2 off its wall (%)', 100.0))
    """
    quantity = declared(name, TABLES[table])
    unit, factor = quantity.shown
    return f"{quantity.label} ({unit})" if unit else quantity.label, factor
