"""YADE beside LIGGGHTS: a third engine, for contact law and integration.

YADE (V. Angelidakis et al., Comput. Phys. Commun. 304 (2024) 109293, doi 10.1016/j.cpc.2024.109293) has been written
by others and for other ends. What of a run is its own and what is added says
`walkers.studies.crosscheck.yade_script`, which it runs.
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from shutil import copy, which
from typing import Any

import numpy as np

from walkers.inputs.case import Case
from walkers.inputs.errors import WalkersError
from walkers.postprocess.motion import Motion
from walkers.studies.crosscheck import yade_script
from walkers.studies.crosscheck.comparison import (
    Compared,
    Simulated,
    Tolerances,
    described_rows,
    parting_of,
    told_apart,
    walker_rows,
)
from walkers.studies.crosscheck.kernels import FloatArray
from walkers.studies.crosscheck.laws import Laws
from walkers.studies.crosscheck.setup import matter_of, surroundings_of

PROGRAMS = ("yade", "yadedaily")
INSTALL_COMMAND = "sudo apt-get install yade"
TOLERANCES = Tolerances(speed=0.01, gait=0.01, orientation=0.5)
"""Of YADE, whose contacts differ from LIGGGHTS's in three ways (docs/explanation/crosscheck.md): more than twice what
the cases there then differ by at most, 0.31 % and 0.40 % (climber)."""


@dataclass(frozen=True, kw_only=True)
class YadeComparison(Compared):
    """A walker of a run beside YADE; ``seconds`` is the wall time of that, s."""

    seconds: float

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON types, units with the numbers."""
        return {**super().as_dict(), "tolerances": asdict(TOLERANCES), "seconds": {"yade": self.seconds}}

    def described(self) -> str:
        """In a few lines."""
        case = self.case
        first = f"{case.name}: {case.drive.described()}, {case.run.cycles} cycles; the first walker in YADE"
        last = f"YADE took {self.seconds:.0f} s; allowed: {TOLERANCES.described()}"
        return "\n".join([first, *described_rows(self.rows, "YADE"), f"  {told_apart(self.parting)}", f"  {last}"])


class YadeFailure(WalkersError):
    """YADE ended without its frames."""


def find_program() -> str | None:
    """YADE on this machine; None if it is not installed."""
    return next((found for found in map(which, PROGRAMS) if found), None)


def check_case(case: Case) -> None:
    """Refuse what YADE is not asked for.

    Raises
    ------
    ValueError
        If beads are not walkers alone, or a wall is not flat and normal to x, y or z.
    """
    if not case.apart or not case.run.in_one:
        raise ValueError("expected walkers that do not meet, in a run of one segment: no pile, no single beads")
    walls_of(case)


def walls_of(case: Case) -> list[dict[str, float]]:
    """The walls: axis (0 to 2), place along it (m), side (±1) on which the beads are.

    Raises
    ------
    ValueError
        If one is not flat and normal to an axis.
    """
    faces = [(face, face.normal) for face in case.boundary.faces()]
    if any(face.of or max(map(abs, normal)) < 1.0 - 1e-12 for face, normal in faces):
        raise ValueError("boundary: expected flat walls that are normal to x, y or z")
    axes = [int(np.argmax(np.abs(normal))) for _, normal in faces]
    return [
        {"axis": axis, "place": float(face.centroid[axis]), "side": round(normal[axis])}
        for axis, (face, normal) in zip(axes, faces, strict=True)
    ]


def first_walkers(motion: Motion) -> Motion:
    """The first walker of each make alone: in YADE a walker takes some thirty times as long as in LIGGGHTS."""
    walkers = tuple({walker.make: walker for walker in reversed(motion.walkers)}.values())
    rows = np.array([bead - motion.first_id for walker in walkers for bead in walker.beads])
    arrays: dict[str, Any] = {name: getattr(motion, name)[:, rows] for name in ("position", "velocity", "spin")}
    mean_spin = None if motion.mean_spin is None else motion.mean_spin[:, rows]
    renumbered, first = [], motion.first_id
    for walker in walkers:
        renumbered.append(replace(walker, beads=tuple(range(first, first + len(walker.beads)))))
        first += len(walker.beads)
    return replace(motion, **arrays, mean_spin=mean_spin, radius=motion.radius[rows], walkers=tuple(renumbered))


