"""Compare finished runs of LIGGGHTS with the second engine: the same start, samples and analysis.

`crosscheck` runs and compares one case, `compare_motions` compares finished runs, and
`crosscheck_examples` compares cases of all kinds. Forces on a few beads are compared in
`walkers.second_engine.scenes`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import degrees, inf, sqrt
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.spatial.distance import pdist

from walkers.api import run
from walkers.arrays import FloatArray
from walkers.inputs.case_building import build_case, changed_case
from walkers.inputs.reading import load_case, shipped
from walkers.inputs.tables.case import Case
from walkers.inputs.toml import read_toml
from walkers.postprocess.measure.gait import averages, measure_walk
from walkers.postprocess.measure.motion import Group, Motion
from walkers.second_engine.engine import SecondEngine
from walkers.second_engine.lines import Line, Verdict

VELOCITY_TOLERANCE = 1e-4
"""Largest error of the velocity of walkers that passes, relative to that velocity."""
GAIT_TOLERANCE = 1e-3
"""Largest error of rotation, sliding and other velocities that passes, relative to the fastest."""
SPEED_FLOOR = 2e-3
"""Error of a velocity that always passes, mm/s, for walkers that hardly move."""
ORIENTATION_TOLERANCE = 0.1
"""Largest error of an orientation at the end that passes, degrees."""
SAME_MOTION = 0.01
"""Distance between both positions of a bead, over the smallest radius, up to which two motions
count as the same."""
STARTS = 5
"""Number of random starts with which `crosscheck_examples` compares a pile."""

Judgement = Literal["walking", "gait", "orientation", "open contacts", "none"]
"""How a quantity is judged: by `VELOCITY_TOLERANCE`, `GAIT_TOLERANCE` or `ORIENTATION_TOLERANCE`,
or not at all. Shares of time with open contacts are left out if they are zero in both engines."""


@dataclass(frozen=True)
class ComparedQuantity:
    """A number that is measured on the motions of both engines.

    Attributes
    ----------
    name
        Name of the quantity in the printed lines.
    value
        Its value in ``unit``.
    unit
        Unit of the value, such as ``mm/s``; empty for a plain number.
    judgement
        How the difference between the engines is judged.
    """

    name: str
    value: float
    unit: str
    judgement: Judgement


def crosscheck(  # noqa: PLR0913 (keyword-only, and described below)
    case: Case,
    out: Path,
    without: Collection[str] = (),
    *,
    seeds: int = 1,
    progress: bool | None = None,
    engine: str | None = None,
) -> list[Line]:
    """Run a case with LIGGGHTS, if it is not finished, and compare it with the second engine.

    Parameters
    ----------
    case
        The case.
    out
        Folder of the run directories.
    without
        Terms that the second engine leaves out, see `walkers.second_engine.engine.TERMS`.
    seeds
        Number of runs with different random starts, at least 1; more than one for piles.
    progress, engine
        As for `walkers.run`.

    Returns
    -------
    list of Line
        LIGGGHTS gives the expected and the second engine the measured numbers.

    Examples
    --------
    >>> [line for line in crosscheck(load_case("fig1b"), tmp) if line.failed]
    []
    """
    motions = []
    for number in range(seeds):
        changes = {"run.seed": case.run.seed + number} if number else {}
        case_of_seed = changed_case(case, changes)
        motions.append(run(case_of_seed, out, progress=progress, engine=engine).motion)
    return compare_motions(motions, without)


def compare_motions(motions: Sequence[Motion], without: Collection[str] = ()) -> list[Line]:
    """Compare finished runs of one case with the second engine.

    Parameters
    ----------
    motions
        Motions of the runs by LIGGGHTS, one for each start.
    without
        Terms that the second engine leaves out.

    Returns
    -------
    list of Line
        First the quantities of `measured_quantities`, as means over the starts, then for each
        start the lines of `divergence_lines`. Quantities of piles, which are chaotic, are not
        judged.
    """
    case = motions[0].case
    simulated = [simulate(motion, without) for motion in motions]
    expected = _mean_quantities(motions)
    reproduced = _mean_quantities(simulated)
    speeds = [quantity.value for quantity in expected if quantity.unit == "mm/s"]
    fastest = max(abs(speed) for speed in speeds)
    lines = []
    for first, second in zip(expected, reproduced, strict=True):
        if first.judgement == "open contacts" and first.value == second.value == 0.0:
            continue
        line = Line(first.name, first.value, second.value, unit=first.unit)
        if case.mixture is None:
            line = replace(line, tolerance=_tolerance(first, fastest), scale=1.0)
        lines.append(line)
    for by_liggghts, by_second_engine in zip(motions, simulated, strict=True):
        lines += divergence_lines(by_liggghts, by_second_engine)
    check = f"{case.name}: LIGGGHTS (expected) and the second engine (measured)"
    if without:
        check += f" without {', '.join(without)}"
    return [replace(line, check=check) for line in lines]


def _mean_quantities(motions: Sequence[Motion]) -> list[ComparedQuantity]:
    """The quantities of motions of one case, as means over the motions."""
    quantities: list[ComparedQuantity] = []
    values = []
    for motion in motions:
        quantities = measured_quantities(motion)
        values.append([quantity.value for quantity in quantities])
    means = np.mean(values, axis=0).tolist()
    return [replace(quantity, value=mean) for quantity, mean in zip(quantities, means, strict=True)]


def _tolerance(quantity: ComparedQuantity, fastest: float) -> float:
    """Largest error of a quantity that passes, in its unit; ``fastest`` is a velocity in mm/s."""
    if quantity.judgement == "walking":
        return max(VELOCITY_TOLERANCE * abs(quantity.value), SPEED_FLOOR)
    if quantity.judgement == "gait":
        return max(GAIT_TOLERANCE * fastest, SPEED_FLOOR)
    if quantity.judgement == "orientation":
        return ORIENTATION_TOLERANCE
    return inf


def divergence_lines(first: Motion, second: Motion) -> Iterator[Line]:
    """When and how far two motions from the same start diverge.

    Piles are chaotic and must diverge some time; they fail if they do so in the first cycle of the
    drive. Nothing else is judged.
    """
    case = first.case
    distance = np.linalg.norm(first.position - second.position, axis=-1).max(axis=1)
    diverged = np.flatnonzero(distance > SAME_MOTION * float(first.radius.min()))
    last_frame = len(distance) - 1
    end_of_same_motion = diverged[0] if len(diverged) else last_frame
    # Times count from the start of the drive.
    frequency = case.excitation.frequency
    common_cycles = float(frequency * first.time[end_of_same_motion])
    cycles = float(frequency * first.time[-1])
    prefix = ""
    decided = None
    if case.mixture is not None:
        prefix = f"start {case.run.seed}: "
        if common_cycles < min(1.0, cycles):
            decided = Verdict.FAIL
    yield Line(f"{prefix}cycles of the same motion", cycles, common_cycles, decided=decided)
    farthest = 1e6 * float(distance.max())
    yield Line(f"{prefix}largest distance of a bead", 0.0, farthest, unit="µm")


def measured_quantities(motion: Motion) -> list[ComparedQuantity]:
    """The quantities of a motion that are compared: of a pile, of loose beads, or of walkers."""
    if motion.case.mixture is not None:
        return _quantities_of_pile(motion)
    if not motion.groups:
        return _quantities_of_loose_beads(motion)
    quantities = []
    for number, group in enumerate(motion.groups, 1):
        label = f" ({number})" if len(motion.groups) > 1 else ""
        quantities += _quantities_of_walkers(group, label)
    return quantities


def _quantities_of_pile(motion: Motion) -> list[ComparedQuantity]:
    """Means over the second half of the drive."""
    second_half = slice(int(np.searchsorted(motion.time, motion.time[-1] / 2.0)), None)
    late = motion.select(second_half)
    sums_of_radii = pdist(late.radius[:, None], lambda first, second: first[0] + second[0])
    touching = 0
    for position in late.position:
        touching += int(np.sum(pdist(position) < sums_of_radii))
    height = 1e3 * float(late.position[..., 2].mean())
    mean_square = float(np.sum(late.velocity**2, axis=-1).mean())
    pairs_per_bead = touching / late.position[..., 0].size
    return [
        ComparedQuantity("height of the beads", height, "mm", "none"),
        ComparedQuantity("root mean square velocity", 1e3 * sqrt(mean_square), "mm/s", "none"),
        ComparedQuantity("touching pairs per bead", pairs_per_bead, "", "none"),
    ]


def _quantities_of_loose_beads(motion: Motion) -> list[ComparedQuantity]:
    """Mean velocity of the centre of mass of placed beads, which are not in walkers.

    The quantities are velocities, although their names are those of the position. That along z is
    first: it is the speed of climbing.
    """
    weights = motion.radius**3 / np.sum(motion.radius**3)
    displacement = weights @ (motion.position[-1] - motion.position[0])
    along_x, along_y, along_z = (1e3 * displacement / np.ptp(motion.time)).tolist()
    return [
        ComparedQuantity("centre of mass along z", along_z, "mm/s", "gait"),
        ComparedQuantity("centre of mass along y", along_y, "mm/s", "gait"),
        ComparedQuantity("centre of mass along x", along_x, "mm/s", "gait"),
    ]


def _quantities_of_walkers(group: Group, label: str) -> list[ComparedQuantity]:
    """Means over the walkers of a kind; the names of the quantities end with its label."""
    beads = [f"bead {bead + 1}" for bead in range(len(group.radii))]
    pairs = [f"beads {first + 1}-{second + 1}" for first, second in group.kind.pairs]
    contacts = beads + pairs
    velocity = 1e3 * float(measure_walk(group)["velocity"].mean())
    quantities = [ComparedQuantity(f"velocity{label}", velocity, "mm/s", "walking")]
    gait = averages(group)
    rotation = (1e3 * gait.rotation.mean(axis=0)).tolist()
    for bead, value in zip(beads, rotation, strict=True):
        quantities.append(ComparedQuantity(f"rotation {bead}{label}", value, "mm/s", "gait"))
    sliding = (1e3 * gait.sliding.mean(axis=0)).tolist()
    for contact, value in zip(contacts, sliding, strict=True):
        quantities.append(ComparedQuantity(f"sliding {contact}{label}", value, "mm/s", "gait"))
    open_share = (100.0 * gait.open.mean(axis=0)).tolist()
    for contact, value in zip(contacts, open_share, strict=True):
        quantities.append(ComparedQuantity(f"open {contact}{label}", value, "%", "open contacts"))
    angle = degrees(float(group.orientation[-1].mean()))
    quantities.append(ComparedQuantity(f"orientation at the end{label}", angle, "°", "orientation"))
    return quantities


def with_cycles(case: Case, cycles: int) -> Case:
    """The case with a number of cycles, and the default number of settling cycles for them.

    Raises
    ------
    ValueError
        If the case is sampled less than once a cycle and ``cycles`` is not a multiple of those
        between samples, or if there would be fewer than three samples.
    """
    cycles_per_sample = case.run.cycles_per_sample
    least = 3 * cycles_per_sample
    if cycles < least or cycles % cycles_per_sample:
        expected = f"expected at least {least}"
        if cycles_per_sample > 1:
            expected += f", a multiple of {cycles_per_sample}"
        raise ValueError(expected)
    table = dict(case.document.get("run", {}))
    for key in ("cycles", "most_cycles", "duration", "settling_cycles"):
        table.pop(key, None)
    table["cycles"] = cycles
    return build_case({**case.document, "run": table}, source=case.name, name=case.name)


def simulate(motion: Motion, without: Collection[str] = ()) -> Motion:
    """Repeat a run from its first frame by the second engine.

    Parameters
    ----------
    motion
        Motion of the run by LIGGGHTS. Where it was continued from a restart file, forces are
        evaluated anew, as LIGGGHTS does.
    without
        Terms that the second engine leaves out.

    Returns
    -------
    Motion
        The motion by the second engine, with frames at the same times.
    """
    first = np.concatenate([motion.position[:1], motion.velocity[:1], motion.spin[:1]], axis=-1)
    clock = round(float(motion.time[0]) / motion.case.run.time_step)
    engine = SecondEngine(motion.case, motion.radius, first[0], clock=clock, without=without)
    parts = [first]
    mean_spins = [np.zeros_like(motion.spin[:1])]
    for frames, spins in _advanced(engine, motion):
        parts.append(frames)
        mean_spins.append(spins)
    states = np.concatenate(parts)
    return replace(
        motion,
        position=states[..., :3],
        velocity=states[..., 3:6],
        spin=states[..., 6:],
        mean_spin=np.concatenate(mean_spins) if motion.groups else None,
    )


def _advanced(engine: SecondEngine, motion: Motion) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Advance the engine through the times of a motion, part after part.

    Yields
    ------
    frames : ndarray, shape (F, N, 9)
        Position (m), velocity (m/s) and spin (rad/s) of N beads in the next F frames.
    mean_spin : ndarray, shape (F, N, 3)
        Spins, rad/s, averaged over the steps since the previous frame. For motions without walkers,
        the spins of the frames.
    """
    steps = np.rint(motion.time / motion.case.run.time_step).astype(np.int64)
    segments = [segment for segment, _ in motion.frames]
    for begin, end in pairwise(_part_bounds(motion)):
        if segments[begin] != segments[begin - 1]:
            engine.evaluate()
        length = int(steps[end - 1] - steps[begin - 1])
        steps_per_frame = length // (end - begin)
        if motion.groups:
            # Mean spins need the spins of all steps.
            dense = engine.run(length, 1)
            frames = dense[steps_per_frame - 1 :: steps_per_frame].copy()
        else:
            dense = engine.run(length, steps_per_frame)
            frames = dense
        yield frames, dense[..., 6:].reshape(end - begin, -1, dense.shape[1], 3).mean(axis=1)


