"""A finished run of LIGGGHTS beside the second engine: the same start, the same samples, the same analysis."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from math import degrees, isfinite
from typing import Any

import numpy as np
from scipy.spatial import cKDTree
from scipy.stats import ks_2samp

from walkers.check.engine import SecondEngine
from walkers.check.kernels import FloatArray
from walkers.check.laws import Laws
from walkers.check.setup import engine_of
from walkers.inputs.case import Case, settling_of
from walkers.postprocess.gait import Averages, averages, gait, walk
from walkers.postprocess.motion import Group, Motion

SPEED_FLOOR = 2e-6
"""m/s, of walkers that hardly move: differences that are always allowed."""
ONE = 0.01
"""Of the smallest radius: places that are no farther apart are those of one motion."""
SIGNIFICANCE = 0.01
"""Distributions differ if a Kolmogorov-Smirnov test says so with a smaller p …"""
FEWEST_SEEDS = 5
"""… which it can from so many starts on."""


@dataclass(frozen=True)
class Tolerances:
    """How far an engine may differ from LIGGGHTS.

    Attributes
    ----------
    speed
        Relative, of walkers' velocities.
    gait
        Of rotation and sliding, relative to the fastest of them: of small differences these are, where contacts open.
    orientation
        At the end, in degrees.
    """

    speed: float
    gait: float
    orientation: float

    def described(self) -> str:
        """In words."""
        gait = f"rotation and sliding {self.gait:.2%} of the fastest"
        return f"velocity {self.speed:.2%}, {gait}, orientation at the end {self.orientation:g}°"


TOLERANCES = Tolerances(speed=1e-4, gait=1e-3, orientation=0.1)
"""Of the second engine."""


@dataclass(frozen=True)
class Row:
    """A number of both engines.

    Attributes
    ----------
    name
        What it is.
    unit
        Of the numbers.
    first, second
        LIGGGHTS's, and the second engine's at the same samples.
    every_step
        The second engine's with every step a sample; None where that is no mean over samples.
    tolerance
        How far the two may differ; infinite where nothing is judged.
    """

    name: str
    unit: str
    first: float
    second: float
    every_step: float | None = None
    tolerance: float = float("inf")

    @property
    def relative(self) -> float:
        """Difference over the first; infinite where that is 0."""
        return (self.second - self.first) / self.first if self.first else float("inf")

    @property
    def agrees(self) -> bool:
        """Whether they differ by no more than that."""
        return abs(self.second - self.first) <= self.tolerance

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON types."""
        values = asdict(self)
        return {**values, "tolerance": self.tolerance if isfinite(self.tolerance) else None, "agrees": self.agrees}


@dataclass(frozen=True)
class Parting:
    """How two motions part.

    Attributes
    ----------
    time : ndarray, shape (F,)
        s.
    apart : ndarray, shape (F,)
        Largest distance of a bead in one from itself in the other, m.
    limit
        Distance up to which they are one, m.
    period
        Of a cycle, s.
    """

    time: FloatArray
    apart: FloatArray
    limit: float
    period: float

    @property
    def together(self) -> float | None:
        """Cycles of the drive after which they are no longer one; None if they are to the end."""
        over = np.flatnonzero(self.apart > self.limit)
        return float(self.time[over[0]]) / self.period if len(over) else None


@dataclass(frozen=True)
class Simulated:
    """What the second engine made of a run's start: the motion, each make's gait over all steps, its wall time (s)."""

    motion: Motion
    gaits: list[Averages] | None
    seconds: float


