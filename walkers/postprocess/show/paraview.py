"""Files for ParaView by meshio: beads, boundary and bridges of each frame, with their times.

A ``.pvd`` file lists them with their times (s). Names of arrays end with their units, as in
``speed (m/s)``; indices and numbers have none. ``show.py`` shows the files in ParaView; the
``.pvd`` also holds the view of the run, for this script.
"""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np

from walkers.errors import check_limits
from walkers.files import VTK_SCRATCH, scratch_folder
from walkers.postprocess.measure import piles
from walkers.postprocess.measure.clusters import connected
from walkers.postprocess.measure.motion import Bridges, Motion, read_bridges, read_motion
from walkers.postprocess.show.camera import CAMERA_DISTANCE, camera_axes
from walkers.postprocess.show.export_folder import files_of_earlier_export, filled_folder
from walkers.postprocess.show.meshes import mesh_of, walls_of
from walkers.postprocess.show.necks import bridge_ends
from walkers.postprocess.show.scene import Scene, gathered

if TYPE_CHECKING:
    import meshio

SCRIPT = "show.py"
"""Name of the script that shows an export."""
_COLLECTION = "walkers.pvd"
"""Name of the file that lists the others."""
_LISTED = re.compile(r'file="((?:beads|boundary|bridges)_\d+\.vtu)"')
"""A file of ours in the list."""
_ASPECT = 16.0 / 9.0
"""Width over height of the view."""
_EXTENT_FACTOR = 1.15
"""Extent of the view over that of the motion."""
_NECK = 0.45
"""Drawn radius of a bridge over the radius of the smallest bead."""
_FASTEST = 99.0
"""Percentile of the speeds at which the scale of colours ends."""
_FEW_BEADS = 100
"""Beads that are fewer than this are drawn finely."""
_FINE_BALL = 48
"""Points around a ball that is drawn finely."""
_COARSE_BALL = 24
"""Points around another ball."""


def write_vtk(
    directory: Path, destination: Path | None = None, *, every: int | None = None
) -> Path:
    """Write a run for ParaView, with a script that shows it.

    Each frame has the blocks ``beads``, ``boundary`` and, if they were recorded in it, ``bridges``;
    independent walkers are side by side.

    Parameters
    ----------
    directory
        A run directory.
    destination
        The folder to write; None: ``vtk`` in the run directory.
    every
        Write every ``every``-th sample of the drive; None: one per cycle, or all samples if they
        are further apart.

    Returns
    -------
    Path
        The ``.pvd`` file, which lists the others with their times, s.

    Raises
    ------
    InputError
        Unless the destination is new, empty, or has no files but those that its ``walkers.pvd``
        lists; also if it is a symbolic link.
    """
    check_limits("every", every, 1, whole=True)
    destination = destination or directory / "vtk"
    earlier_files = files_of_earlier_export(destination, _names_of_export(destination))
    motion = _shown_motion(directory)
    with filled_folder(destination, earlier_files, VTK_SCRATCH) as new:
        listed = _write_frames(new, motion, _frames_to_write(motion, every))
        _write_collection(new, motion, listed)
    return destination / _COLLECTION


