"""Files for ParaView: beads, bridges and the moving boundary as blocks of one .vtm per frame, listed in a .pvd (s).

Names of arrays end with their units, as in ``speed (m/s)``; indices and numbers have none. A script shows the files. A
state file (``.pvsm``) is not written: it contains all properties of one version of ParaView, and absolute paths.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from walkers.errors import refused
from walkers.postprocess.analysis import analyses_of
from walkers.postprocess.drawing import check_every
from walkers.postprocess.motion import Bridges, Motion, gathered, read_bridges, read_motion
from walkers.postprocess.scene import Scene, camera_axes, mesh_of, walls_of
from walkers.runner.files import write_bytes, write_text
from walkers.text import rendered

if TYPE_CHECKING:
    import pyvista as pv

_COLLECTION, _SCRIPT = "walkers.pvd", "show.py"
_NUMBERED = re.compile(r'file="frame_(\d+)\.vtm"')
_OURS = re.compile(r"(?:frame|beads|bridges|boundary)_(\d+)\.vt[mpu]")
"""Numbers of the frames that a collection lists; names of the files of a frame."""
_WIDE, _AROUND = 16.0 / 9.0, 1.15  # width over height of the view; its extent over that of what the beads reach
_NECK = 0.45  # radius of what is drawn of a bridge over that of the smallest bead
_UNITS = {
    **{"speed": "m/s", "velocity": "m/s", "omega": "rad/s", "radius": "m", "gap": "m", "normal_force": "N"},
}
"""Units of arrays."""


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
    directory, destination
        A run directory; the folder to write, ``vtk`` in the run directory if None. A folder is replaced if it is
        empty, or if it has no files but those of an earlier export, which its ``walkers.pvd`` lists. A folder with any
        other file, a file, or a symbolic link raises an InputError.
    every
        Write every ``every``-th sample of the drive; None: one per cycle, or all samples if they are further apart.
        Bridges are in the frames that recorded them.
    vtu
        Also write the beads as ``.vtu``.
    as_placed
        Leave independent walkers at their places in the deck, centimetres apart, instead of side by side.

    Returns
    -------
    Path
        The ``.pvd`` file with times in s; each frame has the blocks ``beads``, ``boundary`` and, if recorded,
        ``bridges``.
    """
    return _write(_shown(directory, as_placed=as_placed), destination or directory / "vtk", every, vtu=vtu)


def write_paraview(
    directory: Path,
    destination: Path | None = None,
    *,
    colour: str | None = None,
    every: int | None = None,
    as_placed: bool = False,
) -> Path:
    """Write a run for ParaView, with a script that shows it.

    ``colour`` is the array that colours the beads, by default ``walker`` if there are walkers, else ``speed``; an
    unknown array raises an InputError. The other parameters are those of `write_vtk`. Returns the script.
    """
    motion = _shown(directory, as_placed=as_placed)
    colour = colour or ("walker" if motion.walkers else "speed")
    return _write(motion, destination or directory / "vtk", every, colour=colour).with_name(_SCRIPT)


