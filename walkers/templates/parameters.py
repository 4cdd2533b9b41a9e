"""Named parameters of a deck: lines that a user may edit, and formulas that follow from them.

LIGGGHTS replaces ``${name}`` by the text of a ``string`` variable, and computes ``$(formula)`` in
double precision to 20 digits. A deck with names therefore gives the same results bit for bit as one
with numbers. A variable of the style ``equal`` would be inserted with 15 digits.

``blocks/parameters.lig.j2`` prints the parameters; the other blocks use them by name.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

from walkers.arrays import Vector
from walkers.inputs.tables.case import Case
from walkers.inputs.tables.materials import Contact
from walkers.physics.capillary import BridgeLiquid
from walkers.text import number_text

PRINTED = "parameters:"
"""Start of the line in which the engine prints the parameters."""
STATUS_LINES_PER_CYCLE = 4
"""Lines of the engine's log in each cycle of the drive."""
_COMMENT_COLUMN = 55
"""Width of a parameter and its value, in letters; its comment follows."""


@dataclass(frozen=True)
class DeckParameter:
    """A ``string`` variable of a deck.

    Attributes
    ----------
    name
        Name of the variable.
    value
        Its text: a number, or a formula ``$(…)`` of earlier variables.
    unit
        SI unit of the number; empty: none.
    note
        What a reader of the deck should know about it; may be empty.
    """

    name: str
    value: str
    unit: str = ""
    note: str = ""

    @property
    def line(self) -> str:
        """The line of the deck that sets the variable, with unit and note as a comment."""
        command = f"variable        {self.name} string {self.value}"
        comment = ": ".join(text for text in (self.unit, self.note) if text)
        if not comment:
            return command
        return f"{command.ljust(_COMMENT_COLUMN)} # {comment}"


def suffixes(count: int) -> list[str]:
    """Suffixes for the names of several parameters of one kind; empty for a single parameter."""
    if count == 1:
        return [""]
    return [f"_{number}" for number in range(1, count + 1)]


