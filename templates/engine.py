"""What LIGGGHTS-PUBLIC 3.8.0 (as Debian packages it) does wrong or unlike its manual, and what the decks do about it.

This is the only place that knows; docs/explanation/engine.md is made from `DEFECTS` and an audit. The functions
below are the workarounds that need arithmetic, the rest stands in the deck's blocks (``templates/blocks``).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from math import degrees, log, sqrt

from walkers.inputs.boundary import Face, Round
from walkers.physics.capillary import bridge_volume_between_beads, rupture_distance, rupture_distance_at_wall
from walkers.physics.wall import WALL_COPIES
from walkers.templates.scene import Bead


@dataclass(frozen=True)
class Defect:
    """Something that the engine does wrong, or unlike its manual.

    Attributes
    ----------
    name
        What it is.
    shows
        How it shows.
    workaround
        What is done about it.
    watched_by
        Names of the audit's checks that would notice a change.
    """

    name: str
    shows: str
    workaround: str
    watched_by: tuple[str, ...] = ()


DEFECTS = (
    Defect(
        "Walls pull half as hard",
        "The capillary models take a wall for an equal sphere: 1.74 πγR at 1 % liquid, where a sphere on a plane "
        "is pulled by 4πγR (less at finite volume). `easo/capillary/viscous` at least pulls on touching walls;"
        " in `washino/capillary/viscous` the effective radius there is zero.",
        "easo, and every wall stands in the deck twice, which gives 3.48 πγR and the lubrication forces of a "
        "sphere on a plane. All of the contact is doubled: stiffness, damping (hence less restitution), the "
        "friction spring; the friction limit stays at μ times the total normal force.",
        (
            "capillary-wall",
            "restitution",
            "hertz",
        ),
    ),
    Defect(
        "Open bridges to a wall read a stranger's velocity",
        "The viscous force of a wall bridge that does not touch uses the velocity of the local atom whose number "
        "is that of the wall's triangle: it vanishes for bead 0 and is 80-90 % off for others. With a primitive "
        "wall it reads in front of the array, and crashes or not.",
        "Walls are meshes with one large triangle a face, and the first atoms of every deck, one a triangle and "
        "MPI rank, are carriers that move with the walls and touch nothing, so that the velocity read is the wall's"
        " own. Spatial sorting is off, for it would renumber them.",
        (
            "viscous-walls",
            "viscous-carriers",
            "ranks",
        ),
    ),
    Defect(
        "Open bridges to a wall drag half as hard",
        "As the wall counts as an equal sphere, R* is R/2, and twice 6πηR*²/h is half of a plane's 6πηR²/h. While the "
        "bridge is shorter than half of the minimum separation, nothing is missing; from the whole of it on it is "
        "half, and up to a fifth of the tangential drag. The walkers of Fig. 4b, whose beads part in every cycle, "
        "walked at 9.2 mm/s so, and at 7.7 with what was missing; those whose contacts stay closed are the same.",
        "The missing half of the normal drag is an added force, a formula of place and velocity, wherever a bead is "
        "nearer to a wall than its bridge reaches, whether it has touched the wall or not. Tangential drag stays as it "
        "is, for the engine can add no torque: it is small where a bridge is open.",
        (
            "viscous-walls",
            "open-bridges",
        ),
    ),
    Defect(
        "The contact angle enters as ½ θi θj",
        "in radians, though given in degrees: 30° acts as 7.9°.",
        "Both types are given √(2θ) for an effective angle θ.",
        ("contact-angle",),
    ),
    Defect(
        "Bridges are cut at a given separation",
        "`maxSeparationDistanceRatio` breaks a bridge at (ratio - 1)(Ri + Rj), at a wall at (ratio - 1) 2R, "
        "however much liquid it holds; and a wall loses sight of a bead, bridge and all, at (1.1 ratio - 1) R, "
        "which is nearer: at 1.2 a bridge with a contact angle of 30° broke at 0.32 R instead of 0.35 R.",
        "The ratio is computed so that it lies beyond the rupture distance of every bridge.",
        (
            "capillary-beads",
            "capillary-wall",
            "contact-angle",
        ),
    ),
    Defect(
        "Reported forces of sliding contacts are wrong",
        "`compute pair/gran/local` and `wall/gran/local` evaluate the contact once more. The friction spring has "
        "been cut back to the Coulomb limit by then, so that rounding lets the contact pass for a sticking one, "
        "and a tangential damping force is added that never acted: 2.2e-4 N was seen where friction was 5e-6 N. "
        "The beads' total forces and the trajectory are right.",
        "Only the normal part of these outputs is used.",
        ("reported-forces",),
    ),
    Defect(
        "The liquid content is a fraction",
        "of the bead's volume; the manual says per cent.",
        "The deck gives the fraction.",
        ("capillary-beads",),
    ),
    Defect(
        "Gravity dies where its vector vanishes",
        "A time-dependent `fix gravity` normalises its vector and stays dead once that was exactly zero.",
        "In the container frame the drive is a gravity of signed magnitude along a fixed vector, beside the "
        "constant one.",
        ("frames",),
    ),
    Defect(
        "A restart moves on a little differently",
        "A run that goes on from `read_restart`, or with a second `run` command, is not bit for bit the uninterrupted "
        "one: at its begin forces are evaluated once more, and a contact that slides may pass for one that sticks (as "
        "in reported forces). Half a step of a damping force that never acted made a walker slip by 0.08 µm.",
        "Piles are restarted for their statistics. Walkers are made in one `run` unless their case asks for segments; "
        "those that are not steady are made again for longer, not gone on with.",
        ("restart",),
    ),
    Defect(
        "Deleting atoms loses open bridges",
        "`delete_atoms` moves the last atoms into the places of those that go, and their contacts' histories not: "
        "bridges that were open are gone, and walkers whose contacts open were 30 % too slow.",
        "No deck deletes atoms.",
    ),
    Defect(
        "A restart file may lack what is between beads",
        "`write_restart` begins anew before it writes: the springs of contacts between beads and their open bridges "
        "are not in the file (those at walls are). A pile lost all open bridges, a quarter of its bridges, at the end "
        "of every part.",
        "The file is written by `restart`, within the run. All open bridges come back, on one rank and on two, and a "
        "pile moves on within 0.2 nm of an engine that keeps all of it.",
        ("restart-bridges",),
    ),
    Defect(
        "Too large a time step is no error",
        "The lubrication force is stiff: past its limit beads heat up, and at several times the limit are lost, "
        "in silence.",
        "The time step respects a viscous limit beside Rayleigh's and Hertz's (`walkers.physics.time_step`).",
        (
            "step-walker",
            "step-pile",
        ),
    ),
    Defect(
        "A lost bead is no error",
        "Neither exit status nor an ERROR line tells.",
        "The deck prints the number of atoms, their speed and extent a few times a cycle; the runner reads them.",
    ),
    Defect(
        "A triangle is kept by its centroid",
        "Nodes far outside the simulation box are harmless (a warning); a centroid outside loses the triangle.",
        "A face is one triangle far larger than the box, its centroid inside: no edge is ever met.",
        ("viscous-walls",),
    ),
    Defect(
        "A round wall holds a bead twice",
        "It is made of triangles, and a bead within it faces two of them near each of their borders. Those of one mesh "
        "that count as coplanar neighbours hold it once and pass its contact on, open bridge and all, but a bead that "
        "comes to a triangle of a lower number is held by both until it leaves the first: in a closed prism at a "
        "seventh of the places. The engine's own cylinder reads in front of an array, as all its primitive walls do.",
        "Each size of beads has a prism of its own, as a mesh of these beads' group: a mesh meets its group alone. "
        "(The fix of the walls must be of all atoms, for its group's number, 0, is mixed with the mesh's mask.) The "
        "faces are so narrow that they end where these beads, touching, leave one for the next, and `precision` is so "
        "coarse that the edges between them count as shared all the same. Beads that touch are held twice at less than "
        "2 % of the places, and on half of their ways only; open bridges at so much more as their gap is of the radius "
        "at which the beads move.",
        ("cylinder",),
    ),
    Defect(
        "Friction passes its limit in damped impacts",
        "At the end of a damped impact the damping exceeds the elastic repulsion and pulls the bead back. The limit of "
        "friction is μ times the magnitude of the sum, so that the pull counts as a load; and while the friction "
        "spring alone is below the limit, as in the first step of a contact, its damping comes on top. Where a sphere "
        "slides all the way it loses 1.17 times the tangential velocity μ(1+e)v_n at a restitution of 0.5 and 1.45 "
        "times at 0.3, on a doubled wall 1.33 and 1.91 times. Without damping, and in steady sliding, the limit is "
        "right.",
        "None: it takes impacts, and a case may ask for more restitution, with which it vanishes.",
        ("impact-spin", "impact-unequal", "first-step"),
    ),
    Defect(
        "Only one mesh wall fix is allowed",
        "A second `fix wall/gran ... mesh` is refused.",
        "`mesh n_meshes N meshes m1 m2 ...` lists all of them.",
    ),
    Defect(
        "A page is cleared in every step",
        "Each mesh sets a whole page of `neigh_modify page` bytes to zero in every step, 100,000 by default: for few "
        "walkers that takes a sixth of the time, or more.",
        "The page is small: room for ten beads with as many neighbours as there is place for. Too small a one is an "
        "ERROR.",
    ),
    Defect(
        "An abort swallows its message",
        "when the output is a file, for the buffer is not flushed. `-screen none` crashes as soon as a mesh is read.",
        "The engine is run through `stdbuf -oL`, its output redirected.",
    ),
    Defect(
        "Dies within a step of SLURM",
        "Started as one process inside an `srun` step, it takes itself for a part of the step's MPI job and ends in "
        "MPI_Init. `srun` cannot start its ranks either: Debian's SLURM and Open MPI have no PMI in common.",
        "The variables that tell of the step are taken from its environment; ranks are started by `mpirun`.",
    ),
    Defect(
        "Engines that start together trip over each other",
        "Each process without `mpirun` starts Open MPI's daemon `orted`; all of them make and remove one shared folder "
        "in TMPDIR, so that now and then one finds it gone and ends before it began (2 of 1,500 with two at a time). "
        "The daemon outlives its engine, keeps the files open that it inherits, and both listen on all network "
        "interfaces.",
        "Engines of one process are told to do without daemon, folder and network (`ALONE`): 0 of 5,000 failed with "
        "eight at a time, and the start takes a quarter of the time. One that never started is tried again.",
    ),
    Defect(
        "A position that is no number",
        'ends in "Internal error (./src/tri_mesh_I.h:109)": no number lies on any side of a triangle\'s edges.',
        "The runner tells it as a blow-up.",
    ),
)

AUDITED_VERSION = "LIGGGHTS-PUBLIC 3.8.0"
"""The version that all of this was measured on."""

POSITION_IS_NO_NUMBER = "tri_mesh_I.h:109"
"""In the ERROR line of an engine that has met a bead whose position is no number."""

STEP_VARIABLES = ("SLURM_STEP_ID", "SLURM_STEPID", "SLURM_PROCID")
"""Variables of the environment that the engine must not see."""

ALONE = {
    "OMPI_MCA_ess_singleton_isolated": "1",  # no orted
    "OMPI_MCA_orte_create_session_dirs": "0",  # no folder in TMPDIR
    "OMPI_MCA_btl": "self",  # no network
    "OMPI_MCA_pml": "ob1",  # no look for one either, which takes half of the time
}
"""Variables of the environment of an engine of one process; with the first alone 14 starts of 1,500 failed."""

RANKS = {"OMPI_MCA_btl": "self,vader", "OMPI_MCA_pml": "ob1", "OMPI_MCA_mpi_yield_when_idle": "1"}
"""Variables of the environment of an engine of several processes on one machine: they meet in its memory.

