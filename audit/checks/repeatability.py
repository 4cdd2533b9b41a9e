"""Group 7: independence of replicates, reruns, restarts, MPI ranks."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import replace
from math import nan

import numpy as np

from walkers.audit.bench import FIRST_BEAD, Bench, bench_case, bench_recording, scene_on_floor
from walkers.audit.check import Check, Line, Verdict
from walkers.audit.checks.drive import reference_walker
from walkers.audit.checks.viscous import box_errors, box_lines, run_box, viscous_case
from walkers.audit.laws import Partner, capillary_law, largest_error
from walkers.inputs.case import Case
from walkers.inputs.drive import AXES
from walkers.physics.capillary import bridge_volume_between_beads, rupture_distance
from walkers.templates.deck import Checkpoint, Plan, plan_of
from walkers.templates.scene import Bead

_RESTART_FILE = "half.restart"


def _ensemble(replicates: int, frame: str = "lab") -> Case:
    return reference_walker(
        dimers={"replicates": replicates, "spacing": "30 mm"},
        drive={"frequency": "80 Hz", "peak_acceleration": "4 g", "frame": frame},
        run={"cycles": 10, "settling_cycles": 2},
    )


def independence(bench: Bench) -> Iterator[Line]:
    """A walker among four against the same one alone; a rerun against the run."""
    together, alone, again = (
        bench.run(plan_of(_ensemble(count), workarounds=bench.workarounds)) for count in (4, 1, 4)
    )
    tracks = [series.position[:, series.row(FIRST_BEAD)] for series in (together, alone)]
    ways = [track - track[0] for track in tracks]
    error = float(np.abs(ways[0] - ways[1]).max() / np.abs(ways[1]).max())
    yield Line(
        "a walker among four against the same one alone", "independent replicates", 0.0, error, "rel.", 1e-6, error
    )
    error = _among_others(bench)
    yield Line(
        "a walker among those of other drives, axes and slopes against the same one alone",
        "independent replicates",
        0.0,
        error,
        "rel.",
        1e-6,
        error,
    )
    dumps = [(series.directory / "beads.bin").read_bytes() for series in (together, again)]
    yield Line("bytes of the dump that differ in a rerun", "deterministic", 0.0, float(dumps[0] != dumps[1]), "", 0.0)


def _among_others(bench: Bench) -> float:
    """How far a walker strays from its way alone when those beside it feel other forces, over the way gone."""
    alone = _ensemble(1, "container")
    others = [
        replace(alone, drive=alone.drive.with_peak(2.0 * alone.drive.peak_acceleration)),
        replace(alone, drive=replace(alone.drive, harmonics=(replace(alone.drive.largest, direction=AXES["y"]),))),
        replace(alone, boundary=replace(alone.boundary, tilt=0.5)),
    ]
    single = bench.run(plan_of(alone, workarounds=bench.workarounds))
    shared = bench.run(plan_of(others[0], alone, *others[1:], workarounds=bench.workarounds))
    first = single.position[:, single.row(FIRST_BEAD)]
    same = shared.position[:, shared.row(FIRST_BEAD + 2)]
    ways = [track - track[0] for track in (first, same)]
    return float(np.abs(ways[0] - ways[1]).max() / np.abs(ways[0]).max())


def restart(bench: Bench) -> Iterator[Line]:
    """Ten cycles at a stretch against five, a restart file, and five more (container frame)."""
    case = _ensemble(2, "container")
    run, plan = case.run, plan_of(case, workarounds=bench.workarounds)
    whole = bench.run(plan)
    half = replace(plan.recording, steps=run.steps // 2)
    first = bench.run(replace(plan, recording=half, checkpoint=Checkpoint(write=_RESTART_FILE)))
    rest = replace(plan.recording, begin=half.steps)
    going_on = replace(plan, recording=rest, checkpoint=Checkpoint(read=_RESTART_FILE))
    second = bench.run(going_on, first.directory / _RESTART_FILE)
    way = float(np.abs(whole.position[-1] - whole.position[0]).max())
    apart = float(np.abs(second.position[-1] - whole.position[-1]).max())
    yield Line(
        "restarted against uninterrupted run, over the way gone",
        "read_restart",
        0.0,
        apart / way,
        "rel.",
        0.01,
        apart / way,
    )
    back, row = 3 * run.samples_per_cycle, whole.row(FIRST_BEAD)
    speeds = [
        float((series.position[-1, row, 0] - series.position[-1 - back, row, 0]) * case.drive.frequency / 3.0)
        for series in (whole, second)
    ]
    yield Line(
        "speed in the last three cycles, restarted against uninterrupted",
        "read_restart",
        speeds[0],
        speeds[1],
        "m/s",
        1e-3,
    )


def restart_bridges(bench: Bench) -> Iterator[Line]:
    """Beads that part, with a restart file while their bridges are open: as decks write it, and as they do not."""
    case = bench_case()
    large, small, speed = 3e-4, 2e-4, 0.02
    rupture = rupture_distance(bridge_volume_between_beads(large, small, case.liquid.volume_fraction), 0.0)
    half = int(0.4 * rupture / (speed * case.run.time_step) / 10) * 10
    beads = [
        Bead(0, (0.0, 0.0, 5e-3), large),
        Bead(0, (0.0, 0.0, 5e-3 + large + small - 2e-7), small, velocity=(0.0, 0.0, speed)),
    ]
    plan = Plan(case, scene_on_floor(beads), bench_recording(half, half // 10), prescribed=True)
    for defect in (False, True):
        workarounds = replace(bench.workarounds, restart_in_run=bench.workarounds.restart_in_run and not defect)
        plan = replace(plan, workarounds=workarounds)
        first = bench.run(replace(plan, checkpoint=Checkpoint(write=_RESTART_FILE)))
        rest = replace(plan, recording=replace(plan.recording, begin=half, steps=2 * half))
        going_on = replace(rest, checkpoint=Checkpoint(read=_RESTART_FILE))
        second = bench.run(going_on, first.directory / _RESTART_FILE)
        low, high = second.row(FIRST_BEAD), second.row(FIRST_BEAD + 1)
        gap = second.position[:, high, 2] - second.position[:, low, 2] - large - small
        law, pull = capillary_law(case, small, Partner(large), gap), -second.force[:, high, 2]
        if defect:
            what = "pull of an open bridge between beads after `write_restart`, over the law"
            yield Line(what, "Soulié et al. 2006", 0.0, float((pull / law).max()), "", 1e-6, defect=True)
        else:
            what = "pull of an open bridge between beads after a restart"
            error = largest_error(pull[:, None], law[:, None])
            yield Line(what, "Soulié et al. 2006", float(law[-1]), float(pull[-1]), "N", 1e-4, error)


def ranks(bench: Bench) -> Iterator[Line]:
    """The box of beads on two MPI ranks, each with its own carriers, against the law and against one rank."""
    if shutil.which("mpirun") is None:
        yield Line("two MPI ranks: no mpirun on this machine", "", nan, nan, unmeasured=Verdict.SKIPPED)
        return
    case, needs = viscous_case(), frozenset({"carriers", "walls"})
    (scene, one), (split, two) = (run_box(bench, case, bench.workarounds, ranks=count) for count in (1, 2))
    yield from box_lines("two MPI ranks", box_errors(case, split, two), needs)
    pairs = [
        (one.force[:, one.row(a.id)], two.force[:, two.row(b.id)])
        for a, b in zip(scene.beads, split.beads, strict=True)
    ]
    error = max(largest_error(force, single) for single, force in pairs)
    yield Line(
        "forces on two MPI ranks against one", "the same", 0.0, error, "rel.", 1e-6, error, frozenset({"carriers"})
    )


CHECKS = (
    Check("independence", 7, "replicates independent, reruns bitwise the same", True, independence),
    Check("restart", 7, "restarted against uninterrupted run", True, restart),
    Check("restart-bridges", 7, "open bridges between beads after a restart", True, restart_bridges),
    Check("ranks", 7, "two MPI ranks against the law", True, ranks),
)