def numbers_of(motion: Motion) -> dict[str, Any]:
    """What the script reads: SI units, the first frame of a motion, and the steps at which there are further ones.

    Raises
    ------
    ValueError
        If a wall is not flat and normal to an axis.
    """
    case = motion.case
    around = surroundings_of(case)
    steps = np.rint(motion.time / case.run.time_step).astype(np.int64)
    return {
        **asdict(matter_of(case)),
        "time_step": case.run.time_step,
        "first_step": int(steps[0]),
        "records": (steps[1:] - steps[0]).tolist(),
        "walls": walls_of(case),
        "wall_copies": Laws().wall_copies,
        "gravity": list(around.gravity),
        "harmonics": [] if around.harmonics is None else around.harmonics.tolist(),
        "radius": motion.radius.tolist(),
        **{name: getattr(motion, name)[0].tolist() for name in ("position", "velocity", "spin")},
    }


def frames_by(program: str, numbers: dict[str, Any]) -> FloatArray:
    """Let YADE run: position, velocity, spin and mean spin, shape (F, N, 12).

    Raises
    ------
    YadeFailure
        If it leaves no frames, or others than were asked for.
    """
    # YADE has a Python of its own, which is not to find the packages of ours.
    surroundings = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "VIRTUAL_ENV"))}
    with tempfile.TemporaryDirectory(prefix="walkers-yade-") as folder:
        script = copy(yade_script.__file__, Path(folder) / "script.py")
        (Path(folder) / "numbers.json").write_text(json.dumps(numbers), "utf-8")
        done = subprocess.run(
            [program, "-n", "-x", "-j", "1", str(script)],
            cwd=folder,
            env=surroundings,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )
        frames = Path(folder) / "frames.bin"
        if done.returncode or not frames.is_file():
            told = (done.stderr.strip() or done.stdout.strip() or "nothing").splitlines()[-1]
            raise YadeFailure(f"{program} ended with status {done.returncode}; its last words: {told}")
        found = np.fromfile(frames)
    shape = (len(numbers["records"]), len(numbers["radius"]), 12)
    if found.size != np.prod(shape):
        raise YadeFailure(f"{program} left {found.size} numbers where {np.prod(shape)} were expected")
    return found.reshape(shape)


def simulate_by(program: str, motion: Motion) -> Simulated:
    """Move the beads of a run's first frame by YADE for as long as the run was.

    Raises
    ------
    ValueError
        If a wall is not flat and normal to an axis.
    YadeFailure
        If it leaves no frames.
    """
    began = time.perf_counter()
    frames = frames_by(program, numbers_of(motion))
    seconds = time.perf_counter() - began
    start = [getattr(motion, name)[:1] for name in ("position", "velocity", "spin")]
    whole = np.concatenate([np.concatenate([*start, np.zeros_like(start[0])], axis=-1), frames])
    names = ("position", "velocity", "spin", "mean_spin")
    changes: dict[str, Any] = {name: whole[..., 3 * at : 3 * at + 3] for at, name in enumerate(names)}
    made = replace(motion, **changes)
    return Simulated(made, None, seconds)


def compare_with_yade(motion: Motion, program: str) -> YadeComparison:
    """Compare the first walker of a finished run with YADE.

    Parameters
    ----------
    motion
        Of the run.
    program
        YADE, as `find_program` has it.

    Raises
    ------
    ValueError
        If a wall is not flat and normal to an axis.
    YadeFailure
        If it leaves no frames.
    """
    alone = first_walkers(motion)
    made = simulate_by(program, alone)
    rows = tuple(walker_rows(alone, made, TOLERANCES))
    return YadeComparison(case=motion.case, rows=rows, parting=parting_of(alone, made.motion), seconds=made.seconds)