@dataclass(frozen=True, kw_only=True)
class Compared:
    """One run beside another engine.

    Attributes
    ----------
    case
        What was run.
    rows
        Numbers of both; of a pile none. The first is the one to look at.
    parting
        How their motions part.
    """

    case: Case
    rows: tuple[Row, ...]
    parting: Parting

    @property
    def disagreements(self) -> list[str]:
        """What differs by more than it may."""
        return [row.name for row in self.rows if not row.agrees]

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON types, units with the numbers."""
        return {
            "case": self.case.name,
            "rows": [row.as_dict() for row in self.rows],
            "cycles_together": self.parting.together,
            "largest_distance": float(self.parting.apart.max()),
            "disagreements": self.disagreements,
        }


@dataclass(frozen=True, kw_only=True)
class Comparison(Compared):
    """One run beside the second engine.

    Attributes
    ----------
    laws
        The second engine's.
    seconds
        Wall time of LIGGGHTS's steps (None if it made other runs with them) and of the second engine's, s.
    first, second
        The motions.
    """

    laws: Laws
    seconds: tuple[float | None, float]
    first: Motion
    second: Motion

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON types, units with the numbers."""
        return {
            **super().as_dict(),
            "seed": self.case.seed,
            "laws": self.laws.differences(),
            "seconds": {"liggghts": self.seconds[0], "second_engine": self.seconds[1]},
        }


def shortened(case: Case, cycles: int) -> Case:
    """The case for so many cycles at a stretch, a third of them to settle.

    Raises
    ------
    ValueError
        If samples are taken more rarely, or there would be too few.
    """
    rare = case.run.cycles_per_sample
    least = 3 * rare
    if cycles < least or cycles % rare:
        raise ValueError(
            f"expected at least {least}, a multiple of {rare}" if rare > 1 else f"expected at least {least}"
        )
    whole = case.run.cycles_per_segment >= case.run.cycles
    segment = cycles if whole else min(case.run.cycles_per_segment, cycles)
    run = replace(
        case.run, cycles=cycles, settling_cycles=settling_of(cycles), until_steady=False, cycles_per_segment=segment
    )
    return replace(case, run=run)


def simulate(motion: Motion, laws: Laws, every_step: bool = True) -> Simulated:
    """Move the beads of a run's first frame by the second engine for as long as the run was.

    Parameters
    ----------
    motion
        Of the run; where it went on from a restart file the second engine does as LIGGGHTS does there.
    laws
        Of the second engine.
    every_step
        Whether to average walkers' gait over all steps after the settling cycles.
    """
    engine = engine_of(motion, laws)
    averaging = _Averaging(motion) if every_step and motion.groups else None
    began = time.perf_counter()
    first = np.concatenate([motion.position[:1], motion.velocity[:1], motion.spin[:1]], axis=-1)
    parts = [(first, np.zeros_like(motion.spin[:1])), *_moved(engine, motion, averaging)]
    seconds = time.perf_counter() - began - (averaging.seconds if averaging else 0.0)
    frames, spins = (np.concatenate([part[which] for part in parts]) for which in (0, 1))
    made = _with_frames(motion, motion.time, frames, spins if motion.groups else None)
    return Simulated(made, averaging.means() if averaging else None, seconds)


