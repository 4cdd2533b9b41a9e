"""Compare a finished run of LIGGGHTS with the second engine: the same start, samples and analysis.

`crosscheck` compares a case, `crosschecks` cases of all kinds.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from math import degrees
from pathlib import Path
from typing import Any

import numpy as np

from walkers.api import Run, run
from walkers.check.engine import SecondEngine, close_pairs
from walkers.check.kernels import FloatArray
from walkers.check.lines import Line, Verdict
from walkers.inputs.case import Case
from walkers.inputs.reading import load_case, shipped
from walkers.inputs.toml import read_toml
from walkers.postprocess.gait import averages, walk
from walkers.postprocess.motion import Group, Motion

SPEED, GAIT, ORIENTATION = 1e-4, 1e-3, 0.1
"""Tolerances: velocities of walkers (relative); rotation and sliding, relative to the fastest of them; final
orientation (degrees)."""
SPEED_FLOOR = 2e-3
"""mm/s; smaller differences are always accepted, for walkers that hardly move."""
ONE = 0.01
"""Fraction of the smallest radius within which both motions count as the same."""
STARTS = 5
"""Number of starts of a pile in the documentation."""


@dataclass(frozen=True)
class Start:
    """Both motions from one start: LIGGGHTS's, and the second engine's at the same samples."""

    first: Motion
    second: Motion

    @cached_property
    def apart(self) -> FloatArray:
        """Largest distance between the positions of a bead in both motions, m, for each frame."""
        return np.asarray(np.linalg.norm(self.first.position - self.second.position, axis=-1).max(axis=1))

    @property
    def together(self) -> float:
        """Cycles of the drive during which both motions agree."""
        over = np.flatnonzero(self.apart > ONE * float(self.first.radius.min()))
        return self.first.case.excitation.frequency * float(self.first.time[over[0] if len(over) else -1])

    def lines(self) -> Iterator[Line]:
        """When and how far the motions diverge; piles, which are chaotic, fail if they diverge in the first cycle."""
        case = self.first.case
        pile = case.mixture is not None
        name = f"start {case.run.seed}: " if pile else ""
        cycles = case.excitation.frequency * float(self.first.time[-1])
        early = Verdict.FAIL if pile and self.together < min(1.0, cycles) else None
        yield Line(f"{name}cycles of the same motion", cycles, self.together, given=early)
        yield Line(f"{name}largest distance of a bead", 0.0, 1e6 * float(self.apart.max()), unit="µm")


def crosscheck(
    case: Case, out: Path, without: Sequence[str] = (), *, seeds: int = 1, make: Callable[[Case, Path], Run] = run
) -> list[Line]:
    """Compare the run of a case with the second engine; for a pile, runs with a number of ``seeds``.

    ``out`` is the folder of the run directories, ``without`` are terms that the second engine leaves out
    (`walkers.check.engine.TERMS`), ``make`` makes a missing run. `EngineFailure` if the engine fails.

    Examples
    --------
    >>> [line for line in crosscheck(load_case("fig1b"), tmp) if line.failed]
    []
    """
    cases = [case.changed({"run.seed": case.run.seed + number} if number else {}) for number in range(seeds)]
    return compare([make(one, out).motion for one in cases], without)


def compare(motions: Sequence[Motion], without: Collection[str] = ()) -> list[Line]:
    """Compare finished runs of a case, one per start, with the second engine without some terms."""
    starts = [Start(motion, simulate(motion, without)) for motion in motions]
    first, second = starts[0].first, starts[0].second
    if first.case.mixture is not None:
        lines = list(_pile_lines(starts))
    else:
        lines = [] if first.groups else list(_drift(first, second))
        for number, groups in enumerate(zip(first.groups, second.groups, strict=True)):
            lines += _walker_lines(*groups, f" ({number + 1})" if len(first.groups) > 1 else "")
    check = " without ".join([first.case.name, *([", ".join(without)] if without else [])])
    return [replace(line, check=check) for line in [*lines, *(line for start in starts for line in start.lines())]]


def shortened(case: Case, cycles: int) -> Case:
    """The case with a number of cycles in one segment, a third of them for settling.

    ``ValueError`` if samples are taken more rarely, or there would be too few.
    """
    rare = case.run.cycles_per_sample
    least = 3 * rare
    if cycles < least or cycles % rare:
        raise ValueError(f"expected at least {least}" + (f", a multiple of {rare}" if rare > 1 else ""))
    lengths = ("cycles", "most_cycles", "duration", "settling_cycles")
    run = {key: value for key, value in case.document.get("run", {}).items() if key not in lengths}
    return Case.read({**case.document, "run": {**run, "cycles": cycles}}, source=case.name, name=case.name)


def simulate(motion: Motion, without: Collection[str] = ()) -> Motion:
    """Repeat a run from its first frame, with its restarts, by the second engine without some terms."""
    first = np.concatenate([motion.position[:1], motion.velocity[:1], motion.spin[:1]], axis=-1)
    clock = round(float(motion.time[0]) / motion.case.run.time_step)
    engine = SecondEngine(motion.case, motion.radius, first[0], clock=clock, without=without)
    parts = [(first, np.zeros_like(motion.spin[:1])), *_advanced(engine, motion)]
    frames, spins = (np.concatenate([part[which] for part in parts]) for which in (0, 1))
    position, velocity, spin = (frames[..., column : column + 3] for column in (0, 3, 6))
    return replace(motion, position=position, velocity=velocity, spin=spin, mean_spin=spins if motion.groups else None)


def _advanced(engine: SecondEngine, motion: Motion) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Frames after the first and the mean spins since the frame before, in parts: cycles of walkers, else segments."""
    steps = np.rint(motion.time / motion.case.run.time_step).astype(np.int64)
    segments = [segment for segment, _ in motion.frames]
    if motion.groups:
        begins = list(range(1, len(steps), motion.case.run.samples_per_cycle))[1:]
    else:
        begins = [frame for frame in range(2, len(steps)) if segments[frame] != segments[frame - 1]]
    for begin, end in pairwise([1, *begins, len(steps)]):
        if segments[begin] != segments[begin - 1]:
            engine.evaluate()
        length = int(steps[end - 1] - steps[begin - 1])
        every = length // (end - begin)
        dense = engine.run(length, 1 if motion.groups else every)
        frames = dense[every - 1 :: every].copy() if motion.groups else dense
        yield frames, dense[..., 6:].reshape(end - begin, -1, dense.shape[1], 3).mean(axis=1)


