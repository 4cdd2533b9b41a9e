"""The named parameters of a deck: lines that a user may edit, and formulas for the values that follow from them.

LIGGGHTS replaces ``${name}`` by the text of a ``string`` variable, and computes ``$(formula)`` in double precision to
20 digits. A deck with names therefore gives the same results bit for bit as one with numbers. The value of an ``equal``
variable would have 15 digits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, inf
from typing import NamedTuple

from walkers.inputs.case import Case, Contact
from walkers.inputs.drive import Excitation, Vector
from walkers.inputs.numerical import INFLUENCE, STIFFER, numerical_error
from walkers.physics.laws import LAWS, by_name
from walkers.templates.scene import Surface

STATUS_LINES_PER_CYCLE = 4
PRINTED = "parameters:"
"""Start of the line in which the engine prints the parameters."""


class Parameter(NamedTuple):
    """A line of a deck: name, value (a number, or a formula in ``$()``), unit, and a remark."""

    name: str
    value: str
    unit: str = ""
    note: str = ""


def number(value: float) -> str:
    """The shortest text that reads back as the same double."""
    return repr(float(value))


def suffixes(count: int) -> list[str]:
    """Suffixes for the names of several parameters of a kind; empty for a single one."""
    return [""] if count == 1 else [f"_{place}" for place in range(1, count + 1)]


def in_cycles(steps: int, steps_per_cycle: int) -> str:
    """Steps as a multiple or a part of a cycle, if possible."""
    whole, rest = divmod(steps, steps_per_cycle)
    if whole and not rest:
        return "${steps_per_cycle}" if whole == 1 else f"$({whole}*v_steps_per_cycle)"
    for parts in (steps_per_cycle // steps, STATUS_LINES_PER_CYCLE):
        if parts and ceil(steps_per_cycle / parts) == steps:
            return f"$(ceil(v_steps_per_cycle/{parts}))" if steps_per_cycle % parts else f"$(v_steps_per_cycle/{parts})"
    return str(steps)


def along(name: str, direction: Vector) -> str:
    """A parameter times a unit vector."""
    parts = {1.0: f"${{{name}}}", 0.0: "0.0"}
    return " ".join(parts.get(part, f"$(v_{name}*({number(part)}))") for part in direction)


def of_drive(drive: Excitation, *, amplitudes: bool) -> tuple[list[Parameter], list[Parameter]]:
    """Given and derived parameters of a drive; without ``amplitudes`` only its times."""
    given, derived = [], []
    for end, one in zip(suffixes(len(drive.harmonics)), drive.harmonics, strict=True):
        given.append(Parameter(f"frequency{end}", number(one.frequency), "Hz"))
        if amplitudes:
            given.append(Parameter(f"peak_acceleration{end}", number(one.peak_acceleration), "m/s^2"))
            formula = f"$(v_peak_acceleration{end}/(2.0*PI*v_frequency{end})^2)"
            derived.append(Parameter(f"amplitude{end}", formula, "m", "of the displacement"))
        if amplitudes and drive.frame == "lab":
            formula = f"$(v_peak_acceleration{end}/(2.0*PI*v_frequency{end}))"
            derived.append(Parameter(f"peak_velocity{end}", formula, "m/s", "of the walls"))
        if len(drive.harmonics) > 1 or one.phase:
            given.append(Parameter(f"phase{end}", number(one.phase), "rad"))
    if len(drive.harmonics) > 1:
        words = "of a cycle, the common period of all: to be changed with them"
        given.append(Parameter("cycle_frequency", number(drive.frequency), "Hz", words))
    return given, derived


def of_time(case: Case, drive_from: int | None, steps: int, stable: float) -> tuple[list[Parameter], list[Parameter]]:
    """Given and derived parameters of the time step, stable below a limit (s), and of the length of the run, in steps.

    The length is no parameter if no step is given at which the drive begins.
    """
    run = case.run
    frequency = "frequency" if len(case.excitation.harmonics) == 1 else "cycle_frequency"
    words = f"a multiple of {run.samples_per_cycle} for which the time step is below {stable:.3g} s"
    given = [Parameter("steps_per_cycle", str(run.steps_per_cycle), note=words)]
    exact = 1.0 / (case.excitation.frequency * run.steps_per_cycle) == run.time_step
    formula = f"$(1.0/(v_{frequency}*v_steps_per_cycle))"
    derived = [Parameter("time_step", formula if exact else number(run.time_step), "s")]
    if drive_from:
        given.append(Parameter("rest_steps", str(drive_from), note="before the drive, in which the beads come to rest"))
    if drive_from is not None and (steps - drive_from) % run.steps_per_cycle == 0:
        note = f"of the drive; {run.continuation}" if run.continuation else "of the drive"
        given.append(Parameter("cycles", str((steps - drive_from) // run.steps_per_cycle), note=note))
    return given, derived


def of_contacts(case: Case, contacts: Sequence[Contact]) -> list[Parameter]:
    """Stiffness, and damping and friction if they are the same for all beads."""
    first = contacts[0]
    error = numerical_error(case)
    change = f"velocities of the shipped walkers by {INFLUENCE}"
    if error is not None:
        change = f"the velocity of this case by {abs(error['stiffer']) * 1e3:.2g} mm/s"
    softened = f"softer than the material, for a longer time step; {STIFFER:g} times as much changes {change}"
    found = [Parameter("youngs_modulus", number(first.youngs_modulus), "Pa", softened)]
    found = found if {one.youngs_modulus for one in (*contacts, case.contact)} == {first.youngs_modulus} else []
    found.append(Parameter("poissons_ratio", number(case.contact.poissons_ratio)))
    if len(contacts) == 1:
        names = ["restitution", "friction.bead_bead", "friction.bead_wall"]
        names += ["rolling_friction"] if case.contact.rolling_friction > 0.0 else []
        found += [Parameter(name.replace(".", "_"), number(first.value_of(name))) for name in names]
    return found


def of_liquid(surface: Surface, radius: float) -> list[Parameter]:
    """Surface tension and viscosity, if the pulls and resistances in the bridge tables are proportional to them.

    Built-in laws are tested with a bead of this radius (m) at a wall; other laws have no such parameters.
    """
    import numpy as np

    from walkers.physics.bridge import Surfaces

    contact, liquid = surface
    if liquid.law not in LAWS or not (liquid.surface_tension > 0.0 and liquid.viscosity > 0.0):
        return []
    doubled = replace(liquid, surface_tension=2.0 * liquid.surface_tension, viscosity=2.0 * liquid.viscosity)
    once, twice = (
        by_name(one.law)(Surfaces.of(radius, inf, one, contact.minimum_separation_ratio)) for one in (liquid, doubled)
    )
    gaps = once.rupture * np.array([0.0, 0.01, 0.3, 0.9])
    if not np.allclose(twice.forces(gaps).columns(), 2.0 * once.forces(gaps).columns(), rtol=1e-9, atol=0.0):
        return []
    return [
        Parameter("surface_tension", number(liquid.surface_tension), "N/m"),
        Parameter("viscosity", number(liquid.viscosity), "Pa s", "of the bridges"),
    ]