def _write(motion: Motion, destination: Path, every: int | None, *, vtu: bool = False, colour: str = "") -> Path:
    """Write the files of `write_vtk`, with a ``colour`` also the script; return the ``.pvd`` file."""
    check_every(every)
    _check_replaceable(destination)
    place = destination.absolute()
    entries: list[str] = []
    place.parent.mkdir(parents=True, exist_ok=True)
    beside = Path(tempfile.mkdtemp(prefix=f".{place.name}-", dir=place.parent))
    try:
        beside.chmod(0o755)
        for frame, meshes in _frames(motion, every or motion.case.run.samples_per_cycle):
            if colour and not entries:
                known = {name.partition(" (")[0] for name in meshes["beads"].array_names}
                if colour not in known:
                    raise refused("colour", f"{colour!r}: expected one of {', '.join(sorted(known))}")
                write_text(beside / _SCRIPT, _script(motion.driven, colour, place))
            blocks: list[str] = []
            for kind, mesh in meshes.items():
                _save(mesh, beside / f"{kind}_{frame:06d}.vtp")
                blocks.append(f'    <DataSet index="{len(blocks)}" name="{kind}" file="{kind}_{frame:06d}.vtp"/>')
            write_text(beside / f"frame_{frame:06d}.vtm", _listing("vtkMultiBlockDataSet", "1.0", blocks))
            time = float(motion.time[frame])
            entries.append(f'    <DataSet timestep="{time!r}" group="" part="0" file="frame_{frame:06d}.vtm" />')
            if vtu:
                meshes["beads"].cast_to_unstructured_grid().save(beside / f"beads_{frame:06d}.vtu")
        write_text(beside / _COLLECTION, _listing("Collection", "0.1", entries))
        if place.exists():
            shutil.rmtree(place)
        beside.rename(place)
    except BaseException as error:
        if isinstance(error, OSError) and error.filename is None:  # a disk that is full does not say which
            error.filename = str(destination)
        shutil.rmtree(beside, ignore_errors=True)
        raise
    return destination / _COLLECTION


def open_paraview(script: Path) -> None:
    """Start ParaView with a script without waiting for its end; InputError if ParaView is not installed."""
    program = shutil.which("paraview")
    if program is None:
        raise refused("paraview", f"is not installed; open {script} in ParaView to show the run")
    subprocess.Popen([program, f"--script={script}"], start_new_session=True)


def _shown(directory: Path, *, as_placed: bool) -> Motion:
    """The motion that is written: independent walkers side by side, unless left as placed."""
    motion = read_motion(directory)
    return gathered(motion) if motion.case.boundary.bare and not as_placed else motion


def _save(mesh: pv.PolyData, path: Path) -> None:
    """Write a mesh; raises OSError if the disk is full, which VTK itself would only print."""
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

    writer = vtkXMLPolyDataWriter()
    writer.SetInputData(mesh)
    writer.SetDataModeToBinary()
    writer.WriteToOutputStringOn()
    writer.Write()
    write_bytes(path, writer.GetOutputString().encode(), at_once=False)


def _check_replaceable(place: Path) -> None:
    """Refuse to replace anything but an empty folder or the files of an earlier export, which its .pvd lists."""
    held = "it is a symbolic link" if place.is_symlink() else "it is a file" if place.is_file() else ""
    if not held and place.exists():
        collection, names = place / _COLLECTION, {path.name for path in place.iterdir()}
        listed = set(_NUMBERED.findall(collection.read_text("utf-8", "replace") if collection.is_file() else ""))
        names -= {_COLLECTION, _SCRIPT} if listed else set()
        others = sorted(name for name in names if not (match := _OURS.fullmatch(name)) or match[1] not in listed)
        held = f"it holds {others[0]}" if others else ""
    if held:
        expected = "expected a new or empty folder, or a folder that walkers export has written"
        raise refused(place, f"{expected}; {held}")


def _listing(kind: str, version: str, entries: Sequence[str]) -> str:
    """Text of a VTK file that lists other files."""
    head = f'<VTKFile type="{kind}" version="{version}" byte_order="LittleEndian">\n  <{kind}>'
    return "\n".join(["<?xml version='1.0'?>", head, *entries, f"  </{kind}>", "</VTKFile>"])


def _named(arrays: Mapping[str, npt.NDArray[Any]]) -> dict[str, npt.NDArray[Any]]:
    """Arrays by their names with units."""
    return {f"{name} ({_UNITS[name]})" if name in _UNITS else name: one for name, one in arrays.items()}


