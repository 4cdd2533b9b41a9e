"""A finished run of LIGGGHTS beside the second engine: the same start, the same samples, the same analysis."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from itertools import pairwise
from math import degrees, inf, isfinite
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree
from scipy.stats import ks_2samp

from walkers.check.engine import TERMS, Beads, SecondEngine, engine_at
from walkers.check.kernels import FloatArray
from walkers.inputs.case import Case, settling_of
from walkers.pipeline import Run, run
from walkers.postprocess.gait import averages, walk
from walkers.postprocess.motion import Group, Motion

SPEED, GAIT, ORIENTATION = 1e-4, 1e-3, 0.1
"""How far the second engine may differ: relative, of walkers' velocities; of rotation and sliding, relative to the
fastest of them (of small differences these are, where contacts open); at the end, in degrees."""
SPEED_FLOOR = 2e-3
"""mm/s, of walkers that hardly move: differences that are always allowed."""
ONE = 0.01
"""Of the smallest radius: places that are no farther apart are those of one motion."""
SIGNIFICANCE = 0.01
"""Distributions differ if a Kolmogorov-Smirnov test says so with a smaller p …"""
FEWEST_SEEDS = 5
"""… which it can from so many starts on."""


@dataclass(frozen=True)
class Row:
    """A number of both engines: LIGGGHTS's, and the second engine's at the same samples.

    They may differ by ``tolerance``, which is infinite where nothing is judged; ``p`` says how probable such a
    difference is between starts of one distribution, None of what has no distribution.
    """

    name: str
    unit: str
    first: float
    second: float
    tolerance: float = inf
    p: float | None = None

    @property
    def relative(self) -> float:
        """Difference over the first; infinite where that is 0."""
        return (self.second - self.first) / self.first if self.first else inf

    @property
    def agrees(self) -> bool:
        """Whether they differ by no more than that."""
        return abs(self.second - self.first) <= self.tolerance

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON types."""
        tolerance = self.tolerance if isfinite(self.tolerance) else None
        return {**asdict(self), "tolerance": tolerance, "agrees": self.agrees}


@dataclass(frozen=True)
class Start:
    """Both motions from one start."""

    first: Motion
    second: Motion

    @cached_property
    def apart(self) -> FloatArray:
        """Largest distance of a bead in one from itself in the other, m, of each frame."""
        return np.asarray(np.linalg.norm(self.first.position - self.second.position, axis=-1).max(axis=1))

    @property
    def together(self) -> float | None:
        """Cycles of the drive after which they are no longer one; None if they are to the end."""
        over = np.flatnonzero(self.apart > ONE * float(self.first.radius.min()))
        return float(self.first.time[over[0]]) * self.first.case.drive.frequency if len(over) else None

    def described(self) -> str:
        """How they part, in words."""
        cycles = self.together
        told = "one motion to the end" if cycles is None else f"one motion until cycle {cycles:.1f}"
        return f"{told}; places at most {self.apart.max() * 1e6:.2g} µm apart"


