"""Mesh files: which may be read, in which process, and what is said of those that cannot be read.

The reading itself is in `walkers.inputs.meshes.mesh_reader`, which runs in a process of its own.
What becomes of the triangles is in `walkers.inputs.meshes.mesh_surface`.
"""

from __future__ import annotations

import os
import re
import stat
import subprocess
import sys
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from walkers.inputs.meshes import mesh_reader

MOST_TRIANGLES = 20_000
"""Largest number of triangles of a vessel."""
MOST_BYTES = 64 << 20
"""Largest size of a mesh file, bytes: 20,000 triangles take 6 MB as text."""
_LONGEST_READING = 2.0 * mesh_reader.MOST_SECONDS
"""Time after which reading is ended, s: the machine may do other work, too."""
_LONGEST_REASON = 300
"""Largest number of letters of a reader's message that are quoted."""
_VTK_PROBLEM = re.compile(r"(?:ERR|WARN)\| *(.+)")
"""What VTK prints: ``(0.1s) [1A2B] vtkSTLReader.cxx:184 ERR| vtkSTLReader (0x55d0): …``."""
_VTK_OBJECT = re.compile(r"^\w+ \(0x[0-9a-f]+\): *")
"""The class and the address of an object of VTK, which precede its message."""
_VTK_REPETITION = "returned failure for request"
"""Part of a message of VTK that only says that an earlier one made the reading fail."""
_MESHIO_PROBLEM = re.compile(r"^(?:Error|ReadError): *(.+)$", re.MULTILINE)
"""What meshio prints: ``ReadError: …``."""
_COLOUR_CODE = re.compile(r"\x1b\[[0-9;]*m")
"""A code that changes the colour of the text in a terminal."""
_FORMATS = "STL, OBJ, PLY, OFF, VTP, VTU, VTK, or another format of meshio"
"""Formats that can be read, for messages."""


def read_mesh(path: Path) -> dict[str, Any]:
    """Points and triangles of a mesh file.

    Parameters
    ----------
    path : Path
        A file, whose ending names its format. VTK reads STL, OBJ, PLY, VTP, VTU and VTK, this
        project reads OFF, and meshio reads all other formats. Polygons are cut into triangles;
        lines, points and volumes are left out.

    Returns
    -------
    dict
        ``points``, in the unit of the file, and ``triangles``, the numbers of their corners from
        0 on.

    Raises
    ------
    ValueError
        If there is no such file, if it cannot be read, or if it has no or too many triangles.
    """
    _check_file(path)
    points, triangles = _read_in_process(path)
    if not 3 < len(triangles) <= MOST_TRIANGLES:
        expected = f"expected the inner surface of a vessel, 4 to {MOST_TRIANGLES}"
        cure = ": decimate the mesh" if len(triangles) > MOST_TRIANGLES else ""
        raise ValueError(f"has {len(triangles)} triangles; {expected}{cure}")
    return {"points": points.tolist(), "triangles": triangles.tolist()}


def _check_file(path: Path) -> None:
    """Raise `ValueError` if there is no file at the path, or if it is too large."""
    try:
        status = path.stat()
    except OSError as error:
        raise ValueError("no such file; expected a mesh, a path from the case file") from error
    if not stat.S_ISREG(status.st_mode):
        raise ValueError("is no file; expected a mesh, a path from the case file")
    if status.st_size > MOST_BYTES:
        size = f"{status.st_size / 1e6:.0f} MB"
        most = f"at most {MOST_BYTES / 1e6:.0f} MB, {MOST_TRIANGLES} triangles"
        raise ValueError(f"has {size}; expected {most}: decimate the mesh, or leave out its data")


def _read_in_process(path: Path) -> tuple[Any, Any]:
    """Points and triangles of a file, read by a process with limits of time and memory."""
    command = [sys.executable, "-P", "-m", mesh_reader.__name__, str(path.absolute())]
    try:
        reader = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            env=_environment_of_reader(),
            timeout=_LONGEST_READING,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise _unreadable(f"it takes more than {_LONGEST_READING:.0f} s") from error
    if reader.returncode == 0:
        arrays = np.load(BytesIO(reader.stdout))
        return arrays["points"], arrays["triangles"]
    raise _unreadable(_reason(reader))


def _environment_of_reader() -> dict[str, str]:
    """The environment of the process that reads, in which it finds this package."""
    paths = [str(Path(__file__).parents[3])]
    if os.environ.get("PYTHONPATH"):
        paths.append(os.environ["PYTHONPATH"])
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "OMP_NUM_THREADS": "1"}


def _reason(reader: subprocess.CompletedProcess[bytes]) -> str:
    """Why a process has not read its file: its own words, those of a library, or its status."""
    reason = reader.stdout.decode("utf-8", "replace")
    if reader.returncode == mesh_reader.REFUSED:
        return reason
    printed = _printed_by_library(reader.stderr.decode("utf-8", "replace"))
    if printed:
        return printed
    if reader.returncode == mesh_reader.READ_NOTHING:
        return reason
    if reader.returncode < 0:
        return f"the reader was ended by signal {-reader.returncode}, as by a damaged file"
    return f"the reader ended with status {reader.returncode}"


def _unreadable(reason: str) -> ValueError:
    """The error of a file that cannot be read, with the reason on one line."""
    short = " ".join(reason.split())[:_LONGEST_REASON].rstrip(". ")
    expected = f"expected the surface of a vessel as {_FORMATS}"
    return ValueError(f"cannot be read: {short}; {expected}")


def _printed_by_library(text: str) -> str:
    """The first error or warning of VTK, or else of meshio; empty if there is none."""
    plain = _COLOUR_CODE.sub("", text)
    for message in _VTK_PROBLEM.findall(plain):
        if _VTK_REPETITION not in message:
            return _VTK_OBJECT.sub("", message)
    meshio_problem = _MESHIO_PROBLEM.search(plain)
    if meshio_problem is None:
        return ""
    return meshio_problem[1]
