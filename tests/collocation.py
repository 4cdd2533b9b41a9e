"""The Young–Laplace equation as a boundary-value problem, solved by collocation, apart from `walkers.physics.laplace`.

The profile r, z, φ and the volume v that it encloses, along its length L in parts of it, obey

    r' = L cos φ,    z' = L sin φ,    φ' = L (p - sin φ/r),    v' = L π r² sin φ,

from the wetting line of one solid to that of the other: four equations, eight conditions at the ends, and four unknown
numbers, the arcs from the solids' apices to the wetting lines, p and L. The closed form is the guess.
"""

from __future__ import annotations

from math import cos, inf, pi, sin

import numpy as np
from scipy.integrate import solve_bvp, solve_ivp

from walkers.physics.bridge import FloatArray
from walkers.physics.laplace import force_curve


def collocated(
    radius_1: float, radius_2: float, volume: float, contact_angle: float | tuple[float, float], gap: float
) -> tuple[float, float]:
    """Pull and energy over the surface tension at a gap; parameters as for `walkers.physics.laplace.force_curve`."""
    radii = (radius_1, radius_2)
    angles = contact_angle if isinstance(contact_angle, tuple) else (contact_angle, contact_angle)
    known = force_curve(*radii, volume, contact_angle, [gap])
    scale = volume ** (1.0 / 3.0)

    def slopes(_: FloatArray, y: FloatArray, unknown: FloatArray) -> FloatArray:
        upright = np.sin(y[2])
        rates = [np.cos(y[2]), upright, unknown[2] - upright / y[0], pi * y[0] ** 2 * upright]
        return np.asarray(unknown[3] * np.stack(rates))

    def start(unknown: FloatArray) -> FloatArray:
        turn, wide, rise, _, _ = _cap(radii[0] / scale, unknown[0])
        return np.array([wide, -rise, pi - angles[0] - turn, 0.0])

    def ends(first: FloatArray, last: FloatArray, unknown: FloatArray) -> FloatArray:
        turn, wide, rise, inside, _ = _cap(radii[1] / scale, unknown[1])
        whole = 1.0 + inside + _cap(radii[0] / scale, unknown[0])[3]
        expected = np.array([wide, gap / scale + rise, turn + angles[1], whole])
        return np.concatenate([first - start(unknown), last - expected])

    guess = np.array([*(known.arcs[0] / scale), known.pressures[0] * scale, known.lengths[0] / scale])
    mesh = np.linspace(0.0, 1.0, 41)
    profile = solve_ivp(lambda s, y: slopes(s, y, guess), (0.0, 1.0), start(guess), t_eval=mesh, rtol=1e-6).y
    found = solve_bvp(slopes, ends, mesh, profile, guess, tol=1e-10, max_nodes=20_000)
    assert found.success, found.message
    caps = [_cap(radius / scale, arc) for radius, arc in zip(radii, found.p[:2], strict=True)]
    wetted = sum(cos(angle) * cap[4] for angle, cap in zip(angles, caps, strict=True))
    nodes, weights = np.polynomial.legendre.leggauss(48)
    free = pi * found.p[3] * float(weights @ found.sol(0.5 * (nodes + 1.0))[0])
    radius, upright = found.y[0], np.sin(found.y[2])
    pulls = pi * (2.0 * radius * upright - found.p[2] * radius**2)
    neck = int(np.argmin(radius))
    return scale * float(pulls[neck]), scale**2 * (free - wetted)


def _cap(radius: float, arc: float) -> tuple[float, float, float, float, float]:
    """Filling angle, radius and height, volume and wetted area of a sphere's cap of an arc; a plane's has no height."""
    if radius == inf:
        return 0.0, arc, 0.0, 0.0, pi * arc**2
    turn = arc / radius
    wide, rise = radius * sin(turn), radius * (1.0 - cos(turn))
    return turn, wide, rise, pi / 6.0 * rise * (3.0 * wide**2 + rise**2), pi * (wide**2 + rise**2)