@dataclass(frozen=True)
class Comparison:
    """A case in both engines: numbers, the one to look at first (of a pile means over the starts), the runs, and the
    terms that the second engine left out.
    """

    case: Case
    rows: tuple[Row, ...]
    starts: tuple[Start, ...]
    without: tuple[str, ...]

    @property
    def disagreements(self) -> list[str]:
        """What differs by more than it may."""
        early = [
            f"start {one.first.case.seed}: apart before the first cycle"
            for one in self.starts
            if self.case.mixture is not None and one.together is not None and one.together < 1.0
        ]
        differing = [f"{row.name}: p = {row.p:.2g}" for row in self.rows if row.p is not None and row.p < SIGNIFICANCE]
        apart = [row.name for row in self.rows if not row.agrees]
        return apart + early + (differing if len(self.starts) >= FEWEST_SEEDS else [])

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON types, units with the numbers."""
        return {
            "case": self.case.name,
            "laws": [f"{term}=off" for term in self.without],
            "rows": [row.as_dict() for row in self.rows],
            "starts": [
                {
                    "seed": one.first.case.seed,
                    "cycles_together": one.together,
                    "largest_distance": float(one.apart.max()),
                }
                for one in self.starts
            ],
            "disagreements": self.disagreements,
        }


def crosscheck(
    case: Case,
    out: Path,
    without: Sequence[str] = (),
    *,
    seeds: int = 1,
    make: Callable[[Case, Path], Run] = run,
) -> Comparison:
    """Compare a case's run with the second engine.

    Parameters
    ----------
    case
        The case.
    out
        Folder of the run directories.
    without
        Terms that the second engine leaves out (`walkers.check.engine.TERMS`).
    seeds
        How many starts of a pile, from the case's seed on.
    make
        Makes the run of a case if it is missing.

    Raises
    ------
    runner.EngineFailure
        If the engine fails in one of the known ways.

    Examples
    --------
    >>> from walkers.inputs.reading import load_case
    >>> crosscheck(load_case("fig1b"), tmp).disagreements
    []
    """
    runs = [make(replace(case, seed=case.seed + number), out) for number in range(seeds)]
    return compare([one.motion for one in runs], without)


def compare(motions: Sequence[Motion], without: Sequence[str] = ()) -> Comparison:
    """Compare finished runs of a case with the second engine.

    Parameters
    ----------
    motions
        Of the runs: one, or of a pile one a start.
    without
        Terms that the second engine leaves out.
    """
    starts = tuple(Start(motion, simulate(motion, without)) for motion in motions)
    case, first, second = motions[0].case, starts[0].first, starts[0].second
    if case.mixture is not None:
        rows = _pile_rows(starts)
    else:
        rows = [] if first.groups else _drift(first, second)
        for number, groups in enumerate(zip(first.groups, second.groups, strict=True)):
            rows += _walker_rows(*groups, f" ({number + 1})" if len(first.groups) > 1 else "")
    return Comparison(case, tuple(rows), starts, tuple(term for term in TERMS if term in without))


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


def simulate(motion: Motion, without: Collection[str] = ()) -> Motion:
    """Move the beads of a run's first frame by the second engine for as long as the run was.

    Parameters
    ----------
    motion
        Of the run; where it went on from a restart file the second engine does as LIGGGHTS does there.
    without
        Terms that the second engine leaves out.
    """
    beads = Beads(motion.radius, motion.position[0], motion.velocity[0], motion.spin[0])
    engine = engine_at(motion.case, beads, round(float(motion.time[0]) / motion.case.run.time_step), without=without)
    first = np.concatenate([motion.position[:1], motion.velocity[:1], motion.spin[:1]], axis=-1)
    parts = [(first, np.zeros_like(motion.spin[:1])), *_moved(engine, motion)]
    frames, spins = (np.concatenate([part[which] for part in parts]) for which in (0, 1))
    position, velocity, spin = (frames[..., first : first + 3] for first in (0, 3, 6))
    return replace(motion, position=position, velocity=velocity, spin=spin, mean_spin=spins if motion.groups else None)


def _moved(engine: SecondEngine, motion: Motion) -> Iterator[tuple[FloatArray, FloatArray]]:
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
        dense = engine.run(length, 1 if motion.groups else every)
        frames = dense[every - 1 :: every].copy() if motion.groups else dense
        yield frames, dense[..., 6:].reshape(end - begin, -1, dense.shape[1], 3).mean(axis=1)


def _drift(first: Motion, second: Motion) -> list[Row]:
    """Mean velocity of the mass centre of beads that are no walkers'."""
    weights = first.radius**3 / np.sum(first.radius**3)
    speeds = [1e3 * weights @ (one.position[-1] - one.position[0]) / np.ptp(one.time) for one in (first, second)]
    allowed = max(GAIT * float(np.linalg.norm(speeds[0])), SPEED_FLOOR)
    return [
        Row(f"mass centre along {axis}", "mm/s", float(one), float(two), allowed)
        for axis, one, two in reversed(list(zip("xyz", *speeds, strict=True)))
    ]