`mpirun` itself listens on the network that it sees (`walkers.runner.launch` leaves it the loopback); started so, two
ranks take 0.7 of the time to start. Ranks that wait leave
their core to others: beside four busy processes a pile took a quarter of the time.
"""

SMALLEST_SEPARATION_CAP = 1.2


_SIGHT = 1.1
"""The engine looks for contacts up to this times ``maxSeparationDistanceRatio`` times the sum of the radii."""


@dataclass(frozen=True)
class Workarounds:
    """Which of the workarounds a deck carries: all of them, but for decks that show what happens without one.

    Attributes
    ----------
    carriers
        Atoms that carry the walls' velocity, created first.
    wall_copies
        How often every wall stands in the deck.
    contact_angle
        Whether the contact angle is translated.
    open_bridges
        Whether open bridges to walls are given the half of their normal drag that the engine leaves out.
    restart_in_run
        Whether restart files are written within a run.
    """

    carriers: bool = True
    wall_copies: int = WALL_COPIES
    contact_angle: bool = True
    open_bridges: bool = True
    restart_in_run: bool = True


ALL_WORKAROUNDS = Workarounds()
NO_WORKAROUNDS = Workarounds(carriers=False, wall_copies=1, contact_angle=False, open_bridges=False)
"""Of decks for the project's own contact model."""


