"""Mesh files: what may be read, in which process, and what is said where it cannot be.

The reading itself is in `walkers.inputs.meshes.mesh_reader`, which runs in a process of its own. What becomes
of the triangles is in `walkers.inputs.meshes.mesh_surface`.
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
"""Triangles of a vessel at most."""
MOST_BYTES = 64 << 20
"""Size of a mesh file at most, bytes: 20,000 triangles take 6 MB as text."""
_LONGEST_READING = (
    2.0 * mesh_reader.MOST_SECONDS
)  # s; wall time, of a machine that does other work too
_LONGEST_REASON = 300  # letters of what a reader says
_EXPECTED = "expected the surface of a vessel as STL, OBJ, PLY, OFF, VTP, VTU, VTK, or another format of meshio"


def read_mesh(path: Path) -> dict[str, Any]:
    """Points and triangles of a mesh file.

    Parameters
    ----------
    path : Path
        A file, whose ending names its format. VTK reads STL, OBJ, PLY, VTP, VTU and VTK, meshio all other
        formats but OFF. Polygons are cut into triangles; lines, points and volumes are left out.

    Returns
    -------
    dict
        ``points``, in the unit of the file, and ``triangles``, the numbers of their corners from 0 on.

    Raises
    ------
    ValueError
        If there is no such file, if it cannot be read, or has no or too many triangles.
    """
    _check_file(path)
    points, triangles = _read_apart(path)
    if not 3 < len(triangles) <= MOST_TRIANGLES:
        expected = f"expected the inner surface of a vessel, 4 to {MOST_TRIANGLES}"
        cure = ": decimate the mesh" if len(triangles) > MOST_TRIANGLES else ""
        raise ValueError(f"has {len(triangles)} triangles; {expected}{cure}")
    return {"points": points.tolist(), "triangles": triangles.tolist()}


def _check_file(path: Path) -> None:
    """Refuse what is no file, or too large a one."""
    try:
        about = path.stat()
    except OSError as error:
        raise ValueError("no such file; expected a mesh, a path from the case file") from error
    if not stat.S_ISREG(about.st_mode):
        raise ValueError("is no file; expected a mesh, a path from the case file")
    if about.st_size > MOST_BYTES:
        size = f"{about.st_size / 1e6:.0f} MB"
        most = f"at most {MOST_BYTES / 1e6:.0f} MB, {MOST_TRIANGLES} triangles"
        raise ValueError(f"has {size}; expected {most}: decimate the mesh, or leave out its data")


def _read_apart(path: Path) -> tuple[Any, Any]:
    """Points and triangles of a file by a process with limits of time and memory."""
    package = str(Path(__file__).parents[3])
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(filter(None, [package, os.environ.get("PYTHONPATH")])),
        "OMP_NUM_THREADS": "1",
    }
    command = [sys.executable, "-P", "-m", mesh_reader.__name__, str(path.absolute())]
    try:
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            env=environment,
            timeout=_LONGEST_READING,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise _unreadable(f"it takes more than {_LONGEST_READING:.0f} s") from error
    if done.returncode == 0:
        arrays = np.load(BytesIO(done.stdout))
        return arrays["points"], arrays["triangles"]
    complaint = _said_by_reader(done.stderr.decode("utf-8", "replace"))
    reason = done.stdout.decode("utf-8", "replace")
    if done.returncode == mesh_reader.REFUSED:
        raise _unreadable(reason)
    if done.returncode == mesh_reader.READ_NOTHING:
        raise _unreadable(complaint or reason)
    if done.returncode < 0:
        raise _unreadable(
            complaint or f"the reader was ended by signal {-done.returncode}, as by a damaged file"
        )
    raise _unreadable(complaint or f"the reader ended with status {done.returncode}")


def _unreadable(reason: str) -> ValueError:
    short = " ".join(reason.split())[:_LONGEST_REASON].rstrip(". ")
    return ValueError(f"cannot be read: {short}; {_EXPECTED}")


def _said_by_reader(text: str) -> str:
    """The first error or warning that VTK or meshio has printed, without its place in their code."""
    plain = re.sub(r"\x1b\[[0-9;]*m", "", text)
    for line in re.findall(r"(?:ERR|WARN)\| *(.+)", plain):
        if "returned failure for request" not in line:
            return str(re.sub(r"^\w+ \(0x[0-9a-f]+\): *", "", line))
    for line in re.findall(r"^(?:Error|ReadError): *(.+)$", plain, flags=re.MULTILINE):
        return str(line)
    return ""
