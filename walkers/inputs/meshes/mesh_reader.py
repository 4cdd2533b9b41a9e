"""Read one mesh file in a process of its own: ``python -m walkers.inputs.meshes.mesh_reader FILE``.

Libraries that read meshes end the process, or ask for all memory, where a file is damaged or made
to do harm. So `walkers.inputs.meshes.mesh_file` starts this module with limits of time and
memory. The module writes the points and triangles to standard output as an npz file. If there are
none, it writes the reason as text, and its exit status is `REFUSED` or `READ_NOTHING`. From this
project it only imports the types of arrays, so that it starts quickly.
"""

from __future__ import annotations

import re
import resource
import sys
from collections.abc import Iterable, Sequence
from contextlib import redirect_stdout
from importlib import import_module
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from walkers.arrays import FloatArray

Polygons = list[npt.NDArray[np.int64]]
"""Corners of polygons: arrays of shape (polygons, corners), one for each number of corners."""
REFUSED = 3
"""Exit status if the file is not a mesh that can be read."""
READ_NOTHING = 4
"""Exit status if a reader gives no surface: what it has printed says more than the text of this
module."""
MOST_MEMORY = 3 << 30
"""Address space that reading may take, bytes."""
MOST_SECONDS = 60
"""CPU time that reading may take, s."""
_MOST_ITEMS = 3_000_000
"""Largest number of points, cells or values that a file may announce."""
_LEAST_DETAIL = 1e-5
"""Length that single precision must resolve, over the extent of a mesh."""

_VTK_READERS = {
    ".stl": ("vtkIOGeometry", "vtkSTLReader"),
    ".obj": ("vtkIOGeometry", "vtkOBJReader"),
    ".ply": ("vtkIOPLY", "vtkPLYReader"),
    ".vtp": ("vtkIOXML", "vtkXMLPolyDataReader"),
    ".vtu": ("vtkIOXML", "vtkXMLUnstructuredGridReader"),
    ".vtk": ("vtkIOLegacy", "vtkGenericDataObjectReader"),
}
"""Modules and names of VTK's readers by the endings of files."""
_CORNERS_OF_VTK_CELLS = {
    5: (0, 1, 2),  # a triangle
    8: (0, 1, 3, 2),  # a pixel, whose corners are in rows
    9: (0, 1, 2, 3),  # a quadrilateral
    # Quadratic and biquadratic cells have more points, which follow their corners.
    22: (0, 1, 2),  # a quadratic triangle
    23: (0, 1, 2, 3),  # a quadratic quadrilateral
    28: (0, 1, 2, 3),  # a biquadratic quadrilateral
    34: (0, 1, 2),  # a biquadratic triangle
}
"""Places of the corners, counterclockwise, among the points of flat cells, by VTK's numbers of
cell types."""
_VTK_POLYGON = 7
"""VTK's number of the cell type of polygons."""
_CORNERS_OF_MESHIO_CELLS = {"triangle": 3, "quad": 4}
"""Numbers of corners of flat cells by meshio's names, without the number of points."""


class NothingRead(ValueError):
    """A reader gives no surface; it may have printed why."""


def _numpy_support() -> Any:
    """VTK's functions for arrays of numpy, which have no types."""
    return import_module("vtkmodules.util.numpy_support")


def _points_of(dataset: Any) -> FloatArray:
    """The points of a VTK dataset in the unit of its file, shape (P, 3).

    Raises `NothingRead` if it has none.
    """
    vtk_to_numpy = _numpy_support().vtk_to_numpy

    points = dataset.GetPoints()
    if points is None or points.GetNumberOfPoints() == 0:
        raise NothingRead("it has no points")
    return shortest_decimals(vtk_to_numpy(points.GetData()))


def shortest_decimals(points: npt.NDArray[Any]) -> FloatArray:
    """Points of single or double precision in double precision, of the same shape.

    Numbers of single precision are read as the shortest decimals that name them: 2.65 of a binary
    STL file is 2.65 and not 2.6500000953674316.
    """
    if points.dtype.itemsize >= 8:
        return points.astype(np.float64)
    return points.astype(np.float32).astype(str).astype(np.float64)


def _triangulated(polydata: Any) -> npt.NDArray[np.int64]:
    """Triangles of the polygons and strips of VTK polydata, shape (T, 3)."""
    vtk_to_numpy = _numpy_support().vtk_to_numpy
    from vtkmodules.vtkFiltersCore import vtkTriangleFilter

    cut = vtkTriangleFilter()
    cut.SetInputData(polydata)
    cut.PassLinesOff()
    cut.PassVertsOff()
    cut.Update()
    cells = cut.GetOutput().GetPolys()
    corners = vtk_to_numpy(cells.GetConnectivityArray())
    triangles: npt.NDArray[np.int64] = corners.astype(np.int64).reshape(-1, 3)
    return triangles


