"""Measure the speeds in docs/explanation/performance.md: ``make bench`` prints their table.

The same beads, from the end of a shaken pile, in liggghts and in Debian's lammps and yade: with the
same sizes, density, walls, drive and time step, on one core. Codes run in turn, several times.

Beads at rest must touch as many neighbours in each code, or the comparison is of unlike piles.
Without adhesion, beads that bridges had pressed together spring apart, and a dry pile would be
timed in flight. Dry piles are therefore settled first, by their own code, until they lie.
"""

from __future__ import annotations

import re
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import atan
from pathlib import Path
from statistics import median

import numpy as np
from scipy.spatial import cKDTree

from tests.benchmark_decks import (
    ENGINE,
    compose_for_stock,
    compose_from,
    cpu_time,
    environment,
    minimal,
    shaken,
    without_steps,
)
from walkers.arrays import FloatArray
from walkers.inputs.reading import load_case
from walkers.inputs.tables.case import Case
from walkers.physics.capillary import bead_volume
from walkers.postprocess.measure.dump import BinaryDump
from walkers.runner.run_directory import write_deck
from walkers.templates.deck import Deck
from walkers.templates.layout import BEAD_COLUMNS
from walkers.templates.placement import Bead

_REPEATS = 3
"""Times that each code runs."""
_STEPS = {"pile-small": 20_000, "pile-fig1a": 6_000}
"""Number of timed steps of each case."""
_SETTLING_STEPS = {"pile-small": 300_000, "pile-fig1a": 150_000}
"""Steps after which dry beads lie at rest."""
_SETTLED = "settled.restart"
_END = "end.txt"
_LAMMPS = ("lmp", "-log", "none", "-in")
_YADE = ("yade", "-n", "-x", "-j", "1")
_LAMMPS_PILE = """
units si
atom_style sphere
boundary f f f
newton off
comm_modify vel yes
{start}
neighbor 2e-4 bin
neigh_modify delay 0
{contacts}
variable down equal {gravity}-{peak}*sin(2*PI*{frequency}*step*{dt})
fix gravity all gravity v_down vector 0 0 -1
fix motion all nve/sphere
timestep {dt}
run STEPS
write_dump all custom {end} x y z modify sort id format float %.17g
"""
_SETTLE_AND_KEEP = f"""
write_restart {_SETTLED}
"""
_GRANULAR = """
pair_style granular
pair_coeff * * {law}
fix x all wall/gran granular {law} xplane -{half} {half}
fix y all wall/gran granular {law} yplane -{half} {half}
fix z all wall/gran granular {law} zplane 0 NULL
"""
_HISTORY = """
pair_style gran/hertz/history {law}
pair_coeff * *
fix x all wall/gran hertz/history {law} xplane -{half} {half}
fix y all wall/gran hertz/history {law} yplane -{half} {half}
fix z all wall/gran hertz/history {law} zplane 0 NULL
"""
_YADE_PILE = """
from yade import *
import numpy
liquid = dict(Capillar=True, CapillarType="Rabinovich", Vb={bridge}, gamma={tension}, theta=0.0)
material = ViscElCapMat(
    density={density}, frictionAngle={angle}, tc=4e-5, en={e}, et={e}, **liquid
)
O.materials.append(material)
swing = {peak} / (2.0 * numpy.pi * {frequency})
for x, y, z, radius, vx, vy, vz, wx, wy, wz in numpy.loadtxt("beads.txt"):
    bead = sphere((x, y, z), radius, material=material)
    bead.state.vel = (vx, vy, vz + swing)
    bead.state.angVel = (wx, wy, wz)
    O.bodies.append(bead)
beads = list(O.bodies)
planes = [(2, 0.0), (0, -{half}), (0, {half}), (1, -{half}), (1, {half})]
walls = O.bodies.append([wall(place, axis, material=material) for axis, place in planes])
shapes = [Bo1_Sphere_Aabb(aabbEnlargeFactor=1.2), Bo1_Wall_Aabb()]
meetings = [Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=1.2), Ig2_Wall_Sphere_ScGeom()]
physics = [Ip2_ViscElCapMat_ViscElCapMat_ViscElCapPhys()]
laws = [Law2_ScGeom_ViscElCapPhys_Basic()]
shaking = HarmonicMotionEngine(
    ids=walls,
    A=(0, 0, swing / (2.0 * numpy.pi * {frequency})),
    f=(0, 0, {frequency}),
    fi=(0, 0, -numpy.pi / 2.0),
)
O.engines = [
    ForceResetter(),
    InsertionSortCollider(shapes),
    InteractionLoop(meetings, physics, laws),
    shaking,
    NewtonIntegrator(damping=0.0, gravity=(0, 0, -{gravity})),
]
O.dt = {dt}
if STEPS: O.run(STEPS, True)
numpy.savetxt("{end}", [bead.state.pos for bead in beads])
"""


