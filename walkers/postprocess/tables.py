"""The tables of a run: parquet files whose columns carry their unit and meaning.

Written with pyarrow alone (pandas takes a third of a second to import); read into pandas.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from walkers.runner.files import beside
from walkers.runner.manifest import check_unchanged

if TYPE_CHECKING:
    import pandas as pd

_CONTACTS = "contacts: the beads with walls in their order, then the pairs of beads that touched at the start"

FAMILIES = {
    "rotation": ("m/s", "rotation velocity -R dphi/dt of a bead"),
    "sliding": ("m/s", f"sliding velocity; {_CONTACTS}"),
    "gap": ("m", f"gap, negative where they touch; {_CONTACTS}"),
    "open": ("", f"share of the time for which the contact is open; {_CONTACTS}"),
}
"""Columns of which there is one for each bead or contact, numbered from 1: ``rotation_1``, ``rotation_2``, …"""

TRAJECTORY = {
    "walker": ("", "number of the walker, from 0"),
    "time": ("s", "from the begin of the drive"),
    "cycle": ("", "time in cycles of the drive"),
    "x": ("m", "mass centre relative to the substrate"),
    "y": ("m", "mass centre relative to the substrate"),
    "z": ("m", "mass centre above the substrate"),
    "orientation": ("rad", "angle of the walker from the direction that it was to face"),
    "velocity": ("m/s", "mass centre relative to the substrate, along the heading (small beads to large ones)"),
}
"""``trajectory.parquet``: one row per sample and walker; and ``rotation_1`` …, ``sliding_1`` …, ``gap_1`` …"""

WALKERS = {
    "walker": ("", "number of the walker, from 0"),
    "make": ("", "number of the walker's make in the case, from 0: its dimers, then its clusters"),
    "facing": ("", "where it is to face at the start: 1 along the drive axis (right), -1 against it (left)"),
    "start_angle": ("rad", "orientation at the start"),
    "velocity": ("m/s", "along the heading after the settling cycles, positive toward the large beads"),
    "standard_error": ("m/s", "of the fit of the velocity"),
    "first_half": ("m/s", "velocity in the first half of the fitted cycles"),
    "second_half": ("m/s", "velocity in the second half of the fitted cycles"),
    "steady": ("", "whether the two halves agree"),
    "axial_velocity": ("m/s", "mass centre along the drive axis"),
    "lateral_velocity": ("m/s", "mass centre across the drive axis"),
    "orientation_mean": ("rad", "mean orientation after the settling cycles"),
    "orientation_end": ("rad", "orientation at the end"),
    "turned_at": ("s", "when it was first, at the end of a cycle, off by more than a right angle; NaN if it never was"),
    "separated_fraction": (
        "",
        "share of the samples in which two beads are farther apart than the bridge between them reaches",
    ),
}
"""``walkers.parquet``: one row per walker; and ``rotation_1`` …, ``sliding_1`` …, ``open_1`` …; means are over the
cycles after the settling ones."""

BRIDGES = {
    "time": ("s", "from the begin of the drive"),
    "walker": ("", "number of the walker, from 0"),
    "contact": ("", "number of the contact, from 1: beads with walls, then pairs of beads; 0 for any other bridge"),
    "bead_1": ("", "number of the bead in the run, from 0"),
    "bead_2": ("", "number of the other bead, -1 for a wall"),
    "wall": ("", "number of the wall, 0 for the floor if there is one, -1 for none"),
    "other_walker": ("", "number of the walker that the bridge joins it to, -1 for none"),
    "gap": ("m", "gap, negative where they touch"),
    "touching": ("", "whether the surfaces touch"),
    "normal_force": ("N", "net normal force (capillary, viscous, elastic), positive where it pulls the two together"),
}
"""``bridges.parquet``: one row per bridge and frame."""

MEETINGS = {
    "time": ("s", "from the begin of the drive"),
    "event": ("", "merged: the first bridge between two walkers is there; parted: the last one is gone"),
    "walker": ("", "number of one of the two"),
    "other": ("", "number of the other"),
    "size": ("", "walkers that are joined by bridges, directly or by others, with the first one after that"),
}
"""``meetings.parquet``: one row per event between two walkers that are meant to meet."""

BED = {
    "time": ("s", "from the begin of the drive; negative while the pile settles"),
    "surface": ("m", "height of the bulk's surface: median over x-y cells of the highest bead top"),
    "surface_low": ("m", "the same, 10th percentile"),
    "surface_high": ("m", "the same, 90th percentile"),
    "brazil_nut": ("", "(mean height of large beads - of small ones) / (their sum)"),
    "brazil_nut_of_bulk": ("", "the same without the beads that are free of the bulk"),
    "mean_square_velocity": ("m^2/s^2", "of the beads, relative to the container, at the frames' phase of the drive"),
    "contacts": ("", "a bead: twice the bridges between beads that touch, over the beads; those to walls do not count"),
    "bridges": ("", "a bead: twice the bridges between beads, touching or open, over the beads; not those to walls"),
    "touching": ("", "bridges between beads that touch"),
    "opened": ("", "bridges between beads that do not"),
    "mean_force": ("N", "normal force of the bridges between beads, positive: pulling together"),
    "liquid_in_bridges": ("m^3", "sum of the volumes of all bridges, those to walls too"),
    "bulk": ("", "beads in the bulk"),
    "clusters": ("", "clusters that are free of the bulk and held to a side wall"),
    "highest": ("m", "height of the topmost bead of these; the surface where there is none"),
}
"""``bed.parquet``: one row per frame of a pile."""

CLUSTERS = {
    "track": ("", "number of the cluster, followed through time"),
    "first": ("s", "when it was first free of the bulk and held to a side wall"),
    "last": ("s", "when it was so last"),
    "begin": ("s", "of its greatest gain of height"),
    "end": ("s", "of that gain"),
    "out_of_pile": ("", "whether most of its first beads were in the bulk before; else it hung there from the start"),
    "onset": ("s", "when the gain began by which it first counted as a climb; NaN if it never did"),
    "qualified": ("s", "when it first counted as a climb, its gain having reached what counts; NaN if it never did"),
    "gain": ("m", "greatest gain of height, of the mean of its beads"),
    "speed": ("m/s", "that gain over the time in which it was made"),
    "standard_error": ("m/s", "of the speed, from those in ten parts of that time"),
    "climbed": ("", "whether it counted as a climb at any time"),
    "leader": ("", "number of the bead that was most often topmost meanwhile, from 0"),
    "leader_large": ("", "whether it is of the large class"),
    "height": ("m", "of the leader then"),
    "above_surface": ("m", "of the leader then, above the bulk's surface"),
    "size": ("", "beads then"),
    "large": ("", "large beads then"),
    "walls": ("", "number of side walls that held it then: two in a corner"),
    "wall_names": ("", "which ones: -x, +x, -y, +y, of a cylinder side"),
    "merged_into": ("", "number of the track that took it over, -1 if none did"),
}
"""``clusters.parquet``: one row per cluster of a pile."""

PROFILE = {
    "height": ("m", "middle of a layer"),
    "packing_fraction": ("", "volume of beads over that of the container, mean over the second half of the drive"),
    "liquid_fraction": ("", "volume of bridges over that of the container, as above"),
}
"""``profile.parquet``: one row per layer of a pile."""

EVENTS = {
    "time": ("s", "from the begin of the drive"),
    "event": ("", "freed, split, merged, rejoined or detached (postprocess.events)"),
    "track": ("", "number of the cluster to which it happened"),
    "other": ("", "that from which it split or into which it merged, -1 for none"),
}
"""``events.parquet``: one row per event in the lives of a pile's clusters."""