class GrowingVtk:
    """A folder of VTK files to which the frames of a run are added while the run goes on.

    Files are written elsewhere and renamed, the ``.pvd`` last: whoever reads it finds all files
    that it lists.

    Parameters
    ----------
    destination, every
        As of `write_vtk`.

    Attributes
    ----------
    collection
        The ``.pvd`` file.
    frames
        Number of frames that are written.

    Raises
    ------
    InputError
        If `write_vtk` would refuse the destination.
    """

    def __init__(self, destination: Path, *, every: int | None = None) -> None:
        check_limits("every", every, 1, whole=True)
        self.collection = destination / _COLLECTION
        self.frames = 0
        self._folder = destination
        self._every = every
        self._earlier_files = files_of_earlier_export(destination, _names_of_export(destination))
        self._listed: list[dict[str, str]] = []

    def grow(self, directory: Path) -> None:
        """Add the frames that are not written yet.

        Parameters
        ----------
        directory
            A measured run directory with all frames so far.
        """
        motion = read_motion(directory)
        frames = _frames_to_write(motion, self._every)
        self._add(motion, frames[self.frames :])

    def finish(self, directory: Path) -> None:
        """Write all frames again: which clusters climb is known when the run has ended.

        Parameters
        ----------
        directory
            The directory of the finished run.
        """
        self._listed = []
        motion = _shown_motion(directory)
        self._add(motion, _frames_to_write(motion, self._every))

    def _add(self, motion: Motion, frames: Sequence[int]) -> None:
        """Write frames into the folder, and list them."""
        if self.frames:
            with scratch_folder(self._folder.absolute().parent, VTK_SCRATCH) as new:
                self._write(new, motion, frames)
                for path in new.iterdir():
                    if path.name != _COLLECTION:
                        path.replace(self._folder / path.name)
                (new / _COLLECTION).replace(self.collection)
        else:
            with filled_folder(self._folder, self._earlier_files, VTK_SCRATCH) as new:
                self._write(new, motion, frames)
        self.frames = len(_frames_to_write(motion, self._every))

    def _write(self, folder: Path, motion: Motion, frames: Sequence[int]) -> None:
        """Write frames and the list of these and the earlier ones into a new folder."""
        self._listed += _write_frames(folder, motion, frames)
        _write_collection(folder, motion, self._listed)


def _shown_motion(directory: Path) -> Motion:
    """The motion of a finished run; walkers of an open floor are side by side."""
    motion = read_motion(directory)
    if motion.case.boundary.is_open_floor:
        return gathered(motion)
    return motion


def _frames_to_write(motion: Motion, every: int | None) -> range:
    """Every ``every``-th frame of the drive; None: one per cycle, or all if these are rarer."""
    step = every or motion.case.run.samples_per_cycle
    return range(motion.first_driven, len(motion.time), step)


def _names_of_export(folder: Path) -> set[str]:
    """Names of the files of an export in a folder, as its .pvd lists them; none without a .pvd."""
    collection = folder / _COLLECTION
    if not collection.is_file():
        return set()
    listed = _LISTED.findall(collection.read_text("utf-8", "replace"))
    if not listed:
        return set()
    return {_COLLECTION, SCRIPT, *listed}


def _write_frames(folder: Path, motion: Motion, frames: Sequence[int]) -> list[dict[str, str]]:
    """Write frames of a motion, and return the entries of their files in the ``.pvd``."""
    listed = []
    for frame, meshes in _frames(motion, frames):
        for part, (kind, mesh) in enumerate(meshes.items()):
            name = f"{kind}_{frame:06d}.vtu"
            mesh.write(folder / name)
            entry = {
                "timestep": repr(float(motion.time[frame])),
                "part": str(part),
                "name": kind,
                "file": name,
            }
            listed.append(entry)
    return listed


def _write_collection(folder: Path, motion: Motion, listed: Sequence[dict[str, str]]) -> None:
    """Write the ``.pvd`` that lists the files of a motion, and the script beside it."""
    root = ElementTree.Element(
        "VTKFile", type="Collection", version="0.1", byte_order="LittleEndian"
    )
    root.set("view", json.dumps(_view(motion.driven)))
    collection = ElementTree.SubElement(root, "Collection")
    for entry in listed:
        ElementTree.SubElement(collection, "DataSet", entry)
    ElementTree.indent(root)
    ElementTree.ElementTree(root).write(folder / _COLLECTION)
    shutil.copyfile(Path(__file__).with_name("show.py.txt"), folder / SCRIPT)


