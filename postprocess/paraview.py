"""Files for ParaView: beads, bridges and the moving substrate as .vtp, joined by one .pvd in physical seconds."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt

from walkers.inputs.dimer import dimer_of
from walkers.inputs.errors import InputError, Problem
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.tables import read_table
from walkers.postprocess.trajectory import Trajectory, read_trajectory

if TYPE_CHECKING:
    import pandas as pd
    import pyvista as pv

FOLDER_NAME = "vtk"
COLLECTION_NAME = "walkers.pvd"
_END_OF_VTK = b"</VTKFile>\n"


def write_vtk(
    directory: Path,
    *,
    every_sample: bool = False,
    vtu: bool = False,
    as_placed: bool = False,
    destination: Path | None = None,
) -> Path:
    """Write a run for ParaView.

    Parameters
    ----------
    directory
        A run directory with its tables.
    every_sample
        All samples instead of one frame a cycle. Bridges are in the frames in which the engine reported them.
    vtu
        Also write the beads as ``.vtu`` (through meshio).
    as_placed
        Leave the walkers where the deck has them, centimetres apart, instead of drawing them side by side.
    destination
        Folder to write, replaced if it holds nothing but files of this function; ``vtk`` in the run directory if None.

    Returns
    -------
    Path
        The ``.pvd`` file: its times are seconds; part 0 the beads, part 1 the substrate, part 2 the bridges.

    Raises
    ------
    InputError
        If the folder holds anything else than such files.
    """
    trajectory = read_trajectory(directory)
    if not as_placed:
        trajectory = gathered(trajectory)
    bridges = read_table(directory, "bridges")
    stride = 1 if every_sample else trajectory.case.run.samples_per_cycle
    frames = (_frame(trajectory, bridges, frame) for frame in range(0, len(trajectory.time), stride))
    return write_series(destination or directory / FOLDER_NAME, COLLECTION_NAME, frames, vtu=vtu)


@dataclass(frozen=True)
class Frame:
    """What a frame shows: its time in s, its number, and from the numbers of the parts to their names and meshes."""

    time: float
    number: int
    meshes: Mapping[int, tuple[str, pv.PolyData]]


def write_series(destination: Path, name: str, frames: Iterable[Frame], *, vtu: bool = False) -> Path:
    """Write frames as ``.vtp`` with a ``.pvd`` in seconds, beside the folder and rename it.

    Parameters
    ----------
    destination
        Folder to write, replaced if it holds nothing but files of this function.
    name
        Of the ``.pvd``.
    frames
        In the order of time.
    vtu
        Also write part 0 as ``.vtu`` (through meshio).

    Raises
    ------
    InputError
        If the folder holds anything else than such files.
    """
    place = destination.resolve()
    _check_replaceable(place)
    place.parent.mkdir(parents=True, exist_ok=True)
    beside = Path(tempfile.mkdtemp(prefix=f".{place.name}-", dir=place.parent))
    try:
        beside.chmod(0o755)
        entries: list[_Entry] = []
        for frame in frames:
            for part, (kind, mesh) in frame.meshes.items():
                file = f"{kind}_{frame.number:06d}.vtp"
                _save(mesh, beside / file)
                entries.append(_Entry(frame.time, part, file))
                if vtu and part == 0:
                    _write_vtu((beside / file).with_suffix(".vtu"), mesh)
        _write_collection(beside / name, entries)
        if place.exists():
            shutil.rmtree(place)
        beside.rename(place)
    except BaseException:
        shutil.rmtree(beside, ignore_errors=True)
        raise
    return destination / name


def _save(mesh: pv.PolyData, path: Path) -> None:
    """Write a mesh; VTK only prints, at length, that it could not."""
    from vtkmodules.vtkCommonCore import vtkObject

    shown = vtkObject.GetGlobalWarningDisplay()
    vtkObject.GlobalWarningDisplayOff()
    try:
        mesh.save(path, binary=True)
    finally:
        vtkObject.SetGlobalWarningDisplay(shown)
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - len(_END_OF_VTK)))
        if file.read() != _END_OF_VTK:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path.parent))


def _check_replaceable(place: Path) -> None:
    """Only a folder that this module wrote, or an empty one, may be replaced."""
    if not place.exists():
        return
    expected = "expected a new or empty folder, or one that an earlier walkers vtk wrote"
    if not place.is_dir():
        raise InputError(str(place), [Problem("", None, f"{expected}; it is a file")])
    ours = (".vtp", ".vtu", Path(COLLECTION_NAME).suffix)
    for path in place.iterdir():
        if path.suffix not in ours:
            raise InputError(str(place), [Problem("", None, f"{expected}; it holds {path.name}")])


def gathered(trajectory: Trajectory) -> Trajectory:
    """The same walkers on parallel lanes two lengths apart; as independent replicates they may stand anywhere."""
    walkers = trajectory.layout.walkers
    lane = 2.0 * dimer_of(trajectory.case).length
    origins = np.array([[*walker.origin, 0.0] for walker in walkers])
    shift = -np.outer(np.arange(len(walkers)) * lane, trajectory.across_axis) - origins
    return replace(trajectory, position=trajectory.position + shift[:, None])


@dataclass(frozen=True)
class _Entry:
    time: float
    part: int
    file: str


def _frame(trajectory: Trajectory, bridges: pd.DataFrame, frame: int) -> Frame:
    meshes: dict[int, tuple[str, pv.PolyData]] = {
        0: ("beads", beads_at(trajectory, frame)),
        1: ("substrate", substrate_at(trajectory, frame)),
    }
    joined = bridges_at(trajectory, bridges, frame)
    if joined is not None:
        meshes[2] = ("bridges", joined)
    return Frame(float(trajectory.time[frame]), frame, meshes)


def _in_frame_of_run(trajectory: Trajectory, frame: int) -> FloatArray:
    """Bead centres, shape (W, 2, 3), with the motion of the substrate put back (in the container frame it has none)."""
    moved: FloatArray = trajectory.position[frame] + trajectory.substrate[frame]
    return moved


def beads_at(trajectory: Trajectory, frame: int) -> pv.PolyData:
    """Beads of a frame as points, positions in the frame of the run, SI units.

    Point data: ``id``, ``type`` (the engine's), ``walker``, ``bead`` (1 or 2), ``radius``, ``omega``, and ``velocity``
    relative to the substrate.
    """
    import pyvista as pv

    walkers = trajectory.layout.walkers
    count = len(walkers)
    mesh = pv.PolyData(_in_frame_of_run(trajectory, frame).reshape(-1, 3).copy())
    arrays: dict[str, npt.NDArray[Any]] = {
        "id": np.array([bead for walker in walkers for bead in walker.beads]),
        "walker": np.repeat([walker.walker for walker in walkers], 2),
        "bead": np.tile([1, 2], count),
        "type": np.ones(2 * count, dtype=np.int64),
        "radius": np.tile(trajectory.radii, count),
        "velocity": trajectory.velocity[frame].reshape(-1, 3),
        "omega": trajectory.spin[frame].reshape(-1, 3),
    }
    for name, values in arrays.items():
        mesh.point_data[name] = np.ascontiguousarray(values)
    return mesh


def substrate_at(trajectory: Trajectory, frame: int) -> pv.PolyData:
    """The part of the substrate that the walkers use, as a rectangle that moves with it."""
    import pyvista as pv

    ground = trajectory.position[..., :2]
    margin = 4.0 * float(trajectory.radii.max())
    low, high = ground.min(axis=(0, 1, 2)) - margin, ground.max(axis=(0, 1, 2)) + margin
    corners = np.array([[low[0], low[1], 0], [high[0], low[1], 0], [high[0], high[1], 0], [low[0], high[1], 0]])
    return pv.PolyData(corners + trajectory.substrate[frame], faces=[4, 0, 1, 2, 3])


def bridges_at(trajectory: Trajectory, bridges: pd.DataFrame, frame: int) -> pv.PolyData | None:
    """Bridges of a frame as lines with ``gap`` (m), ``normal_force`` (N), ``touching`` and ``contact``.

    A line joins two centres, or a centre and the point of the substrate below it. None if the engine reported no
    bridges in that frame.
    """
    half_step = 0.5 * trajectory.layout.time_step
    rows = bridges[np.abs(bridges["time"] - trajectory.time[frame]) < half_step]
    if rows.empty:
        return None
    centres = {
        bead: centre
        for walker, pair in zip(trajectory.layout.walkers, _in_frame_of_run(trajectory, frame), strict=True)
        for bead, centre in zip(walker.beads, pair, strict=True)
    }
    floor = np.array([1.0, 1.0, 0.0])
    ends = [
        (centres[first], centres[second] if second else centres[first] * floor)
        for first, second in zip(rows["bead_1"], rows["bead_2"], strict=True)
    ]
    mesh = lines_between(np.array(ends))
    for name in ("gap", "normal_force", "touching", "contact", "walker"):
        mesh.cell_data[name] = rows[name].to_numpy().astype(np.float64)
    return mesh


def lines_between(ends: FloatArray) -> pv.PolyData:
    """Lines between pairs of points, shape (K, 2, 3)."""
    import pyvista as pv

    numbers = np.arange(2 * len(ends)).reshape(-1, 2)
    lines = np.hstack([np.full((len(ends), 1), 2), numbers]).ravel()
    return pv.PolyData(np.ascontiguousarray(ends.reshape(-1, 3)), lines=lines)


def _write_vtu(path: Path, beads: pv.PolyData) -> None:
    import meshio

    points = np.asarray(beads.points)
    cells = [("vertex", np.arange(len(points)).reshape(-1, 1))]
    arrays = {name: np.asarray(beads.point_data[name]) for name in beads.point_data}
    meshio.Mesh(points, cells, point_data=arrays).write(path)


def _write_collection(path: Path, entries: Iterable[_Entry]) -> None:
    root = ElementTree.Element("VTKFile", type="Collection", version="0.1", byte_order="LittleEndian")
    collection = ElementTree.SubElement(root, "Collection")
    for entry in entries:
        ElementTree.SubElement(
            collection, "DataSet", timestep=repr(entry.time), group="", part=str(entry.part), file=entry.file
        )
    ElementTree.indent(root)
    ElementTree.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)