def in_cycles(steps: int, steps_per_cycle: int) -> str:
    """Steps as a multiple or a part of a cycle, a formula; as a number if they are neither."""
    cycles, remainder = divmod(steps, steps_per_cycle)
    if cycles == 1 and not remainder:
        return "${steps_per_cycle}"
    if cycles and not remainder:
        return f"$({cycles}*v_steps_per_cycle)"
    for parts in (steps_per_cycle // steps, STATUS_LINES_PER_CYCLE):
        if parts and ceil(steps_per_cycle / parts) == steps:
            if steps_per_cycle % parts:
                return f"$(ceil(v_steps_per_cycle/{parts}))"
            return f"$(v_steps_per_cycle/{parts})"
    return str(steps)


def vector_along(name: str, direction: Vector) -> str:
    """The three components of a parameter times a unit vector, as formulas."""
    components = []
    for component in direction:
        if component == 1.0:
            components.append(f"${{{name}}}")
        elif component == 0.0:
            components.append("0.0")
        else:
            components.append(f"$(v_{name}*({number_text(component)}))")
    return " ".join(components)


# --- parameters that a user may edit --------------------------------------------------------------


def drive_parameters(case: Case, *, shaken: bool) -> list[DeckParameter]:
    """Frequencies, accelerations and phases of the harmonics, and the frequency of the cycle.

    Parameters
    ----------
    case
        The case of the deck.
    shaken
        Whether the walls move in this deck; without, only frequencies are needed.
    """
    harmonics = case.excitation.harmonics
    endings = suffixes(len(harmonics))
    parameters = []
    for harmonic, ending in zip(harmonics, endings, strict=True):
        frequency = number_text(harmonic.frequency)
        parameters.append(DeckParameter(f"frequency{ending}", frequency, "Hz"))
        if shaken:
            acceleration = number_text(harmonic.peak_acceleration)
            parameters.append(DeckParameter(f"peak_acceleration{ending}", acceleration, "m/s^2"))
        if len(harmonics) > 1 or harmonic.phase:
            parameters.append(DeckParameter(f"phase{ending}", number_text(harmonic.phase), "rad"))
    if len(harmonics) != 1:
        note = "of a cycle"
        if harmonics:
            note += ", the common period of all: to be changed with them"
        frequency = number_text(case.excitation.frequency)
        parameters.append(DeckParameter("cycle_frequency", frequency, "Hz", note))
    return parameters


def length_parameters(
    case: Case, stable_step: float, rest_steps: int | None, drive_steps: int | None
) -> list[DeckParameter]:
    """Steps of a cycle, steps of rest and cycles of a deck.

    Parameters
    ----------
    case
        The case of the deck.
    stable_step
        Lowest limit of the time step, s.
    rest_steps
        Steps before the drive begins; None if it begins in another deck of the run.
    drive_steps
        Steps from the start of the drive to the end of the deck; None as for ``rest_steps``.
    """
    run = case.run
    note = f"a multiple of {run.samples_per_cycle} for which the time step is below "
    note += f"{stable_step:.3g} s"
    parameters = [DeckParameter("steps_per_cycle", str(run.steps_per_cycle), note=note)]
    if rest_steps:
        note = "before the drive, in which the beads come to rest"
        parameters.append(DeckParameter("rest_steps", str(rest_steps), note=note))
    if drive_steps is not None and drive_steps % run.steps_per_cycle == 0:
        note = "of the drive"
        if run.continuation:
            note += f"; {run.continuation}"
        parameters.append(
            DeckParameter("cycles", str(drive_steps // run.steps_per_cycle), note=note)
        )
    return parameters


def material_parameters(
    case: Case,
    contacts: Sequence[Contact],
    scalable_liquid: BridgeLiquid | None,
    *,
    with_density: bool,
) -> list[DeckParameter]:
    """Gravity, and the properties of materials that have a single value in the deck.

    Young's modulus is a parameter if all beads and the walls have the same; restitution and
    friction, if all beads have the same surface; the viscosity, if the deck can be rescaled for
    another one. Poisson's ratio always is: cases with different ones do not share a deck
    (`walkers.templates.placement.sharing_key`).

    Parameters
    ----------
    case
        The case of the deck, whose contact parameters are also those of the walls; of a shared
        deck, its first case.
    contacts
        Contact parameters of the different surfaces of the beads; those of ``case`` are among them.
    scalable_liquid
        The liquid, if the resistances of its bridges are proportional to its viscosity; else None.
    with_density
        Whether the deck sets the density of beads; a deck that continues a run does not.
    """
    parameters = []
    if case.environment.gravity > 0:
        parameters.append(DeckParameter("gravity", number_text(case.environment.gravity), "m/s^2"))
    if with_density:
        density = number_text(case.beads.density)
        parameters.append(DeckParameter("density", density, "kg/m^3", "of the beads"))
    moduli = {contact.youngs_modulus for contact in contacts}
    if len(moduli) == 1:
        modulus = number_text(contacts[0].youngs_modulus)
        note = "softer than the material, for a longer time step; "
        note += "walkers run --accuracy measures its error"
        parameters.append(DeckParameter("youngs_modulus", modulus, "Pa", note))
    parameters.append(DeckParameter("poissons_ratio", number_text(case.contact.poissons_ratio)))
    if len(contacts) == 1:
        parameters += _contact_parameters(contacts[0])
    if scalable_liquid is not None:
        viscosity = number_text(scalable_liquid.viscosity)
        parameters.append(DeckParameter("viscosity", viscosity, "Pa s", "of the bridges"))
    return parameters


def contact_values(contact: Contact) -> dict[str, float]:
    """Restitution and the coefficients of friction, by the names that they have in a deck.

    Velocities are in m/s. Friction that does not grow with the velocity has a rise of 0.
    """
    between_beads = contact.friction.between_beads
    at_walls = contact.friction.at_walls
    return {
        "restitution": contact.restitution,
        "friction_bead_bead": between_beads.at_rest,
        "friction_bead_wall": at_walls.at_rest,
        "friction_rise_bead_bead": between_beads.rise,
        "friction_rise_bead_wall": at_walls.rise,
        "friction_velocity_bead_bead": between_beads.half_rise_velocity,
        "friction_velocity_bead_wall": at_walls.half_rise_velocity,
        "rolling_friction": contact.rolling_friction,
    }


def _contact_parameters(contact: Contact) -> list[DeckParameter]:
    """Restitution and the coefficients of friction of a deck with one surface of beads."""
    values = contact_values(contact)
    parameters = []
    for name in ("restitution", "friction_bead_bead", "friction_bead_wall"):
        parameters.append(DeckParameter(name, number_text(values[name])))
    for pair in ("bead_bead", "bead_wall"):
        rise = values[f"friction_rise_{pair}"]
        if rise:
            velocity = number_text(values[f"friction_velocity_{pair}"])
            note = "at high sliding velocities"
            parameters.append(DeckParameter(f"friction_rise_{pair}", number_text(rise), note=note))
            note = "at which half of the rise is reached"
            parameters.append(DeckParameter(f"friction_velocity_{pair}", velocity, "m/s", note))
    if contact.rolling_friction > 0:
        rolling_friction = number_text(contact.rolling_friction)
        parameters.append(DeckParameter("rolling_friction", rolling_friction))
    return parameters


# --- parameters that follow from others -----------------------------------------------------------


def derived_parameters(
    case: Case, *, shaken: bool, start_velocity: Sequence[float]
) -> list[DeckParameter]:
    """Amplitudes and velocities of the walls, and the time step, as formulas.

    Parameters
    ----------
    case
        The case of the deck.
    shaken
        Whether the walls move in this deck.
    start_velocity
        Velocity of the walls at the start of the drive as numbers, m/s; empty if it is zero or that
        of the sine, which has a name here.
    """
    velocity_has_name = case.drive.frame == "lab" and not start_velocity
    endings = suffixes(len(case.excitation.harmonics)) if shaken else []
    parameters = []
    for ending in endings:
        acceleration = f"v_peak_acceleration{ending}"
        angular_frequency = f"(2.0*PI*v_frequency{ending})"
        amplitude = f"$({acceleration}/{angular_frequency}^2)"
        parameters.append(
            DeckParameter(f"amplitude{ending}", amplitude, "m", "of the displacement")
        )
        if velocity_has_name:
            velocity = f"$({acceleration}/{angular_frequency})"
            parameters.append(
                DeckParameter(f"peak_velocity{ending}", velocity, "m/s", "of the walls")
            )
    parameters.append(DeckParameter("time_step", _time_step_text(case), "s"))
    return parameters


def _time_step_text(case: Case) -> str:
    """The time step as a formula, if that gives the same double; else as a number of seconds."""
    time_step = case.run.time_step
    if 1.0 / (case.excitation.frequency * case.run.steps_per_cycle) != time_step:
        return number_text(time_step)
    frequency = "cycle_frequency"
    if len(case.excitation.harmonics) == 1:
        frequency = "frequency"
    return f"$(1.0/(v_{frequency}*v_steps_per_cycle))"