def _part_bounds(motion: Motion) -> list[int]:
    """First frame of each part of a motion after its first frame, and the number of all frames.

    Parts are cycles for walkers, so that arrays of all steps stay small, and otherwise segments.
    """
    count = len(motion.time)
    if motion.groups:
        return [*range(1, count, motion.case.run.samples_per_cycle), count]
    segments = [segment for segment, _ in motion.frames]
    begins = [frame for frame in range(2, count) if segments[frame] != segments[frame - 1]]
    return [1, *begins, count]


def crosscheck_examples(out: Path) -> Iterator[Line]:
    """Compare the cases of `example_cases`; ``out`` is the folder of the run directories."""
    for name, case in example_cases().items():
        seeds = STARTS if case.mixture else 1
        for line in crosscheck(case, out, seeds=seeds):
            yield replace(line, quantity=f"{name}: {line.quantity}")


def example_cases() -> dict[str, Case]:
    """Walkers, climbers, clusters, other drives and walls, and a small pile, by name."""
    two_to_the_right = {
        "dimers.angle": "30 deg",
        "dimers.replicates": 2,
        "dimers.facing": "right",
    }
    groove = {"boundary.shape": "groove", "boundary.opening": "120 deg"}
    return {
        "fig1b": load_case("fig1b"),
        "fig4a": load_case("fig4a"),
        "fig4b": load_case("fig4b"),
        "alignment from 30°": with_cycles(load_case("fig1b", two_to_the_right), 40),
        "symmetric from 30°": with_cycles(load_case("symmetric", two_to_the_right), 40),
        "fan of three": with_cycles(_fan_of_three(), 24),
        "two tones": with_cycles(_two_tones(), 24),
        "slope of 5°": with_cycles(load_case("fig1b", {"boundary.tilt": "5 deg"}), 24),
        "groove of 120°": with_cycles(load_case("fig1b", groove), 24),
        "climber": with_cycles(load_case("climber"), 20),
        "cluster in a corner": with_cycles(load_case("cluster"), 21),
        "pile-ci": with_cycles(load_case("pile-ci"), 24),
    }


def _fan_of_three() -> Case:
    """The case ``fig1b`` with fans of one large and two small beads in place of its dimers."""
    tables: dict[str, Any] = read_toml(shipped("case")["fig1b"])
    del tables["dimers"]
    fan = {
        "arrangement": "fan",
        "radii": ["0.3 mm", "0.2 mm", "0.2 mm"],
        "angle": "20 deg",
        "replicates": 2,
    }
    return build_case({**tables, "clusters": [fan]}, name="fig1b")


def _two_tones() -> Case:
    """The case ``symmetric`` with a drive of two harmonics."""
    tables: dict[str, Any] = read_toml(shipped("case")["symmetric"])
    harmonics = [
        {"frequency": "80 Hz", "peak_acceleration": "4 g"},
        {"frequency": "160 Hz", "peak_acceleration": "3 g", "phase": "90 deg"},
    ]
    return build_case({**tables, "drive": {"harmonics": harmonics}}, name="symmetric")