def _frames(motion: Motion, every: int) -> Iterator[tuple[int, dict[str, pv.PolyData]]]:
    """Frames of the drive, each with its meshes ``beads``, ``boundary`` and, if recorded, ``bridges``."""
    recorded = read_bridges(motion)
    following = next(recorded, None)
    further = [one.point_data(motion) for one in analyses_of(motion.case)]
    walls = mesh_of(walls_of(motion))
    for frame in range(motion.first_driven, len(motion.time), every):
        while following is not None and following.frame < frame:
            following = next(recorded, None)
        meshes = {"beads": beads_at(motion, frame), "boundary": walls.translate(motion.substrate[frame])}
        if following is not None and following.frame == frame:
            for one in further:
                meshes["beads"].point_data.update(_named(one(following)))
            meshes["bridges"] = bridges_at(motion, following)
        yield frame, meshes


def beads_at(motion: Motion, frame: int) -> pv.PolyData:
    """Beads of a frame as points in the laboratory, SI units.

    Point data: ``bead`` and ``walker`` (indices from 0; -1 for no walker), ``radius (m)``, ``large``,
    ``omega (rad/s)``, and ``velocity (m/s)`` and ``speed (m/s)`` relative to the boundary.
    """
    import pyvista as pv

    mesh = pv.PolyData(motion.position[frame] + motion.substrate[frame])
    arrays: dict[str, npt.NDArray[Any]] = {
        "bead": np.arange(len(motion.radius)),
        "walker": motion.walker_of,
        "radius": motion.radius,
        "large": motion.large.astype(np.int64),
        "velocity": motion.velocity[frame],
        "speed": np.linalg.norm(motion.velocity[frame], axis=1),
        "omega": motion.spin[frame],
    }
    for name, values in _named(arrays).items():
        mesh.point_data[name] = np.ascontiguousarray(values)
    return mesh


def bridges_at(motion: Motion, bridges: Bridges) -> pv.PolyData:
    """Bridges of a frame as lines, from centre to centre, or from a centre to the nearest point of the wall.

    Cell data: ``bead_1`` and ``bead_2`` (indices from 0; -1 for a wall), ``wall`` (index; -1 for none), ``gap (m)``,
    ``normal_force (N)``, ``touching`` and ``walker`` (of the first bead).
    """
    import pyvista as pv

    centres, rows = motion.position[bridges.frame], bridges.rows()
    held, joined = centres[bridges.wall_beads], len(bridges.beads)
    feet = np.stack([held - wall.distances(held)[:, None] * wall.normals(held) for wall in motion.case.boundary.walls])
    walls = np.stack([held, feet[bridges.walls, np.arange(len(held))]], axis=1)
    pairs = np.stack([rows["bead_1"], rows["bead_2"]], axis=1)[:joined]
    ends = np.concatenate([centres[pairs], walls]) + motion.substrate[bridges.frame]
    mesh = pv.line_segments_from_points(ends.reshape(-1, 3))
    rows |= {"touching": rows["touching"].astype(np.int64), "walker": motion.walker_of[rows["bead_1"]]}
    mesh.cell_data.update(_named(rows))
    return mesh


def _script(motion: Motion, colour: str, folder: Path) -> str:
    scene = Scene.around(motion, camera_axes(motion), _AROUND)
    tall = scene.height(_WIDE)
    place, middle, up = scene.camera(10.0 * tall)
    # The scale of values that change in time ends at their 99th percentile.
    vectors = {"speed": motion.velocity, "velocity": motion.velocity, "omega": motion.spin}.get(colour)
    return rendered(
        "walkers.postprocess",
        "paraview.py.j2",
        title=motion.case.title or motion.case.name,
        name=_SCRIPT,
        collection=_COLLECTION,
        folder=str(folder),
        colour=next(iter(_named({colour: motion.radius}))),
        radius=next(iter(_named({"radius": motion.radius}))),
        has_unit=colour in _UNITS,
        largest=None if vectors is None else np.percentile(np.linalg.norm(vectors, axis=-1), 99.0),
        rounds=48 if len(motion.radius) < 100 else 24,
        neck=_NECK * float(motion.radius.min()),
        closed=motion.case.boundary.closed,
        tilted=motion.case.boundary.tilted,
        camera=(1e-3 * place).tolist(),
        middle=(1e-3 * middle).tolist(),
        up=up.tolist(),
        half=1e-3 * tall / 2.0,
    )
