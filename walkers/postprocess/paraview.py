"""Files for ParaView: beads, bridges and the moving boundary as .vtp, joined by one .pvd in physical seconds."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt

from walkers.inputs.boundary import Flat, Wall
from walkers.inputs.errors import InputError, Problem
from walkers.postprocess.analysis import analyses_of
from walkers.postprocess.dump import FloatArray
from walkers.postprocess.motion import Bridges, Motion, gathered, read_bridges, read_motion

if TYPE_CHECKING:
    import pyvista as pv

FOLDER_NAME = "vtk"
COLLECTION_NAME = "walkers.pvd"
SCRIPT_NAME = "show.py"
_END_OF_VTK = b"</VTKFile>\n"
_SIDES = 64
"""Of the prism that a round wall is drawn as."""


def write_vtk(
    directory: Path,
    *,
    every: int | None = None,
    vtu: bool = False,
    as_placed: bool = False,
    destination: Path | None = None,
) -> Path:
    """Write a run for ParaView.

    Parameters
    ----------
    directory
        A run directory.
    every
        Take one of so many samples of the drive; one a cycle if left out. Bridges are in the frames in which they were
        recorded.
    vtu
        Also write the beads as ``.vtu`` (through meshio).
    as_placed
        Leave independent walkers where the deck has them, centimetres apart, instead of drawing them side by side.
    destination
        Folder to write, replaced if it holds nothing but files of this function; ``vtk`` in the run directory if None.

    Returns
    -------
    Path
        The ``.pvd`` file: its times are seconds; part 0 the beads, part 1 the boundary, part 2 the bridges.

    Raises
    ------
    InputError
        If the folder holds anything else than such files.
    """
    motion = shown_in_paraview(directory, as_placed=as_placed)
    frames = _frames(motion, every or motion.case.run.samples_per_cycle)
    return _write_series(destination or directory / FOLDER_NAME, frames, vtu=vtu)


def shown_in_paraview(directory: Path, *, as_placed: bool) -> Motion:
    """The motion that the files hold and the camera sees: walkers side by side, unless they are left as placed."""
    motion = read_motion(directory)
    return gathered(motion) if motion.case.boundary.bare and not as_placed else motion


Meshes = dict[str, "pv.PolyData"]
"""Of a frame: ``beads``, ``boundary`` and, where they were recorded, ``bridges``: parts 0, 1 and 2."""


def _write_series(destination: Path, frames: Iterable[tuple[float, int, Meshes]], *, vtu: bool) -> Path:
    """Write times (s), numbers and meshes of frames beside the folder and rename it."""
    place = destination.resolve()
    _check_replaceable(place)
    place.parent.mkdir(parents=True, exist_ok=True)
    beside = Path(tempfile.mkdtemp(prefix=f".{place.name}-", dir=place.parent))
    root = ElementTree.Element("VTKFile", type="Collection", version="0.1", byte_order="LittleEndian")
    collection = ElementTree.SubElement(root, "Collection")
    try:
        beside.chmod(0o755)
        for time, number, meshes in frames:
            for part, (kind, mesh) in enumerate(meshes.items()):
                file = f"{kind}_{number:06d}.vtp"
                _save(mesh, beside / file)
                entry = {"timestep": repr(time), "group": "", "part": str(part), "file": file}
                ElementTree.SubElement(collection, "DataSet", entry)
            if vtu:
                _write_vtu(beside / f"beads_{number:06d}.vtu", meshes["beads"])
        ElementTree.indent(root)
        ElementTree.ElementTree(root).write(beside / COLLECTION_NAME, encoding="utf-8", xml_declaration=True)
        if place.exists():
            shutil.rmtree(place)
        beside.rename(place)
    except BaseException:
        shutil.rmtree(beside, ignore_errors=True)
        raise
    return destination / COLLECTION_NAME


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
        if path.suffix not in ours and path.name != SCRIPT_NAME:
            raise InputError(str(place), [Problem("", None, f"{expected}; it holds {path.name}")])


def _frames(motion: Motion, every: int) -> Iterator[tuple[float, int, Meshes]]:
    """Times, numbers and meshes of one of so many frames of the drive."""
    recorded = read_bridges(motion)
    following = next(recorded, None)
    further = [one.point_data(motion) for one in analyses_of(motion.case)]
    outline = boundary_of(motion)
    for frame in range(motion.first_driven, len(motion.time), every):
        while following is not None and following.frame < frame:
            following = next(recorded, None)
        meshes = {
            "beads": beads_at(motion, frame),
            "boundary": outline.translate(motion.substrate[frame], inplace=False),
        }
        if following is not None and following.frame == frame:
            for name, values in (pair for one in further for pair in one(following).items()):
                meshes["beads"].point_data[name] = values
            meshes["bridges"] = bridges_at(motion, following)
        yield float(motion.time[frame]), frame, meshes


def beads_at(motion: Motion, frame: int) -> pv.PolyData:
    """Beads of a frame as points, positions in the frame of the run, SI units.

    Point data: ``bead`` (number, from 0), ``walker`` (its number, -1 for none), ``radius``, ``large``, ``omega``, and
    ``velocity`` and ``speed`` relative to the boundary.
    """
    import pyvista as pv

    mesh = pv.PolyData(motion.position[frame] + motion.substrate[frame])
    velocity = motion.velocity[frame]
    arrays: dict[str, npt.NDArray[Any]] = {
        "bead": np.arange(len(motion.radius)),
        "walker": motion.walker_of,
        "radius": motion.radius,
        "large": motion.large.astype(np.int64),
        "velocity": velocity,
        "speed": np.linalg.norm(velocity, axis=1),
        "omega": motion.spin[frame],
    }
    for name, values in arrays.items():
        mesh.point_data[name] = np.ascontiguousarray(values)
    return mesh


def boundary_of(motion: Motion) -> pv.PolyData:
    """The walls: of a container up to its rim, of what has no end the part that the beads use."""
    import pyvista as pv

    boundary, margin = motion.case.boundary, 4.0 * float(motion.radius.max())
    low, high = motion.position.min(axis=(0, 1)) - margin, motion.position.max(axis=(0, 1)) + margin
    half, top = boundary.inner_width / 2.0, boundary.top
    if boundary.closed:
        wide = 1.01 * half  # a cylinder is drawn by flat sides, whose edges lie beyond it
        low, high = np.array([-wide, -wide, min(low[2], 0.0)]), np.array([wide, wide, top])
    planes = [plane for wall in boundary.walls for plane in _planes(wall)]
    edges = [(low, axis) for axis in np.eye(3)] + [(high, -axis) for axis in np.eye(3)]
    points: list[FloatArray] = []
    cells: list[int] = []
    for number, (point, normal) in enumerate(planes):
        others = planes[:number] + planes[number + 1 :]
        middle = (low + high) / 2.0
        nearest = middle - (middle - point) @ normal * normal
        corners = _clipped(_square(nearest, normal, 2.0 * float(np.linalg.norm(high - low))), [*others, *edges])
        if len(corners) > 2:
            cells += [len(corners), *range(len(points), len(points) + len(corners))]
            points += list(corners)
    return pv.PolyData(np.array(points), faces=cells)


def _planes(wall: Wall) -> list[tuple[FloatArray, FloatArray]]:
    """A point and the normal of a wall, or of each of the flat sides that a round one is drawn by."""
    if isinstance(wall, Flat):
        return [(np.array(wall.point), np.array(wall.normal))]
    turns = 2.0 * np.pi * (np.arange(_SIDES) + 0.5) / _SIDES
    outward = np.stack([np.cos(turns), np.sin(turns), 0.0 * turns], axis=-1)
    return [(wall.radius * one, -one) for one in outward]


def _square(centre: FloatArray, normal: FloatArray, size: float) -> FloatArray:
    """Corners of a square about a point, shape (4, 3)."""
    first = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    first /= np.linalg.norm(first)
    second = np.cross(normal, first)
    return np.array([centre + size * (a * first + b * second) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])


def _clipped(corners: FloatArray, planes: list[tuple[FloatArray, FloatArray]]) -> FloatArray:
    """The part of a convex polygon on the inner side of planes (point, normal), after Sutherland and Hodgman (1974)."""
    for point, normal in planes:
        inside = (corners - point) @ normal
        kept = []
        for one, other, here, there in zip(
            corners, np.roll(corners, -1, axis=0), inside, np.roll(inside, -1), strict=True
        ):
            if here >= -1e-12:
                kept.append(one)
            if (here > 1e-12 and there < -1e-12) or (here < -1e-12 and there > 1e-12):
                kept.append(one + (other - one) * here / (here - there))
        corners = np.array(kept).reshape(-1, 3)
        if len(corners) < 3:
            break
    return corners


def bridges_at(motion: Motion, bridges: Bridges) -> pv.PolyData:
    """Bridges of a frame as lines with ``gap`` (m), ``normal_force`` (N), ``touching`` and ``walker`` (first bead's).

    A line joins two centres, or a centre and the nearest point of the wall.
    """
    centres = motion.position[bridges.frame]
    held = centres[bridges.wall_beads]
    feet = np.stack([held - wall.distances(held)[:, None] * wall.normals(held) for wall in motion.case.boundary.walls])
    walls = np.stack([held, feet[bridges.walls, np.arange(len(held))]], axis=1)
    mesh = lines_between(np.concatenate([centres[bridges.beads], walls]) + motion.substrate[bridges.frame])
    gap = np.concatenate([bridges.gap, bridges.wall_gap])
    mesh.cell_data["gap"] = gap
    mesh.cell_data["normal_force"] = np.concatenate([bridges.force, bridges.wall_force])
    mesh.cell_data["touching"] = (gap <= 0.0).astype(np.int64)
    mesh.cell_data["walker"] = motion.walker_of[np.concatenate([bridges.beads[:, 0], bridges.wall_beads])]
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