def _drift(first: Motion, second: Motion) -> Iterator[Line]:
    """Mean velocity of the centre of mass of loose beads."""
    weights = first.radius**3 / np.sum(first.radius**3)
    speeds = [1e3 * weights @ (one.position[-1] - one.position[0]) / np.ptp(one.time) for one in (first, second)]
    allowed = max(GAIT * float(np.linalg.norm(speeds[0])), SPEED_FLOOR)
    for axis, one, two in reversed(list(zip("xyz", *speeds, strict=True))):
        yield Line(f"centre of mass along {axis}", float(one), float(two), allowed, "mm/s", scale=1.0)


def _walker_lines(first: Group, second: Group, label: str) -> Iterator[Line]:
    """Velocity, rotation, sliding and open shares of a make's walkers, means over them."""
    speed, other = (1e3 * float(walk(one).velocity.mean()) for one in (first, second))
    yield Line(f"velocity{label}", speed, other, max(SPEED * abs(speed), SPEED_FLOOR), "mm/s", scale=1.0)
    beads = [f"bead {bead + 1}" for bead in range(len(first.radii))]
    contacts = [*beads, *(f"beads {one + 1}-{two + 1}" for one, two in first.make.pairs)]
    both = averages(first), averages(second)

    def means(what: str, names: list[str], factor: float) -> list[tuple[str, float, float]]:
        one, two = ((factor * getattr(found, what).mean(axis=0)).tolist() for found in both)
        return [(f"{what} {name}{label}", *of) for name, *of in zip(names, one, two, strict=True)]

    found = [*means("rotation", beads, 1e3), *means("sliding", contacts, 1e3)]
    allowed = max(GAIT * max(abs(speed), *(abs(one) for _, one, _ in found)), SPEED_FLOOR)
    for name, one, two in found:
        yield Line(name, one, two, allowed, "mm/s", scale=1.0)
    for name, one, two in means("open", contacts, 100.0):
        if one or two:
            yield Line(name, one, two, unit="%")
    end, other = (degrees(float(one.orientation[-1].mean())) for one in (first, second))
    yield Line(f"orientation at the end{label}", end, other, ORIENTATION, "°", scale=1.0)


