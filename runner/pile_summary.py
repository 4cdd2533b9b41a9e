"""What a pile amounts to before it is run: its numbers in SI, its time step and its cost."""

from __future__ import annotations

from math import pi
from typing import Any

from walkers.inputs.pile import PileCase
from walkers.inputs.pile_file import limits_of
from walkers.inputs.units import ACCELERATION_OF_ONE_G
from walkers.runner.cost import START_UP_SECONDS
from walkers.runner.summary import lines_of_limits, step_against, text_of_case
from walkers.templates.pile import settling_steps

_BEAD_STEPS_PER_SECOND = 2.6e6
"""On one core of a 2020s x86 server: 13,100 steps a second with 200 beads."""
_GAIN_PER_RANK = 0.9


def predicted_pile_seconds(case: PileCase) -> float:
    """Wall time in s of a pile's run, settling included."""
    run = case.run
    steps = run.cycles * run.steps_per_cycle + 3 * settling_steps(case)
    speed = _BEAD_STEPS_PER_SECOND * (1.0 + _GAIN_PER_RANK * (run.ranks - 1))
    segments = 3 + -(-run.cycles // run.cycles_per_segment)
    return START_UP_SECONDS * segments + steps * sum(case.beads.counts) / speed


def summarise_pile(case: PileCase) -> dict[str, Any]:
    """Everything that ``walkers show`` prints of a pile, SI units."""
    run, radii = case.run, case.beads.radii
    limits = limits_of(case.beads, case.contact, case.liquid, case.drive)
    volume = sum(4.0 / 3.0 * pi * radius**3 for radius in radii)
    steps = run.cycles * run.steps_per_cycle
    return {
        "case": case.as_dict(),
        "peak_acceleration": case.drive.peak_acceleration,
        "beads": {
            "small": case.beads.counts[0],
            "large": case.beads.counts[1],
            "volume": volume,
            "mass": volume * case.beads.density,
            "liquid": volume * case.liquid.volume_fraction,
        },
        "time_step": step_against(run.time_step, limits),
        "run": {
            "steps": steps,
            "simulated_seconds": steps * run.time_step,
            "frames": run.cycles * run.frames_per_cycle // run.cycles_per_frame,
            "segments": -(-run.cycles // run.cycles_per_segment),
            "predicted_seconds": predicted_pile_seconds(case),
        },
    }


def describe_pile_case(summary: dict[str, Any]) -> str:
    """The summary of a pile as text."""
    beads, step, run = summary["beads"], summary["time_step"], summary["run"]
    lines = [
        text_of_case(summary["case"]),
        f"pile       {beads['small']} small and {beads['large']} large beads, {beads['mass'] * 1e6:.4g} mg, "
        f"{beads['volume'] * 1e9:.4g} µL with {beads['liquid'] * 1e9:.3g} µL of liquid",
        f"drive      a0 = {summary['peak_acceleration'] / ACCELERATION_OF_ONE_G:.4g} g",
        f"time step  {step['step'] * 1e6:.5g} µs",
        *lines_of_limits(step),
        f"run        {run['steps']} steps after the settling, {run['simulated_seconds']:.4g} s, in {run['segments']} "
        f"segments with {run['frames']} frames, about {run['predicted_seconds'] / 60.0:.1f} min",
    ]
    return "\n".join(lines)