def contact_angle_setting(effective_angle: float) -> float:
    """The ``contactAngle`` of both atom types, in degrees, that makes the engine use an effective angle (rad).

    It computes ½ θi θj in radians, hence θi = θj = √(2θ).
    """
    return degrees(sqrt(2.0 * effective_angle))


STATIC_SPRING = 2000.0
"""N/m; walkers on such springs walk within 0.3 % as fast as on Hertz's at 50 MPa."""


def static_friction_settings(ratio: float, restitution: float) -> dict[str, float]:
    """Properties that the model ``tan_luding`` asks for, with the normal model ``luding`` as a damped linear spring.

    Its coefficient of friction is that at rest. Where the spring along the surface would hold more, it is cut to what
    the one in motion allows, and sticks again at once.

    Parameters
    ----------
    ratio
        Friction at rest over that in motion.
    restitution
        Of the contacts.
    """
    return {
        "LoadingStiffness": STATIC_SPRING,
        "UnloadingStiffness": 1.0,
        "coefficientAdhesionStiffness": 0.0,
        "coefficientPlasticityDepth": 0.05,
        "pullOffForce": 0.0,
        "coefficientRestitutionLog": log(restitution),
        "FluidViscosity": 1.0 / ratio,
        "FrictionViscosity": 1e-9,
        "coeffFrictionStiffness": 0.8,
    }