def _frames(motion: Motion, frames: Sequence[int]) -> Iterator[tuple[int, dict[str, meshio.Mesh]]]:
    """Frames, each with its meshes ``beads``, ``boundary`` and, if there are any, ``bridges``."""
    tracks = piles.tracks_of(motion) if piles.applies(motion.case) else None
    walls = _walls(motion)
    recorded = read_bridges(motion, frames)
    bridges = next(recorded, None)
    for frame in frames:
        boundary = walls.copy()
        boundary.points += motion.substrate[frame]
        meshes = {"beads": _beads(motion, frame), "boundary": boundary}
        if bridges is not None and bridges.frame == frame:
            if tracks is not None:
                track, is_climber = tracks
                meshes["beads"].point_data |= {
                    "component": connected(len(motion.radius), bridges.beads),
                    "track": track[frame].astype(np.int64),
                    "is_climber": is_climber[frame].astype(np.int64),
                }
            if len(bridges):  # meshio does not read empty arrays
                meshes["bridges"] = _bridges(motion, bridges)
            bridges = next(recorded, None)
        yield frame, meshes


def _beads(motion: Motion, frame: int) -> meshio.Mesh:
    """Beads of a frame as vertices in the laboratory, SI units.

    Point data: ``bead`` and ``walker`` (indices from 0; -1 for no walker), ``radius (m)``,
    ``large``, ``omega (rad/s)``, and ``velocity (m/s)`` and ``speed (m/s)`` relative to the
    boundary.
    """
    import meshio

    beads = np.arange(len(motion.radius))
    velocity = motion.velocity[frame]
    arrays = {
        "bead": beads,
        "walker": motion.walker_of,
        "large": motion.large.astype(np.int64),
        "radius (m)": motion.radius,
        "omega (rad/s)": motion.spin[frame],
        "velocity (m/s)": velocity,
        "speed (m/s)": np.linalg.norm(velocity, axis=1),
    }
    points = motion.position[frame] + motion.substrate[frame]
    return meshio.Mesh(points, {"vertex": beads[:, None]}, arrays)


def _bridges(motion: Motion, bridges: Bridges) -> meshio.Mesh:
    """Bridges of a frame as lines between centres, or from a centre to the nearest point of a wall.

    Cell data: ``bead_1`` and ``bead_2`` (indices from 0; -1 for a wall), ``wall`` (index; -1 for
    none), ``gap (m)``, ``normal_force (N)``, ``touching`` and ``walker`` (of the first bead).
    """
    import meshio

    rows = bridges.rows()
    arrays = {
        "bead_1": rows["bead_1"],
        "bead_2": rows["bead_2"],
        "wall": rows["wall"],
        "gap (m)": rows["gap"],
        "normal_force (N)": rows["normal_force"],
        "touching": rows["touching"].astype(np.int64),
        "walker": motion.walker_of[rows["bead_1"]],
    }
    ends = bridge_ends(motion, motion.position[bridges.frame], bridges.contacts)
    points = np.concatenate([ends.first, ends.second]) + motion.substrate[bridges.frame]
    lines = np.arange(len(points)).reshape(2, -1).T
    cell_data = {name: [array] for name, array in arrays.items()}
    return meshio.Mesh(points, {"line": lines}, cell_data=cell_data)


def _walls(motion: Motion) -> meshio.Mesh:
    """The walls as triangles; two walls share no points."""
    import meshio

    walls = mesh_of(walls_of(motion)).triangulate()
    return meshio.Mesh(np.asarray(walls.points), {"triangle": walls.regular_faces})


def _view(motion: Motion) -> dict[str, Any]:
    """Settings of the script: colours (by walker; without walkers by speed), sizes, camera (m)."""
    scene = Scene.around(motion, camera_axes(motion), _EXTENT_FACTOR)
    height = scene.height(_ASPECT)
    camera, middle, up = scene.camera(CAMERA_DISTANCE * height)
    colour = "walker"
    largest = None
    if not motion.walkers:
        colour = "speed (m/s)"
        largest = float(np.percentile(np.linalg.norm(motion.velocity, axis=-1), _FASTEST))
    return {
        "colour": colour,
        "largest": largest,
        "neck": _NECK * float(motion.radius.min()),
        "rounds": _FINE_BALL if len(motion.radius) < _FEW_BEADS else _COARSE_BALL,
        "closed": motion.case.boundary.closed,
        "tilted": motion.case.boundary.tilted,
        "camera": (1e-3 * camera).tolist(),
        "middle": (1e-3 * middle).tolist(),
        "up": up.tolist(),
        "half": 1e-3 * height / 2.0,
    }