TABLES = {
    **{"trajectory": TRAJECTORY, "walkers": WALKERS, "bridges": BRIDGES, "meetings": MEETINGS},
    **{"bed": BED, "clusters": CLUSTERS, "events": EVENTS, "profile": PROFILE},
}


def described(name: str, columns: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Unit and meaning of the columns of a table of `TABLES`, those of the `FAMILIES` among them after the others."""
    families = {key: FAMILIES[key.rpartition("_")[0]] for key in columns if key.rpartition("_")[0] in FAMILIES}
    return {**TABLES[name], **families}


def write_table(directory: Path, name: str, columns: Mapping[str, npt.NDArray[Any]]) -> None:
    """Write a table of `TABLES` beside its place and rename it.

    Parameters
    ----------
    directory
        The run directory.
    name
        Name of the table.
    columns
        One array a column, all of the same length.

    Raises
    ------
    KeyError
        If a column of the table is missing.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    description = described(name, columns)
    arrays = [_arrow(columns[key]) for key in description]
    fields = [
        pa.field(key, array.type, metadata={"unit": unit, "meaning": meaning})
        for (key, (unit, meaning)), array in zip(description.items(), arrays, strict=True)
    ]
    reals = [field.name for field in fields if pa.types.is_floating(field.type)]
    with beside(directory / f"{name}.parquet") as new:
        pq.write_table(
            pa.Table.from_arrays(arrays, schema=pa.schema(fields)),
            new,
            compression="zstd",
            use_dictionary=[field.name for field in fields if field.name not in reals],
            use_byte_stream_split=reals,
        )


def intact(directory: Path, names: Iterable[str]) -> bool:
    """Whether tables of a run directory are there and whole: parquet begins and ends with the same four bytes."""
    for name in names:
        path = directory / f"{name}.parquet"
        if not path.is_file() or path.stat().st_size < 12:
            return False
        with path.open("rb") as file:
            head = file.read(4)
            file.seek(-4, 2)
            if not head == file.read(4) == b"PAR1":
                return False
    return True


def _arrow(values: npt.NDArray[Any]) -> Any:
    """An arrow array on numpy's memory; ``pyarrow.array`` would import pandas to see whether it was given a series."""
    import pyarrow as pa

    if values.dtype.kind == "U":
        return pa.array(values.tolist(), pa.string())
    if values.dtype == np.bool_:
        return pa.Array.from_buffers(
            pa.bool_(), len(values), [None, pa.py_buffer(np.packbits(values, bitorder="little").tobytes())]
        )
    kind = pa.from_numpy_dtype(values.dtype)
    return pa.Array.from_buffers(kind, len(values), [None, pa.py_buffer(np.ascontiguousarray(values))])


def read_table(directory: str | Path, name: str) -> pd.DataFrame:
    """Read a table of a run directory into pandas, SI units.

    Parameters
    ----------
    directory
        The run directory.
    name
        ``trajectory``, ``walkers``, ``bridges`` or ``meetings``, of a pile ``bed``, ``clusters``, ``events`` or
        ``profile``; their columns are described in `TABLES`.

    Returns
    -------
    DataFrame
        Its ``attrs["units"]`` maps columns to units.

    Raises
    ------
    KeyError
        If there is no table of that name.
    FileNotFoundError
        If the directory has none.
    runner.manifest.FileChanged
        If it is not what it was when the run was finished.
    """
    import pyarrow.parquet as pq

    if name not in TABLES:
        raise KeyError(f"no table {name!r}; expected one of {', '.join(TABLES)}")
    path = Path(directory) / f"{name}.parquet"
    if not path.exists():
        there = [one for one in TABLES if path.with_stem(one).exists()]
        raise FileNotFoundError(f"{directory} has no table {name}; it has {', '.join(there) or 'none'}")
    check_unchanged(Path(directory), [path.name])
    frame: pd.DataFrame = pq.read_table(path).to_pandas()
    frame.attrs["units"] = {column: unit for column, (unit, _) in described(name, frame.columns).items()}
    return frame