def separation_cap(radii: Iterable[float], volume_fraction: float, contact_angle: float) -> float:
    """``maxSeparationDistanceRatio`` beyond the rupture distance of every bridge, but not below 1.2.

    Parameters
    ----------
    radii
        Radii of the beads, m.
    volume_fraction
        Liquid on a bead over the bead's volume.
    contact_angle
        Effective contact angle, rad.
    """
    sizes = sorted(set(radii))
    ratios = []
    for radius in sizes:
        at_wall = rupture_distance_at_wall(radius, volume_fraction, contact_angle) / radius
        ratios += [at_wall / 2.0, (1.0 + at_wall) / _SIGHT - 1.0]
    for first, second in combinations_with_replacement(sizes, 2):
        volume = bridge_volume_between_beads(first, second, volume_fraction)
        ratios.append(rupture_distance(volume, contact_angle) / (first + second))
    return max(SMALLEST_SEPARATION_CAP, 1.0 + 1.05 * max(ratios))


def face_triangle(face: Face, size: float) -> str:
    """STL facet of a face: one triangle about the face's centroid, its normal toward the beads.

    Parameters
    ----------
    face
        The wall.
    size
        Half of the triangle's width, m; far larger than the box.
    """
    index = ("x", "y", "z").index(face.axis)
    # Two axes in the plane of the wall, in the order that makes the corners run counter-clockwise about the normal.
    first, second = ((index + 1) % 3, (index + 2) % 3)[:: face.side]
    corners = []
    for along, up in ((-1.0, -0.6), (1.0, -0.6), (0.0, 1.2)):
        offset = [0.0, 0.0, 0.0]
        offset[first], offset[second] = along * size, up * size
        away = face.turned((offset[0], offset[1], offset[2]))
        corners.append([middle + shift for middle, shift in zip(face.centroid, away, strict=True)])
    return _facet(face, corners)


