"""Measure the speeds that docs/explanation/other-codes.md states: ``make bench-codes`` prints its table.

The same beads, from the end of a shaken pile, in liggghts and in Debian's lammps and yade: with the same sizes,
density, walls, drive and time step, on one core. Codes run in turn, several times.

Beads at rest must touch as many neighbours in each code, or the comparison is of unlike piles: without adhesion, beads
that bridges had pressed together spring apart, and a dry pile would be timed in flight. Dry piles are therefore settled
first, by their own code, until they lie.
"""

from __future__ import annotations

import re
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from math import atan
from pathlib import Path
from statistics import median
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from tests.benchmark import (
    ENGINE,
    REPEATS,
    compose_for_stock,
    compose_from,
    cpu_time,
    environment,
    minimal,
    shaken,
    without_steps,
)
from walkers.inputs.reading import load_case
from walkers.inputs.tables.case import Case
from walkers.physics.capillary import bead_volume
from walkers.postprocess.measure.dump import BinaryDump
from walkers.runner.run_directory import write_deck
from walkers.templates.layout import BEAD_COLUMNS
from walkers.templates.placement import Bead

_PILES = {"pile-small": 20_000, "pile-fig1a": 6_000}
"""Cases and steps."""
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
material = ViscElCapMat(density={density}, frictionAngle={angle}, tc=4e-5, en={e}, et={e}, **liquid)
O.materials.append(material)
swing = {peak} / (2.0 * numpy.pi * {frequency})
for x, y, z, radius, vx, vy, vz, wx, wy, wz in numpy.loadtxt("beads.txt"):
    bead = sphere((x, y, z), radius, material=material)
    bead.state.vel, bead.state.angVel = (vx, vy, vz + swing), (wx, wy, wz)
    O.bodies.append(bead)