def _moved(
    engine: SecondEngine, motion: Motion, averaging: _Averaging | None
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """The frames after the first and the mean spins since those before, in parts.

    Of walkers, whose spins are averaged over all steps, a part is a cycle; of other beads a segment of the run.
    """
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
        if not motion.groups:
            frames = engine.run(length, every)
            yield frames, np.zeros_like(frames[..., 6:])
            continue
        dense = engine.run(length, 1)
        if averaging:
            averaging.add(dense, int(steps[begin - 1]))
        spins = dense[..., 6:].reshape(end - begin, every, -1, 3).mean(axis=1)
        yield dense[every - 1 :: every].copy(), spins


class _Averaging:
    """Sums of the gait over all steps after the settling cycles."""

    def __init__(self, motion: Motion) -> None:
        self.motion = motion
        self.begin = motion.case.run.settling_cycles * motion.case.run.steps_per_cycle
        self.sums: list[list[FloatArray]] = []
        self.count, self.seconds = 0, 0.0

    def add(self, frames: FloatArray, begin: int) -> None:
        """A cycle's frames, each a step, after a step."""
        if begin < self.begin:
            return
        began = time.perf_counter()
        times = np.arange(begin + 1, begin + 1 + len(frames), dtype=np.float64) * self.motion.case.run.time_step
        gaits = [gait(group) for group in _with_frames(self.motion, times, frames, None).groups]
        sums = [[one.rotation.sum(0), one.sliding.sum(0), (one.gap > 0.0).sum(0, dtype=np.float64)] for one in gaits]
        old = self.sums or [[np.zeros_like(part) for part in one] for one in sums]
        self.sums = [[a + b for a, b in zip(one, two, strict=True)] for one, two in zip(old, sums, strict=True)]
        self.count += len(frames)
        self.seconds += time.perf_counter() - began

    def means(self) -> list[Averages]:
        """Of each make."""
        return [Averages(*(part / self.count for part in one)) for one in self.sums]


def _with_frames(motion: Motion, times: FloatArray, frames: FloatArray, mean_spin: FloatArray | None) -> Motion:
    return replace(
        motion,
        time=times,
        position=frames[..., :3],
        velocity=frames[..., 3:6],
        spin=frames[..., 6:],
        mean_spin=mean_spin,
    )


def parting_of(first: Motion, second: Motion) -> Parting:
    """How two motions of the same beads part."""
    apart = np.linalg.norm(first.position - second.position, axis=-1).max(axis=1)
    return Parting(first.time, apart, ONE * float(first.radius.min()), 1.0 / first.case.drive.frequency)


def compare(motion: Motion, laws: Laws, seconds: float | None, every_step: bool = True) -> Comparison:
    """Compare a run with the second engine.

    Parameters
    ----------
    motion
        Of the finished run.
    laws
        Of the second engine.
    seconds
        Wall time that LIGGGHTS took for its steps, s, if it is known.
    every_step
        Whether to average the gait over all steps, too.
    """
    made = simulate(motion, laws, every_step)
    rows = [] if motion.groups or motion.case.mixture else _drift(motion, made.motion)
    rows += walker_rows(motion, made)
    return Comparison(
        case=motion.case,
        rows=tuple(rows),
        parting=parting_of(motion, made.motion),
        laws=laws,
        seconds=(seconds, made.seconds),
        first=motion,
        second=made.motion,
    )


def walker_rows(motion: Motion, made: Simulated, allow: Tolerances = TOLERANCES) -> list[Row]:
    """What walkers did in a run, beside what an engine made of its start."""
    rows = []
    for number, (first, second) in enumerate(zip(motion.groups, made.motion.groups, strict=True)):
        label = f" ({number + 1})" if len(motion.groups) > 1 else ""
        rows += _rows(first, second, made.gaits[number] if made.gaits else None, label, allow)
    return rows


def _drift(first: Motion, second: Motion) -> list[Row]:
    """Mean velocity of the mass centre of beads that are no walkers'."""
    weights = first.radius**3 / np.sum(first.radius**3)
    speeds = [1e3 * weights @ (one.position[-1] - one.position[0]) / np.ptp(one.time) for one in (first, second)]
    allowed = max(TOLERANCES.gait * float(np.linalg.norm(speeds[0])), 1e3 * SPEED_FLOOR)
    return [
        Row(f"mass centre along {axis}", "mm/s", float(one), float(two), None, allowed)
        for axis, one, two in reversed(list(zip("xyz", *speeds, strict=True)))
    ]


def _rows(first: Group, second: Group, every_step: Averages | None, label: str, allow: Tolerances) -> list[Row]:
    """Velocity, rotation, sliding and open shares of a make's walkers, means over them."""
    speed, other = (1e3 * float(walk(one).velocity.mean()) for one in (first, second))
    rows = [Row(f"velocity{label}", "mm/s", speed, other, None, max(allow.speed * abs(speed), 1e3 * SPEED_FLOOR))]
    beads = [f"bead {bead + 1}" for bead in range(len(first.radii))]
    contacts = [*beads, *(f"beads {one + 1}-{two + 1}" for one, two in first.make.pairs)]
    both = (averages(first), averages(second))

    def means(what: str, names: list[str], factor: float) -> list[tuple[str, float, float, float | None]]:
        values = [(factor * getattr(one, what).mean(axis=0)).tolist() for one in both]
        dense = (factor * getattr(every_step, what).mean(axis=0)).tolist() if every_step else [None] * len(names)
        return [(f"{what} {name}{label}", *of) for name, *of in zip(names, *values, dense, strict=True)]

    found = [*means("rotation", beads, 1e3), *means("sliding", contacts, 1e3)]
    allowed = max(allow.gait * max(abs(speed), *(abs(one) for _, one, *_ in found)), 1e3 * SPEED_FLOOR)
    rows += [Row(name, "mm/s", one, two, of, allowed) for name, one, two, of in found]
    opened = [of for of in means("open", contacts, 100.0) if any(of[1:])]
    rows += [Row(name, "%", one, two, of) for name, one, two, of in opened]
    ends = [degrees(float(one.orientation[-1].mean())) for one in (first, second)]
    return [*rows, Row(f"orientation at the end{label}", "°", ends[0], ends[1], None, allow.orientation)]


@dataclass(frozen=True)
class Quantity:
    """One quantity of a pile in both engines, a value for each start."""

    name: str
    unit: str
    first: tuple[float, ...]
    second: tuple[float, ...]

    @property
    def p(self) -> float:
        """How probable such a difference is if both are from one distribution: two-sample Kolmogorov-Smirnov test."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # where nothing differs there is no exact p
            return float(ks_2samp(self.first, self.second).pvalue)


@dataclass(frozen=True)
class PileComparison:
    """Piles of several starts in both engines: each start's motions, and what is distributed over the starts."""

    starts: tuple[Comparison, ...]
    tests: tuple[Quantity, ...]

    @property
    def disagreements(self) -> list[str]:
        """What differs by more than it may."""
        together = [one.parting.together for one in self.starts]
        early = [
            f"start {one.case.seed}: apart before the first cycle"
            for one, cycles in zip(self.starts, together, strict=True)
            if cycles is not None and cycles < 1.0
        ]
        differing = [f"{one.name}: p = {one.p:.2g}" for one in self.tests if one.p < SIGNIFICANCE]
        return early + (differing if len(self.starts) >= FEWEST_SEEDS else [])

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON types."""
        return {
            "starts": [one.as_dict() for one in self.starts],
            "tests": [{**asdict(one), "p": one.p} for one in self.tests],
            "disagreements": self.disagreements,
        }


def compare_piles(motions: Sequence[Motion], laws: Laws, seconds: Sequence[float | None]) -> PileComparison:
    """Compare piles of one case and several starts with the second engine.

    Parameters
    ----------
    motions, seconds
        Of the finished runs, and the wall time that LIGGGHTS took for the steps of each, s.
    laws
        Of the second engine.
    """
    starts = tuple(compare(motion, laws, took, False) for motion, took in zip(motions, seconds, strict=True))
    measures: list[tuple[str, str, Callable[[Motion], float]]] = [
        ("height of the beads", "mm", lambda motion: 1e3 * _mean_height(motion)),
        ("root mean square velocity", "mm/s", lambda motion: 1e3 * _speed(motion)),
        ("touching pairs a bead", "", _touching),
    ]
    later = [(_later_half(motion), _later_half(one.second)) for motion, one in zip(motions, starts, strict=True)]
    tests = tuple(
        Quantity(name, unit, tuple(of(one) for one, _ in later), tuple(of(two) for _, two in later))
        for name, unit, of in measures
    )
    return PileComparison(starts, tests)


def _later_half(motion: Motion) -> Motion:
    """The second half of the drive."""
    return motion.part(slice(int(np.searchsorted(motion.time, motion.time[-1] / 2.0)), None))


def _mean_height(motion: Motion) -> float:
    return float(motion.position[..., 2].mean())


def _speed(motion: Motion) -> float:
    return float(np.sqrt(np.mean(np.sum(motion.velocity**2, axis=-1))))


def _touching(motion: Motion) -> float:
    """Pairs of beads that touch, over beads."""
    reach, radius, found = 2.0 * float(motion.radius.max()), motion.radius, 0
    for place in motion.position:
        near = cKDTree(place).query_pairs(reach, output_type="ndarray")
        apart = np.linalg.norm(place[near[:, 0]] - place[near[:, 1]], axis=1)
        found += int(np.sum(apart < radius[near].sum(axis=1)))
    return found / len(motion.position) / len(radius)


def describe(found: Comparison) -> str:
    """A comparison in a few lines."""
    case, laws = found.case, ", ".join(found.laws.differences()) or "as in the decks"
    lines = [f"{case.name}: {case.drive.described()}, {case.run.cycles} cycles; laws of the second engine: {laws}"]
    lines += described_rows(found.rows, "second engine")
    return "\n".join([*lines, f"  {told_apart(found.parting)}", f"  {_told_time(found)}"])


def described_rows(rows: Sequence[Row], engine: str) -> list[str]:
    """Numbers of LIGGGHTS and of another engine as a table, nothing of none."""
    if not rows:
        return []
    every_step = "every step" if any(row.every_step is not None for row in rows) else ""
    lines = ["  {:<28}{:<6}{:>12}{:>15}{:>10}{:>12}".format("", "", "LIGGGHTS", engine, "ratio", every_step).rstrip()]
    for row in rows:
        ratio = f"{row.second / row.first:.5f}" if abs(row.first) > 1e-3 else ""
        dense = "" if row.every_step is None else f"{row.every_step:.4f}"
        mark = "" if row.agrees else "  differs"
        lines.append(f"  {row.name:<28}{row.unit:<6}{row.first:>12.4f}{row.second:>15.4f}{ratio:>10}{dense:>12}{mark}")
    return lines


def describe_piles(found: PileComparison) -> str:
    """Piles of several starts in a few lines."""
    laws = ", ".join(found.starts[0].laws.differences()) or "as in the decks"
    case = found.starts[0].case
    lines = [f"{case.name}: {case.drive.described()}, {case.run.cycles} cycles; laws of the second engine: {laws}"]
    lines += [f"  start {one.case.seed}: {told_apart(one.parting)}" for one in found.starts]
    lines.append("  means over the second half of the drive, and over starts:")
    for one in found.tests:
        first, second = np.mean(one.first), np.mean(one.second)
        lines.append(f"  {one.name:<28}{one.unit:<6}{first:>12.4f}{second:>15.4f}   p = {one.p:.2g}")
    if len(found.starts) < FEWEST_SEEDS:
        lines.append(
            f"  (with fewer than {FEWEST_SEEDS} starts a Kolmogorov-Smirnov test tells nothing below {SIGNIFICANCE})"
        )
    return "\n".join([*lines, f"  {_told_time(*found.starts)}"])


def told_apart(parting: Parting) -> str:
    """How two motions part, in words."""
    cycles = parting.together
    told = "one motion to the end" if cycles is None else f"one motion until cycle {cycles:.1f}"
    return f"{told}; places at most {parting.apart.max() * 1e6:.2g} µm apart"


def _told_time(*found: Comparison) -> str:
    own = sum(one.seconds[1] for one in found)
    known = [one.seconds[0] for one in found if one.seconds[0] is not None]
    told = f"LIGGGHTS took {sum(known):.2f} s for its steps, the" if len(known) == len(found) else "the"
    return f"{told} second engine {'took ' if told == 'the' else ''}{own:.2f} s"
