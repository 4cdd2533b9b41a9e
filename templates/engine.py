"""What LIGGGHTS-PUBLIC 3.8.0 (as Debian packages it) does wrong or unlike its manual, and what the decks do about it.

This is the only place that knows. Each entry names the defect, how it shows, and the remedy; the functions below are
the remedies that need arithmetic, the rest stands in the deck's blocks (``templates/blocks``).

Walls pull half as hard
    The capillary models take a wall for an equal sphere: 1.74 πγR at 1 % liquid, where a sphere on a plane is pulled
    by 4πγR (3.5 πγR at finite volume). ``easo/capillary/viscous`` at least pulls on touching walls; in
    ``washino/capillary/viscous`` the effective radius there is zero. Remedy: easo, and every wall stands in the deck
    twice (`WALL_COPIES`), which gives 3.48 πγR and the sphere–plane lubrication forces. Friction stays at μ times the
    total normal force; the contact gets twice as stiff.

Bridges to a wall that do not touch read a stranger's velocity
    The viscous force of an open wall bridge uses the velocity of the local atom whose number is that of the wall's
    triangle: it vanishes for bead 0 and is 80–90 % off for others; with a primitive wall it reads in front of the
    array, and crashes or not. Remedy: walls are meshes with one large triangle a face, and the first atoms of the
    deck, one a triangle, are *riders* that move with the walls and touch nothing, so that the velocity read is the
    wall's own. Spatial sorting is switched off, for it would renumber them.

A triangle is kept by its centroid
    Nodes far outside the simulation box are harmless (a warning), a centroid outside loses the triangle. One triangle
    far larger than the box leaves no edge inside it. See `substrate_triangle`.

The contact angle enters as ½ θi θj
    in radians, though given in degrees. Remedy: `contact_angle_setting`.

The liquid content is a fraction
    of the bead's volume; the manual says per cent. The deck gives the fraction.

Bridges are cut at a given separation
    ``maxSeparationDistanceRatio`` breaks a bridge at (ratio − 1)(Ri + Rj), at a wall at (ratio − 1) 2R, however much
    liquid it holds. Remedy: `separation_cap`, always beyond the rupture distance.

Gravity dies where its vector vanishes
    A time-dependent ``fix gravity`` normalises its vector and stays dead once that was exactly zero. Remedy: in the
    container frame the drive is a gravity of signed magnitude along a fixed unit vector, beside the constant one.

``-screen none`` crashes as soon as a mesh is read
    The engine's output is redirected instead.

A lost bead is no error
    Neither exit status nor an ERROR line tells: the deck prints the number of atoms every cycle.

Too large a time step is no error
    See `inputs.timestep`.

Reported forces of sliding contacts are wrong
    ``compute pair/gran/local`` and ``wall/gran/local`` evaluate the contact once more. The friction spring has been cut
    back to the Coulomb limit by then, so that rounding lets the contact pass for a sticking one, and a tangential
    damping force is added that never acted: 2.2e-4 N was seen where friction was 5e-6 N (the dumped total forces of
    the beads are right, and so is the trajectory). Remedy: only the normal part of these outputs is used.

Only one mesh wall fix is allowed
    ``mesh n_meshes N meshes m1 m2 …`` lists all of them.

A second ``thermo_style`` resets ``thermo_modify``
    Each deck has one.

Splitting a run changes the trajectory
    of chaotic systems, by rounding: each deck has one ``run``.
"""

from __future__ import annotations

from math import degrees, sqrt

AUDITED_VERSION = "LIGGGHTS-PUBLIC 3.8.0"
"""The version that all of this was measured on."""

WALL_COPIES = 2
"""How often a wall stands in the deck."""

SMALLEST_SEPARATION_CAP = 1.2


def contact_angle_setting(effective_angle: float) -> float:
    """The ``contactAngle`` of both atom types, in degrees, that makes the engine use an effective angle (rad).

    It computes ½ θi θj in radians, hence θi = θj = √(2θ).
    """
    return degrees(sqrt(2.0 * effective_angle))


def separation_cap(
    radii: tuple[float, float], rupture_at_wall: tuple[float, float], rupture_between_beads: float
) -> float:
    """``maxSeparationDistanceRatio`` beyond the rupture distance of every bridge, but not below 1.2.

    Parameters
    ----------
    radii
        Radii of the beads, m.
    rupture_at_wall, rupture_between_beads
        Rupture distances, m.
    """
    ratios = [rupture / (2.0 * radius) for radius, rupture in zip(radii, rupture_at_wall, strict=True)]
    ratios.append(rupture_between_beads / sum(radii))
    return max(SMALLEST_SEPARATION_CAP, 1.0 + 1.05 * max(ratios))


def substrate_triangle(half_width: float) -> str:
    """STL text of the plane z = 0 as one triangle, centroid in the origin, ten times wider than the box.

    Parameters
    ----------
    half_width
        Half of the simulation box's larger side, m.
    """
    size = 20.0 * half_width
    corners = ((-size, -0.6 * size), (size, -0.6 * size), (0.0, 1.2 * size))
    vertices = "".join(f"      vertex {x!r} {y!r} 0.0\n" for x, y in corners)
    return f"solid substrate\n  facet normal 0.0 0.0 1.0\n    outer loop\n{vertices}    endloop\n  endfacet\nendsolid\n"