beads, planes = list(O.bodies), [(2, 0.0), (0, -{half}), (0, {half}), (1, -{half}), (1, {half})]
walls = O.bodies.append([wall(place, axis, material=material) for axis, place in planes])
shapes = Bo1_Sphere_Aabb(aabbEnlargeFactor=1.2), Bo1_Wall_Aabb()
meetings = Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=1.2), Ig2_Wall_Sphere_ScGeom()
laws = [Ip2_ViscElCapMat_ViscElCapMat_ViscElCapPhys()], [Law2_ScGeom_ViscElCapPhys_Basic()]
shake = dict(A=(0, 0, swing / (2.0 * numpy.pi * {frequency})), f=(0, 0, {frequency}), fi=(0, 0, -numpy.pi / 2.0))
O.engines = [
    ForceResetter(), InsertionSortCollider(list(shapes)), InteractionLoop(list(meetings), *laws),
    HarmonicMotionEngine(ids=walls, **shake), NewtonIntegrator(damping=0.0, gravity=(0, 0, -{gravity})),
]
O.dt = {dt}
if STEPS: O.run(STEPS, True)
numpy.savetxt("{end}", [bead.state.pos for bead in beads])
"""


class Script(NamedTuple):
    """How to run a code: its command, its input with STEPS for the number of steps, its environment.

    ``settling`` is the input that settles the beads first, in the same folder; empty if they lie already.
    """

    command: tuple[str, ...]
    text: str
    environment: Mapping[str, str]
    settling: str = ""


def main() -> None:
    """Print bead-steps per second and touching neighbours at the end, shaken and at rest."""
    print(
        "| code | beads | shaken: M bead-steps/s | neighbours | at rest: M bead-steps/s | neighbours |"
    )
    print("|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for case, steps in _PILES.items():
            beads, rows = shaken(case, Path(folder)), dict[str, list[list[float]]]()
            still = [
                replace(bead, velocity=(0.0, 0.0, 0.0), spin=(0.0, 0.0, 0.0)) for bead in beads
            ]
            for _ in range(REPEATS):
                for column, (start, peak) in enumerate(((beads, None), (still, 0.0))):
                    for code, script in scripts(
                        case, start, steps, Path(folder) / f"{case}-{column}", peak
                    ).items():
                        place = Path(folder) / f"{case}-{column}" / re.sub(r"\W+", "-", code)
                        _settle(script, place, _SETTLING_STEPS[case])
                        seconds = cpu_time(
                            place, script.command, script.text, steps, script.environment
                        )
                        row = rows.setdefault(code, [[] for _ in range(4)])
                        row[2 * column].append(1e-6 * len(beads) * steps / seconds)
                        row[2 * column + 1].append(_neighbours(place, beads))
            for code, row in rows.items():
                print(
                    f"| {code} | {len(beads)} |",
                    *(f"{median(values):.1f} |" for values in row),
                    flush=True,
                )


def _settle(script: Script, place: Path, steps: int) -> None:
    """Let the beads of a script come to rest, once."""
    if script.settling and not (place / _SETTLED).is_file():
        cpu_time(place, script.command, script.settling, steps, script.environment)


def scripts(
    case: str, beads: list[Bead], steps: int, folder: Path, peak: float | None
) -> dict[str, Script]:
    """Scripts of a pile for the codes that are installed; each code has its files in a folder by its name.

    ``peak`` is the acceleration of the drive, m/s²; None for that of the case.
    """
    deck, loaded = compose_from(case, steps, beads), load_case(case)
    stock_deck = compose_for_stock(case, steps, beads)
    values = _values(loaded, peak)
    changed = r"\g<1> {peak!r}".format(**values)
    ours, stock = (
        re.sub(r"(peak_acceleration string) \S+", changed, one)
        for one in (deck.text, minimal(stock_deck, loaded))
    )
    material = "{modulus} {e} {poisson}".format(**values)
    slip = "tangential mindlin NULL 1.0 {friction} damping tsuji".format(**values)
    found = {
        "this project: Young–Laplace": Script(
            ENGINE, without_steps(ours), environment(stock=False)
        ),
        "liggghts: easo": Script(ENGINE, without_steps(stock), environment(stock=True)),
    }
    if shutil.which(_LAMMPS[0]):
        laws = {
            "lammps: granular, DMT": (_GRANULAR, f"dmt {material} {values['tension']} {slip}"),
            "lammps: granular, dry": (_GRANULAR, f"hertz/material {material} {slip}"),
            "lammps: hertz/history, dry": (
                _HISTORY,
                "{stiffness} NULL 3e9 NULL {friction} 1".format(**values),
            ),
        }
        for name, (block, law) in laws.items():
            contacts = block.format(law=law, **values)
            fresh = _LAMMPS_PILE.format(start="read_data lammps.data", contacts=contacts, **values)
            if peak == 0.0 and name.endswith("dry"):
                settled = _LAMMPS_PILE.format(
                    start=f"read_restart {_SETTLED}", contacts=contacts, **values
                )
                found[name] = Script(
                    _LAMMPS, settled, environment(stock=True), fresh + _SETTLE_AND_KEEP
                )
            else:
                found[name] = Script(_LAMMPS, fresh, environment(stock=True))
    if shutil.which(_YADE[0]):
        found["yade: Rabinovich"] = Script(_YADE, _YADE_PILE.format(**values), {})
    for name in found:
        place = folder / re.sub(r"\W+", "-", name)
        place.mkdir(parents=True, exist_ok=True)
        write_deck(deck, place)
        _write_beads(place, beads, loaded)
    return found


def _values(case: Case, peak: float | None) -> dict[str, float | str]:
    """Numbers that the scripts contain, in SI units."""
    (harmonic,), contact = case.excitation.harmonics, case.contact
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
        "peak": harmonic.peak_acceleration if peak is None else peak,
        "frequency": harmonic.frequency,
        "dt": case.run.time_step,
        "end": _END,
    }


def _write_beads(place: Path, beads: list[Bead], case: Case) -> None:
    """The beads as files for LAMMPS and YADE."""
    rows = [(*bead.centre, bead.radius, *bead.velocity, *bead.spin) for bead in beads]
    np.savetxt(place / "beads.txt", rows, fmt="%.17g")
    half, top = (
        0.5 * case.boundary.width + 2e-4,
        max(bead.centre[2] for bead in beads) + case.boundary.height,
    )
    lines = ["beads", "", f"{len(beads)} atoms", "1 atom types", ""]
    lines += [f"-{half} {half} {axis}lo {axis}hi" for axis in "xy"] + [
        f"-2e-4 {top} zlo zhi",
        "",
        "Atoms # sphere",
        "",
    ]
    for bead in beads:
        lines.append(
            " ".join(map(repr, (bead.id, 1, 2.0 * bead.radius, case.beads.density, *bead.centre)))
        )
    lines += ["", "Velocities", ""]
    lines += [" ".join(map(repr, (bead.id, *bead.velocity, *bead.spin))) for bead in beads]
    (place / "lammps.data").write_text("\n".join(lines) + "\n", "utf-8")


def _neighbours(place: Path, beads: list[Bead]) -> float:
    """Touching neighbours of a bead at the end of the last run: from the last lines of a text, or the last frame."""
    if (end := place / _END).exists():
        centres = np.loadtxt(end.read_text("utf-8").splitlines()[-len(beads) :])
        end.unlink()
    else:
        centres = BinaryDump(place / "beads.bin", BEAD_COLUMNS).stack()[-1][:, 3:6]
    radii = np.array([bead.radius for bead in beads])
    one, other = cKDTree(centres).query_pairs(2.0 * radii.max(), output_type="ndarray").T
    return (
        2.0
        * np.sum(np.linalg.norm(centres[one] - centres[other], axis=1) < radii[one] + radii[other])
        / len(beads)
    )


if __name__ == "__main__":
    main()