@dataclass(frozen=True)
class Script:
    """How to run a code.

    Attributes
    ----------
    command
        The command, without its input file.
    text
        The input, with the word STEPS for the number of steps.
    environment
        The environment of the command.
    settling
        The input that settles the beads first, in the same folder; empty if they lie already.
    """

    command: tuple[str, ...]
    text: str
    environment: Mapping[str, str]
    settling: str = ""


@dataclass(frozen=True)
class Start:
    """The beads from which codes start, and how they are shaken.

    Attributes
    ----------
    case
        Name of the case of the pile.
    beads
        The beads.
    peak
        Peak acceleration of the drive, m/s²; None: that of the case.
    """

    case: str
    beads: list[Bead]
    peak: float | None = None


@dataclass
class Timing:
    """What was measured of a code, a number for each repetition."""

    speeds: list[float] = field(default_factory=list)
    """Million bead-steps/s."""
    neighbours: list[float] = field(default_factory=list)
    """Touching neighbours of a bead at the end."""

    def cells(self) -> str:
        """The medians as cells of the table."""
        return f"{median(self.speeds):.1f} | {median(self.neighbours):.1f} |"


def main() -> None:
    """Print bead-steps per second and touching neighbours at the end, shaken and at rest."""
    shaken_columns = "shaken: M bead-steps/s | neighbours"
    columns_at_rest = "at rest: M bead-steps/s | neighbours"
    print(f"| code | beads | {shaken_columns} | {columns_at_rest} |")
    print("|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for case in _STEPS:
            _print_rows(case, Path(folder))


def _print_rows(case: str, folder: Path) -> None:
    """Time all codes with a pile, shaken and at rest in turn, and print a row for each."""
    beads = shaken(case, folder)
    at_rest = [replace(bead, velocity=(0.0, 0.0, 0.0), spin=(0.0, 0.0, 0.0)) for bead in beads]
    timings_shaken: dict[str, Timing] = {}
    timings_at_rest: dict[str, Timing] = {}
    for _ in range(_REPEATS):
        _time_codes(Start(case, beads), folder / f"{case}-shaken", timings_shaken)
        _time_codes(Start(case, at_rest, peak=0.0), folder / f"{case}-rest", timings_at_rest)
    for code, timing in timings_shaken.items():
        cells = f"{timing.cells()} {timings_at_rest[code].cells()}"
        print(f"| {code} | {len(beads)} | {cells}", flush=True)


def _time_codes(start: Start, folder: Path, timings: dict[str, Timing]) -> None:
    """Time each code once, and add its numbers to the timings by code."""
    steps = _STEPS[start.case]
    for code, script in scripts(start, steps, folder).items():
        place = _place(folder, code)
        _settle(script, place, _SETTLING_STEPS[start.case])
        seconds = cpu_time(place, script.command, script.text, steps, script.environment)
        timing = timings.setdefault(code, Timing())
        timing.speeds.append(1e-6 * len(start.beads) * steps / seconds)
        timing.neighbours.append(_neighbours(place, start.beads))


def _place(folder: Path, code: str) -> Path:
    """The folder of a code."""
    return folder / re.sub(r"\W+", "-", code)


def _settle(script: Script, place: Path, steps: int) -> None:
    """Let the beads of a script come to rest, once."""
    if script.settling and not (place / _SETTLED).is_file():
        cpu_time(place, script.command, script.settling, steps, script.environment)


def scripts(start: Start, steps: int, folder: Path) -> dict[str, Script]:
    """Scripts of a pile for the codes that are installed, by the names of the codes.

    Each code has its files in a folder of its own.
    """
    case = load_case(start.case)
    values = _values(case, start.peak)
    deck = compose_from(start.case, steps, start.beads)
    by_code = _scripts_of_liggghts(deck, start, steps, values)
    if shutil.which(_LAMMPS[0]):
        by_code |= _scripts_of_lammps(values, is_at_rest=start.peak == 0.0)
    if shutil.which(_YADE[0]):
        by_code["yade: Rabinovich"] = Script(_YADE, _YADE_PILE.format(**values), {})
    for code in by_code:
        place = _place(folder, code)
        place.mkdir(parents=True, exist_ok=True)
        write_deck(deck, place)
        _write_beads(place, start.beads, case)
    return by_code


def _scripts_of_liggghts(
    deck: Deck, start: Start, steps: int, values: Mapping[str, float | str]
) -> dict[str, Script]:
    """The deck of this project, and one of the engine's own capillary model."""

    def with_peak(text: str) -> str:
        peak = rf"\g<1> {values['peak']!r}"
        return without_steps(re.sub(r"(peak_acceleration string) \S+", peak, text))

    stock_deck = compose_for_stock(start.case, steps, start.beads)
    stock_text = minimal(stock_deck, load_case(start.case))
    return {
        "this project: Young–Laplace": Script(
            ENGINE, with_peak(deck.text), environment(stock=False)
        ),
        "liggghts: easo": Script(ENGINE, with_peak(stock_text), environment(stock=True)),
    }


def _scripts_of_lammps(values: Mapping[str, float | str], *, is_at_rest: bool) -> dict[str, Script]:
    """The contact models of LAMMPS; dry beads at rest are settled first."""
    material = "{modulus} {e} {poisson}".format(**values)
    sliding = "tangential mindlin NULL 1.0 {friction} damping tsuji".format(**values)
    adhesive_law = f"dmt {material} {values['tension']} {sliding}"
    history_law = "{stiffness} NULL 3e9 NULL {friction} 1".format(**values)
    contacts = {
        "lammps: granular, DMT": _GRANULAR.format(law=adhesive_law, **values),
        "lammps: granular, dry": _GRANULAR.format(
            law=f"hertz/material {material} {sliding}", **values
        ),
        "lammps: hertz/history, dry": _HISTORY.format(law=history_law, **values),
    }
    by_code = {}
    for code, commands in contacts.items():
        script = _LAMMPS_PILE.format(start="read_data lammps.data", contacts=commands, **values)
        settling = ""
        if is_at_rest and code.endswith("dry"):
            settling = script + _SETTLE_AND_KEEP
            start = f"read_restart {_SETTLED}"
            script = _LAMMPS_PILE.format(start=start, contacts=commands, **values)
        by_code[code] = Script(_LAMMPS, script, environment(stock=True), settling)
    return by_code


def _values(case: Case, peak: float | None) -> dict[str, float | str]:
    """Numbers that the scripts contain, in SI units; a peak of None is that of the case."""
    (harmonic,) = case.excitation.harmonics
    if peak is None:
        peak = harmonic.peak_acceleration
    contact = case.contact
    reduced = contact.youngs_modulus / (2.0 * (1.0 - contact.poissons_ratio**2))
    return {
        "modulus": contact.youngs_modulus,
        "poisson": contact.poissons_ratio,
        "stiffness": 4.0 / 3.0 * reduced,
        "e": contact.restitution,
        "friction": contact.friction.bead_bead,
        "angle": atan(contact.friction.bead_bead),
        "tension": case.liquid.surface_tension,
        "bridge": case.liquid.of_bridges.volume_fraction * bead_volume(min(case.radii)),
        "density": case.beads.density,
        "half": 0.5 * case.boundary.width,
        "gravity": case.environment.gravity,
        "peak": peak,
        "frequency": harmonic.frequency,
        "dt": case.run.time_step,
        "end": _END,
    }


def _write_beads(place: Path, beads: list[Bead], case: Case) -> None:
    """The beads as files for LAMMPS and YADE."""
    rows = [(*bead.centre, bead.radius, *bead.velocity, *bead.spin) for bead in beads]
    np.savetxt(place / "beads.txt", rows, fmt="%.17g")
    half = 0.5 * case.boundary.width + 2e-4
    top = max(bead.centre[2] for bead in beads) + case.boundary.height
    lines = [
        "beads",
        "",
        f"{len(beads)} atoms",
        "1 atom types",
        "",
        f"-{half} {half} xlo xhi",
        f"-{half} {half} ylo yhi",
        f"-2e-4 {top} zlo zhi",
        "",
        "Atoms # sphere",
        "",
    ]
    for bead in beads:
        lines.append(_row(bead.id, 1, 2.0 * bead.radius, case.beads.density, *bead.centre))
    lines += ["", "Velocities", ""]
    for bead in beads:
        lines.append(_row(bead.id, *bead.velocity, *bead.spin))
    (place / "lammps.data").write_text("\n".join(lines) + "\n", "utf-8")


def _row(*numbers: float) -> str:
    """Numbers with all digits."""
    return " ".join(map(repr, numbers))


def _neighbours(place: Path, beads: list[Bead]) -> float:
    """Mean number of touching neighbours of a bead at the end of the last run."""
    centres = _centres_at_end(place, len(beads))
    radii = np.array([bead.radius for bead in beads])
    pairs = cKDTree(centres).query_pairs(2.0 * radii.max(), output_type="ndarray")
    first, second = pairs.T
    distances = np.linalg.norm(centres[first] - centres[second], axis=1)
    touching = np.count_nonzero(distances < radii[first] + radii[second])
    return 2.0 * touching / len(beads)


def _centres_at_end(place: Path, count: int) -> FloatArray:
    """Centres of the beads, m, shape (N, 3): the last lines of a text, or the last frame."""
    end = place / _END
    if end.exists():
        lines = end.read_text("utf-8").splitlines()[-count:]
        end.unlink()
        return np.loadtxt(lines)
    return BinaryDump(place / "beads.bin", BEAD_COLUMNS).stack()[-1][:, 3:6]


if __name__ == "__main__":
    main()