def _check_precision(path: Path, points: FloatArray) -> None:
    """Refuse a text file whose points are so far from the origin that single precision loses them.

    VTK reads text into single precision, 7 digits. Files of single precision have no more to lose.
    """
    start = path.read_bytes()[:2000]  # contains the header
    if path.suffix.lower() not in (".obj", ".ply", ".stl") or not len(points):
        return
    if b"\0" in start and b"property double" not in start:
        return
    extent = float(np.ptp(points, axis=0).max())
    farthest = float(np.abs(points).max())
    if extent > 0.0 and farthest * np.finfo(np.float32).eps > _LEAST_DETAIL * extent:
        away = f"its points are up to {farthest:g} from the origin and {extent:g} across"
        raise ValueError(f"{away}, too far for 7 digits; move the mesh to the origin")


def _check_indices(groups: Iterable[npt.NDArray[np.int64]], count: int) -> None:
    """Raise `ValueError` for polygons with corners that are not among ``count`` points.

    Corners are numbered from 0 here, and from 1 in the message.
    """
    for group in groups:
        wrong = group[(group < 0) | (group >= count)]
        if wrong.size:
            raise ValueError(
                f"a polygon has the corner {wrong[0] + 1}, but there are {count} points"
            )


def _triangles_of_polygons(points: FloatArray, polygons: Polygons) -> npt.NDArray[np.int64]:
    """Triangles of polygons, which VTK cuts where they are not convex, shape (T, 3)."""
    support = _numpy_support()
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

    _check_indices(polygons, len(points))
    if not polygons:
        return np.empty((0, 3), dtype=np.int64)
    sizes = np.concatenate([np.full(len(group), group.shape[1]) for group in polygons])
    offsets = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    corners = np.concatenate([group.ravel() for group in polygons]).astype(np.int64)
    cells = vtkCellArray()
    vtk_offsets = support.numpy_to_vtkIdTypeArray(offsets, 1)
    vtk_corners = support.numpy_to_vtkIdTypeArray(corners, 1)
    cells.SetData(vtk_offsets, vtk_corners)
    places = vtkPoints()
    places.SetData(support.numpy_to_vtk(np.ascontiguousarray(points), 1))
    surface = vtkPolyData()
    surface.SetPoints(places)
    surface.SetPolys(cells)
    return _triangulated(surface)


def _polygons_of_grid(grid: Any) -> Polygons:
    """The flat cells of a VTK unstructured grid."""
    vtk_to_numpy = _numpy_support().vtk_to_numpy

    if grid.GetNumberOfCells() == 0:
        return []
    offsets = vtk_to_numpy(grid.GetCells().GetOffsetsArray())
    corners = vtk_to_numpy(grid.GetCells().GetConnectivityArray())
    polygons: Polygons = []
    for number, cell_type in enumerate(vtk_to_numpy(grid.GetCellTypes())):
        cell = corners[offsets[number] : offsets[number + 1]]
        if cell_type == _VTK_POLYGON:
            polygons.append(cell[None].astype(np.int64))
        elif cell_type in _CORNERS_OF_VTK_CELLS:
            order = list(_CORNERS_OF_VTK_CELLS[cell_type])
            polygons.append(cell[order][None].astype(np.int64))
    return polygons


def _check_announced_sizes(path: Path) -> None:
    """Refuse XML files of VTK that announce more data than a vessel has.

    VTK would ask for the memory before it reads the data.
    """
    text = path.read_bytes()
    for name, digits in re.findall(rb'\b(Number\w*)\s*=\s*["\']\s*(\d+)', text):
        if int(digits) > _MOST_ITEMS:
            announced = f"{name.decode()} = {digits.decode()}"
            raise ValueError(f"it announces {announced}; at most {_MOST_ITEMS:,} are read")


def _read_by_vtk(path: Path) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """Points (P, 3), in the unit of the file, and triangles (T, 3) of a format in `_VTK_READERS`.

    Raises `NothingRead` for a file without points or of volumes, and `ValueError` for one that
    announces too many points or has lost their digits (`_check_precision`).
    """
    ending = path.suffix.lower()
    if ending in (".vtp", ".vtu"):
        _check_announced_sizes(path)
    module, name = _VTK_READERS[ending]
    reader = getattr(import_module(f"vtkmodules.{module}"), name)()
    reader.SetFileName(str(path))
    if ending == ".stl":
        reader.MergingOff()
    reader.Update()
    dataset = reader.GetOutput()
    if dataset is None:
        raise NothingRead("it has no surface")
    if dataset.IsA("vtkPolyData"):
        points = _points_of(dataset)
        _check_precision(path, points)
        return points, _triangulated(dataset)
    if dataset.IsA("vtkUnstructuredGrid"):
        points = _points_of(dataset)
        return points, _triangles_of_polygons(points, _polygons_of_grid(dataset))
    kind = dataset.GetClassName()[len("vtk") :]
    raise NothingRead(f"it has a {kind}, which is no surface")


def _lines_of_off(path: Path) -> list[list[str]]:
    """Words of the lines of an OFF file, without comments and empty lines."""
    lines = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        words = line.split("#")[0].split()
        if words:
            lines.append(words)
    return lines


