"""Compare a finished run of LIGGGHTS with the second engine: the same start, samples and analysis.

`crosscheck` compares a case, `crosschecks` cases of all kinds.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from math import degrees, inf, sqrt
from pathlib import Path

import numpy as np
from scipy.spatial.distance import pdist

from walkers.api import run
from walkers.arrays import FloatArray
from walkers.inputs.case_building import build_case, changed_case
from walkers.inputs.reading import load_case, shipped
from walkers.inputs.tables.case import Case
from walkers.inputs.toml import read_toml
from walkers.postprocess.measure.gait import averages, measure_walk
from walkers.postprocess.measure.motion import Motion
from walkers.second_engine.engine import SecondEngine
from walkers.second_engine.lines import Line, Verdict

SPEED, GAIT, ORIENTATION = 1e-4, 1e-3, 0.1
"""Tolerances: velocities of walkers (relative); rotation and sliding, relative to the fastest of them; final
orientation (degrees)."""
SPEED_FLOOR = 2e-3
"""mm/s; smaller differences are always accepted, for walkers that hardly move."""
ONE = 0.01
"""Fraction of the smallest radius within which both motions count as the same."""
STARTS = 5
"""Number of starts of a pile in the documentation."""


def courses(first: Motion, second: Motion) -> Iterator[Line]:
    """When and how far two motions diverge; piles, which are chaotic, fail if they diverge in the first cycle."""
    case = first.case
    apart = np.linalg.norm(first.position - second.position, axis=-1).max(axis=1)
    over = np.flatnonzero(apart > ONE * float(first.radius.min()))
    times = first.time[[over[0] if len(over) else -1, -1]]
    together, cycles = (case.excitation.frequency * times).tolist()
    pile = case.mixture is not None
    name = f"start {case.run.seed}: " if pile else ""
    early = Verdict.FAIL if pile and together < min(1.0, cycles) else None
    yield Line(f"{name}cycles of the same motion", cycles, together, decided=early)
    yield Line(f"{name}largest distance of a bead", 0.0, 1e6 * float(apart.max()), unit="µm")


def crosscheck(
    case: Case,
    out: Path,
    without: Collection[str] = (),
    *,
    seeds: int = 1,
    progress: bool | None = None,
    engine: str | None = None,
) -> list[Line]:
    """Compare the run of a case with the second engine ``without`` some terms; for a pile, runs with several seeds.

    ``progress`` and ``engine`` are as for `walkers.run`.

    Examples
    --------
    >>> [line for line in crosscheck(load_case("fig1b"), tmp) if line.failed]
    []
    """
    cases = [
        changed_case(case, {"run.seed": case.run.seed + number} if number else {})
        for number in range(seeds)
    ]
    motions = [run(start, out, progress=progress, engine=engine).motion for start in cases]
    return cross_check(motions, without)


def cross_check(motions: Sequence[Motion], without: Collection[str] = ()) -> list[Line]:
    """Compare finished runs of a case, one per start, with the second engine without some terms."""
    seconds = [simulate(motion, without) for motion in motions]
    pile, names = motions[0].case.mixture is not None, [*measured(motions[0])]
    sides = ([[*measured(motion).values()] for motion in side] for side in (motions, seconds))
    numbers = [np.mean(side, axis=0).tolist() for side in sides]
    speeds = [
        abs(speed) for (_, unit), speed in zip(names, numbers[0], strict=True) if unit == "mm/s"
    ]
    lines = []
    for (quantity, unit), first, second in zip(names, *numbers, strict=True):
        allowed = {"mm/s": max(GAIT * max(speeds), SPEED_FLOOR), "°": ORIENTATION}.get(unit, inf)
        if quantity.startswith("velocity"):
            allowed = max(SPEED * abs(first), SPEED_FLOOR)
        if unit != "%" or first or second:
            lines.append(
                Line(
                    quantity,
                    first,
                    second,
                    inf if pile else allowed,
                    unit,
                    scale=None if pile else 1.0,
                )
            )
    check = f"{motions[0].case.name}: LIGGGHTS (expected) and the second engine (measured)"
    check += f" without {', '.join(without)}" if without else ""
    lines += [line for both in zip(motions, seconds, strict=True) for line in courses(*both)]
    return [replace(line, check=check) for line in lines]


def measured(motion: Motion) -> dict[tuple[str, str], float]:
    """Numbers of a motion by name and unit: means over the walkers of each make, of loose beads, or of a pile.

    The numbers of a pile are means over the second half of the drive.
    """
    if motion.case.mixture is not None:
        late = motion.select(slice(int(np.searchsorted(motion.time, motion.time[-1] / 2.0)), None))
        apart = (pdist(position) for position in late.position)
        radii = pdist(late.radius[:, None], lambda first, second: first[0] + second[0])
        touching = sum(int(np.sum(distances < radii)) for distances in apart)
        return {
            ("height of the beads", "mm"): 1e3 * float(late.position[..., 2].mean()),
            ("root mean square velocity", "mm/s"): 1e3
            * sqrt(float(np.sum(late.velocity**2, axis=-1).mean())),
            ("touching pairs per bead", ""): touching / late.position[..., 0].size,
        }
    if not motion.groups:
        displacement = (
            motion.radius**3 / np.sum(motion.radius**3) @ (motion.position[-1] - motion.position[0])
        )
        speeds = (1e3 * displacement / np.ptp(motion.time)).tolist()
        return {
            (f"centre of mass along {axis}", "mm/s"): speeds["xyz".index(axis)] for axis in "zyx"
        }
    numbers: dict[tuple[str, str], float] = {}
    for number, group in enumerate(motion.groups, 1):
        label = f" ({number})" if len(motion.groups) > 1 else ""
        beads = [f"bead {bead + 1}" for bead in range(len(group.radii))]
        contacts = [
            *beads,
            *(f"beads {first + 1}-{second + 1}" for first, second in group.make.pairs),
        ]
        numbers[f"velocity{label}", "mm/s"] = 1e3 * float(measure_walk(group)["velocity"].mean())
        gait, kinds = (
            averages(group),
            (("rotation", beads), ("sliding", contacts), ("open", contacts)),
        )
        for quantity, places in kinds:
            factor, unit = (100.0, "%") if quantity == "open" else (1e3, "mm/s")
            means = (factor * getattr(gait, quantity).mean(axis=0)).tolist()
            numbers |= {
                (f"{quantity} {place}{label}", unit): mean
                for place, mean in zip(places, means, strict=True)
            }
        numbers[f"orientation at the end{label}", "°"] = degrees(
            float(group.orientation[-1].mean())
        )
    return numbers


def with_cycles(case: Case, cycles: int) -> Case:
    """The case with a number of cycles in one segment, a third of them for settling.

    ``ValueError`` if samples are taken more rarely, or there would be too few.
    """
    rare = case.run.cycles_per_sample
    least = 3 * rare
    if cycles < least or cycles % rare:
        raise ValueError(
            f"expected at least {least}" + (f", a multiple of {rare}" if rare > 1 else "")
        )
    lengths = ("cycles", "most_cycles", "duration", "settling_cycles")
    run = {key: value for key, value in case.document.get("run", {}).items() if key not in lengths}
    return build_case(
        {**case.document, "run": {**run, "cycles": cycles}}, source=case.name, name=case.name
    )


def simulate(motion: Motion, without: Collection[str] = ()) -> Motion:
    """Repeat a run from its first frame, with its restarts, by the second engine without some terms."""
    first = np.concatenate([motion.position[:1], motion.velocity[:1], motion.spin[:1]], axis=-1)
    clock = round(float(motion.time[0]) / motion.case.run.time_step)
    engine = SecondEngine(motion.case, motion.radius, first[0], clock=clock, without=without)
    parts = [(first, np.zeros_like(motion.spin[:1])), *_advanced(engine, motion)]
    frames, spins = (np.concatenate([part[which] for part in parts]) for which in (0, 1))
    position, velocity, spin = (frames[..., column : column + 3] for column in (0, 3, 6))
    return replace(
        motion,
        position=position,
        velocity=velocity,
        spin=spin,
        mean_spin=spins if motion.groups else None,
    )


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


def crosschecks(out: Path) -> Iterator[Line]:
    """Run cases of all kinds in both engines; errors: see `crosscheck`."""
    for name, case in full_cases().items():
        for line in crosscheck(case, out, seeds=STARTS if case.mixture else 1):
            yield replace(line, quantity=f"{name}: {line.quantity}")


def full_cases() -> dict[str, Case]:
    """Walkers, climbers, clusters, other drives and walls, and a small pile."""
    alone = {"dimers.replicates": 2, "dimers.facing": "right"}
    walker, symmetric = (read_toml(shipped("case")[name]) for name in ("fig1b", "symmetric"))
    fan = {
        "arrangement": "fan",
        "radii": ["0.3 mm", "0.2 mm", "0.2 mm"],
        "angle": "20 deg",
        "replicates": 2,
    }
    clusters = {
        **{name: table for name, table in walker.items() if name != "dimers"},
        "clusters": [fan],
    }
    tones = [
        {"frequency": "80 Hz", "peak_acceleration": "4 g"},
        {"frequency": "160 Hz", "peak_acceleration": "3 g", "phase": "90 deg"},
    ]
    shorter = {
        "alignment from 30°": (load_case("fig1b", {"dimers.angle": "30 deg", **alone}), 40),
        "symmetric from 30°": (load_case("symmetric", {"dimers.angle": "30 deg", **alone}), 40),
        "fan of three": (build_case(clusters, name="fig1b"), 24),
        "two tones": (
            build_case({**symmetric, "drive": {"harmonics": tones}}, name="symmetric"),
            24,
        ),
        "slope of 5°": (load_case("fig1b", {"boundary.tilt": "5 deg"}), 24),
        "groove of 120°": (
            load_case("fig1b", {"boundary.shape": "groove", "boundary.opening": "120 deg"}),
            24,
        ),
        "climber": (load_case("climber"), 20),
        "cluster in a corner": (load_case("cluster"), 21),
        "pile-ci": (load_case("pile-ci"), 24),
    }
    whole = {name: load_case(name) for name in ("fig1b", "fig4a", "fig4b")}
    return whole | {name: with_cycles(case, cycles) for name, (case, cycles) in shorter.items()}