_SLACK = 0.02
"""By how much of their radius beads may be pressed into a round wall without a gap between its faces."""
_SAME_SIZE = 0.01
"""Of a round wall's radius: beads whose radii differ by less share its mesh."""
_COARSEST = 9e-4
"""m; the engine takes no precision of a mesh above a millimetre."""


@dataclass(frozen=True)
class WallMesh:
    """The walls as some of the beads meet them.

    Attributes
    ----------
    name
        Of its file, without the suffix.
    text
        STL.
    beads
        Ids of the beads that meet it; empty if all do.
    precision
        Distance up to which the engine takes two nodes for one, m; None for its own.
    """

    name: str
    text: str
    beads: tuple[int, ...] = ()
    precision: float | None = None


def wall_meshes(beads: Iterable[Bead], faces: Sequence[Face], half_width: float) -> tuple[WallMesh, ...]:
    """The walls: one mesh for all beads, or where a wall is round, one for each size of beads.

    Parameters
    ----------
    beads
        What is within the walls.
    faces
        The walls.
    half_width
        Half of the simulation box's largest side, m.
    """
    around = next((face.of for face in faces if face.of), None)
    if around is None:
        return (WallMesh("walls", _stl(face_triangle(face, 20.0 * half_width) for face in faces)),)
    sizes: list[list[Bead]] = []
    for bead in sorted(beads, key=lambda one: (one.radius, one.id)):
        if not sizes or bead.radius - sizes[-1][0].radius > _SAME_SIZE * around.radius:
            sizes.append([])
        sizes[-1].append(bead)
    meshes = []
    for number, size in enumerate(sizes, 1):
        half = around.half_width((1.0 - _SLACK) * size[0].radius)
        facets = (strip(face, face.of, half) if face.of else face_triangle(face, 20.0 * half_width) for face in faces)
        ids = tuple(sorted(bead.id for bead in size))
        # Nodes of adjacent faces are less than that apart, those of one face twice as far.
        meshes.append(WallMesh(f"walls_{number}", _stl(facets), ids, min(half, _COARSEST)))
    return tuple(meshes)


def strip(face: Face, around: Round, half: float) -> str:
    """STL facets of a side of a round wall: an upright strip, each piece of it two triangles.

    Parameters
    ----------
    face
        The side.
    around
        The round wall.
    half
        Half of the strip's width, m.
    """
    x, y, _ = face.centroid
    facets = []
    for piece in range(around.pieces):
        bottom, top = (around.bottom + (around.top - around.bottom) * (piece + end) / around.pieces for end in (0, 1))
        corners = []
        for along, z in ((-half, bottom), (half, bottom), (half, top), (-half, top)):
            right, up, _ = face.turned((0.0, along, 0.0))
            corners.append((x + right, y + up, z))
        facets += [_facet(face, [corners[number] for number in numbers]) for numbers in ((0, 3, 2), (0, 2, 1))]
    return "".join(facets)


def _facet(face: Face, corners: Iterable[Sequence[float]]) -> str:
    vertices = "".join("      vertex " + " ".join(repr(float(value)) for value in one) + "\n" for one in corners)
    normal = " ".join(repr(value) for value in face.normal)
    return f"  facet normal {normal}\n    outer loop\n{vertices}    endloop\n  endfacet\n"


def _stl(facets: Iterable[str]) -> str:
    return f"solid walls\n{''.join(facets)}endsolid walls\n"