def _read_off(path: Path) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """The Object File Format as text: polygons of any number of corners, colours, comments."""
    lines = _lines_of_off(path)
    if not lines or not lines[0][0].endswith("OFF"):
        raise ValueError("it does not begin with OFF")
    if lines[0][1:]:
        counts = lines[0][1:]
        rest = lines[1:]
    else:
        counts = lines[1]
        rest = lines[2:]
    point_count = int(counts[0])
    face_count = int(counts[1])
    if len(rest) < point_count + face_count:
        announced = f"{point_count} points and {face_count} faces"
        raise ValueError(f"it announces {announced}, and has {len(rest)} lines of them")
    points = np.array([_coordinates(words) for words in rest[:point_count]])
    polygons: Polygons = []
    for words in rest[point_count : point_count + face_count]:
        corners = words[1 : 1 + int(words[0])]
        polygons.append(np.array([corners], dtype=np.int64))
    return points, _triangles_of_polygons(points.reshape(-1, 3), polygons)


def _coordinates(words: Sequence[str]) -> list[float]:
    """The coordinates of a point of an OFF file, after which colours may follow."""
    return [float(word) for word in words[:3]]


def _check_other_files(path: Path) -> None:
    """Refuse files whose points are in other files, which may be any on this machine."""
    if path.suffix.lower() in (".xdmf", ".xmf"):
        text = path.read_text(encoding="utf-8", errors="replace")
        for name in re.findall(r'Format\s*=\s*["\'](\w+)', text):
            if name.upper() != "XML":
                problem = f'its data are in another file (Format="{name}")'
                raise ValueError(f"{problem}; write them into it")
    if path.suffix.lower() == ".inp" and re.search(rb"(?im)^\s*\*\s*include", path.read_bytes()):
        raise ValueError("it includes another file; write all into one")


def _read_by_meshio(path: Path) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """Points (P, 3), in the unit of the file, and triangles (T, 3) of a format of meshio.

    Raises `ValueError` for a file that needs other files, and for corners that do not exist.
    """
    import meshio

    _check_other_files(path)
    with redirect_stdout(sys.stderr):
        mesh = meshio.read(path)
    given = np.asarray(mesh.points)[:, :3]
    points = shortest_decimals(np.pad(given, ((0, 0), (0, 3 - given.shape[1]))))
    polygons: Polygons = []
    for block in mesh.cells:
        name = block.type.rstrip("0123456789")  # such as triangle of triangle6
        if block.type == "polygon":
            polygons += [np.array([corners], dtype=np.int64) for corners in block.data]
        elif name in _CORNERS_OF_MESHIO_CELLS:
            corner_count = _CORNERS_OF_MESHIO_CELLS[name]
            polygons.append(np.array(block.data, dtype=np.int64)[:, :corner_count])
    return points, _triangles_of_polygons(points, polygons)


def read_surface(path: Path) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """The surface of a mesh file.

    Parameters
    ----------
    path : Path
        A file; its ending says which format it has.

    Returns
    -------
    points : ndarray
        Shape (P, 3), in the unit of the file.
    triangles : ndarray
        Indices of their corners, shape (T, 3). Polygons are cut into triangles; lines, points and
        volumes are left out.

    Raises
    ------
    ValueError
        If the file is not of its format. The readers raise other errors too.
    """
    if path.suffix.lower() in _VTK_READERS:
        points, triangles = _read_by_vtk(path)
    elif path.suffix.lower() == ".off":
        points, triangles = _read_off(path)
    else:
        points, triangles = _read_by_meshio(path)
    _check_indices([triangles], len(points))
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if bad.size:
        place = ", ".join(f"{coordinate:g}" for coordinate in points[bad[0]])
        raise ValueError(f"point {bad[0] + 1} is ({place}), which is no place")
    return points, triangles


def _set_limit(limit: int, value: int) -> None:
    """Lower a limit of this process, such as ``resource.RLIMIT_CPU``."""
    _, hard = resource.getrlimit(limit)
    if hard != resource.RLIM_INFINITY:
        value = min(value, hard)
    resource.setrlimit(limit, (value, hard))


def main(arguments: Sequence[str]) -> int:
    """Read the file that the only argument names, and write its surface to standard output.

    Returns
    -------
    int
        The exit status: 0, `REFUSED` or `READ_NOTHING`.
    """
    _set_limit(resource.RLIMIT_AS, MOST_MEMORY)
    _set_limit(resource.RLIMIT_CPU, MOST_SECONDS)
    _set_limit(resource.RLIMIT_CORE, 0)
    try:
        points, triangles = read_surface(Path(arguments[0]))
    except MemoryError:
        sys.stdout.write(f"it takes more than {MOST_MEMORY >> 30} GB to read")
        return REFUSED
    except (NothingRead, SystemExit) as error:  # meshio ends the process if it cannot read a file
        sys.stdout.write(str(error))
        return READ_NOTHING
    except Exception as error:
        sys.stdout.write(str(error))
        return REFUSED
    arrays = BytesIO()
    np.savez(arrays, points=points, triangles=triangles)
    sys.stdout.buffer.write(arrays.getvalue())
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