def _pile_lines(starts: Sequence[Start]) -> Iterator[Line]:
    """Means of piles over the second half of the drive and over the starts."""
    measures: dict[str, tuple[str, Callable[[Motion], Any]]] = {
        "height of the beads": ("mm", lambda motion: 1e3 * motion.position[..., 2].mean()),
        "root mean square velocity": (
            "mm/s", lambda motion: 1e3 * np.sqrt(np.mean(np.sum(motion.velocity**2, axis=-1))),
        ),
        "touching pairs per bead": ("", _touching),
    }  # fmt: skip

    def later(motion: Motion) -> Motion:
        return motion.select(slice(int(np.searchsorted(motion.time, motion.time[-1] / 2.0)), None))

    halves = [(later(start.first), later(start.second)) for start in starts]
    for name, (unit, of) in measures.items():
        values = np.array([[of(motion) for motion in both] for both in halves], dtype=np.float64)
        one, two = values.mean(axis=0).tolist()
        yield Line(name, one, two, unit=unit)


def _touching(motion: Motion) -> float:
    found = sum(len(close_pairs(position, motion.radius)) for position in motion.position)
    return found / len(motion.position) / len(motion.radius)


def crosschecks(out: Path, *, quick: bool = False) -> Iterator[Line]:
    """Run cases of all kinds in both engines, or only a short run of one walker; errors as of `crosscheck`."""
    for name, case in ({"fig1b": shortened(load_case("fig1b"), 6)} if quick else full_cases()).items():
        for line in crosscheck(case, out, seeds=STARTS if case.mixture else 1):
            yield replace(line, what=f"{name}: {line.what}")


def full_cases() -> dict[str, Case]:
    """Walkers, climbers, clusters, other drives and walls, and a small pile."""
    alone = {"dimers.replicates": 2, "dimers.facing": "right"}
    walker, symmetric = (read_toml(shipped("case")[name]) for name in ("fig1b", "symmetric"))
    fan = {"arrangement": "fan", "radii": ["0.3 mm", "0.2 mm", "0.2 mm"], "angle": "20 deg", "replicates": 2}
    clusters = {**{name: table for name, table in walker.items() if name != "dimers"}, "clusters": [fan]}
    tones = [
        {"frequency": "80 Hz", "peak_acceleration": "4 g"},
        {"frequency": "160 Hz", "peak_acceleration": "3 g", "phase": "90 deg"},
    ]
    shorter = {
        "alignment from 30°": (load_case("fig1b", {"dimers.angle": "30 deg", **alone}), 40),
        "symmetric from 30°": (load_case("symmetric", {"dimers.angle": "30 deg", **alone}), 40),
        "fan of three": (Case.read(clusters, name="fig1b"), 24),
        "two tones": (Case.read({**symmetric, "drive": {"harmonics": tones}}, name="symmetric"), 24),
        "slope of 5°": (load_case("fig1b", {"boundary.tilt": "5 deg"}), 24),
        "groove of 120°": (load_case("fig1b", {"boundary.shape": "groove", "boundary.opening": "120 deg"}), 24),
        "climber": (load_case("climber"), 20),
        "cluster in a corner": (load_case("cluster"), 21),
        "pile-ci": (load_case("pile-ci"), 24),
    }
    whole = {name: load_case(name) for name in ("fig1b", "fig4a", "fig4b")}
    return whole | {name: shortened(case, cycles) for name, (case, cycles) in shorter.items()}