def _walker_rows(first: Group, second: Group, label: str) -> list[Row]:
    """Velocity, rotation, sliding and open shares of a make's walkers, means over them."""
    speed, other = (1e3 * float(walk(one).velocity.mean()) for one in (first, second))
    beads = [f"bead {bead + 1}" for bead in range(len(first.radii))]
    contacts = [*beads, *(f"beads {one + 1}-{two + 1}" for one, two in first.make.pairs)]
    both = (averages(first), averages(second))

    def means(what: str, names: list[str], factor: float) -> list[tuple[str, float, float]]:
        one, two = ((factor * getattr(found, what).mean(axis=0)).tolist() for found in both)
        return [(f"{what} {name}{label}", *of) for name, *of in zip(names, one, two, strict=True)]

    found = [*means("rotation", beads, 1e3), *means("sliding", contacts, 1e3)]
    allowed = max(GAIT * max(abs(speed), *(abs(one) for _, one, _ in found)), SPEED_FLOOR)
    opened = [of for of in means("open", contacts, 100.0) if any(of[1:])]
    ends = [degrees(float(one.orientation[-1].mean())) for one in (first, second)]
    return [
        Row(f"velocity{label}", "mm/s", speed, other, max(SPEED * abs(speed), SPEED_FLOOR)),
        *(Row(name, "mm/s", one, two, allowed) for name, one, two in found),
        *(Row(name, "%", one, two) for name, one, two in opened),
        Row(f"orientation at the end{label}", "°", ends[0], ends[1], ORIENTATION),
    ]


def _pile_rows(starts: Sequence[Start]) -> list[Row]:
    """Means of piles over the second half of the drive, and whether they are distributed alike over the starts."""
    later = [(_later_half(one.first), _later_half(one.second)) for one in starts]
    measures: list[tuple[str, str, Callable[[Motion], float]]] = [
        ("height of the beads", "mm", lambda motion: 1e3 * float(motion.position[..., 2].mean())),
        ("root mean square velocity", "mm/s", lambda motion: 1e3 * _speed(motion)),
        ("touching pairs a bead", "", _touching),
    ]
    rows = []
    for name, unit, of in measures:
        first, second = ([of(pair[which]) for pair in later] for which in (0, 1))
        means = float(np.mean(first)), float(np.mean(second))
        rows.append(Row(name, unit, *means, p=probability(first, second)))
    return rows


def probability(first: Sequence[float], second: Sequence[float]) -> float:
    """How probable such a difference is if both are of one distribution: two-sample Kolmogorov-Smirnov test."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # where nothing differs there is no exact p
        return float(ks_2samp(first, second).pvalue)


def _later_half(motion: Motion) -> Motion:
    return motion.select(slice(int(np.searchsorted(motion.time, motion.time[-1] / 2.0)), None))


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
    case, laws = found.case, ", ".join(found.as_dict()["laws"]) or "as in the decks"
    lines = [f"{case.name}: {case.drive.described()}, {case.run.cycles} cycles; laws of the second engine: {laws}"]
    if case.mixture is not None:
        lines += [f"  start {one.first.case.seed}: {one.described()}" for one in found.starts]
        lines.append("  means over the second half of the drive, and over starts:")
    lines.append("  {:<28}{:<6}{:>12}{:>15}{:>10}".format("", "", "LIGGGHTS", "second engine", "ratio"))
    for row in found.rows:
        ratio = f"{row.second / row.first:.5f}" if abs(row.first) > 1e-3 else ""
        mark = "" if row.agrees else "  differs"
        p = "" if row.p is None else f"   p = {row.p:.2g}"
        lines.append(f"  {row.name:<28}{row.unit:<6}{row.first:>12.4f}{row.second:>15.4f}{ratio:>10}{p}{mark}")
    if case.mixture is None:
        lines.append(f"  {found.starts[0].described()}")
    elif len(found.starts) < FEWEST_SEEDS:
        told = f"a Kolmogorov-Smirnov test tells nothing below {SIGNIFICANCE}"
        lines.append(f"  (with fewer than {FEWEST_SEEDS} starts {told})")
    return "\n".join(lines)
