"""Tables of a bridge law that the contact model ``cohesion bridge`` interpolates.

``walkers/templates/engine/table.h`` describes their format. A law may have a kink at the gap
``scale``, between two cells.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import chain
from math import inf, log2

import numpy as np

from walkers.arrays import FloatArray
from walkers.inputs.bridge_laws import by_name
from walkers.physics.bridge import BridgeLaw, Curve, Forces, Surfaces, UnusableLawError, columns_at
from walkers.templates.placement import Surface

TOLERANCE = 1e-6
"""Tolerance of interpolated forces, relative to a column's largest value within a factor of two of the gap."""
_COARSE = 1e-4
"""The same where liquid is conserved: volumes are steps, and there are ten times as many tables."""
_COARSEST, _FINEST = 8, 256


@dataclass(frozen=True)
class BridgeTable:
    """The table of a law for two surfaces, as the engine reads it: a curve, the grid (``scale`` in m), and forces.

    ``rows`` are the forces at its gaps, shape (3 cells (octaves + 2) + 1, 5), as `walkers.physics.bridge.Forces`.
    """

    curve: Curve
    scale: float
    octaves: int
    cells: int
    rows: FloatArray

    @property
    def gaps(self) -> FloatArray:
        """Gaps of the rows, m."""
        return np.append(self.within(np.array([0.0, 1.0 / 3.0, 2.0 / 3.0])), self.curve.rupture)

    def within(self, parts: FloatArray) -> FloatArray:
        """Gaps at the given parts of all cells, m."""
        mantissas = (1.0 + (np.arange(self.cells)[:, None] + parts).ravel() / self.cells)[None, :]
        octaves = np.ldexp(1.0, np.arange(self.octaves))[:, None]
        near = self.scale * ((octaves * mantissas).ravel() - 1.0)
        middle = self.scale * (2.0**self.octaves - 1.0)
        even = (np.arange(2 * self.cells)[:, None] + parts).ravel() / (2 * self.cells)
        far = middle + (self.curve.rupture - middle) * (1.0 - (1.0 - even) ** 2)
        return np.concatenate([near, far])

    def interpolated(self, gaps: FloatArray) -> FloatArray:
        """Forces at gaps (m), shape (n, 5), as the engine interpolates them: by a cubic through the rows of a cell."""
        rupture = self.curve.rupture
        middle = self.scale * (2.0**self.octaves - 1.0)
        gaps = np.clip(gaps, 0.0, rupture)
        mantissa, exponent = np.frexp(1.0 + gaps / self.scale)
        near = self.cells * ((exponent - 1) + 2.0 * mantissa - 1.0)
        far = self.cells * (
            self.octaves + 2.0 * (1.0 - np.sqrt((rupture - gaps) / (rupture - middle)))
        )
        place = np.where(gaps < middle, near, far)
        cell = np.minimum(place.astype(int), (len(self.rows) - 1) // 3 - 1)
        # Lagrange's polynomials of the rows at 0, 1/3, 2/3 and 1 of the cell; products and sums alone
        # have the same bits on every processor.
        part = 3.0 * (place - cell)[:, None]
        first, second, third, fourth = (self.rows[3 * cell + number] for number in range(4))
        return np.asarray(
            -first * (part - 1.0) * (part - 2.0) * (part - 3.0) / 6.0
            + second * part * (part - 2.0) * (part - 3.0) / 2.0
            - third * part * (part - 1.0) * (part - 3.0) / 2.0
            + fourth * part * (part - 1.0) * (part - 2.0) / 6.0
        )

    def text(self) -> str:
        """The text of the table in the engine's file; twelve digits, far more accurate than `TOLERANCE`."""
        head = f"range {self.curve.formation!r} {self.curve.rupture!r} {self.scale!r} {self.octaves} {self.cells}"
        numbers = np.column_stack([self.gaps, self.rows])
        line = " ".join(
            ["%.12g"] * numbers.shape[1]
        )  # a pile has millions of numbers: one format a row takes half
        return "\n".join([head, *(line % tuple(row) for row in numbers.tolist())]) + "\n"


@lru_cache(maxsize=4096)
def tabulated(law: BridgeLaw, surfaces: Surfaces, tolerance: float = TOLERANCE) -> BridgeTable:
    """Tabulate a law as finely as the tolerance requires; raises `UnusableLawError` if that is not possible."""
    curve = law(surfaces)
    scale = curve.scale or surfaces.roughness
    octaves = max(int(log2(1.0 + 0.5 * curve.rupture / scale)), int(curve.rupture > scale))
    cells = _COARSEST
    while cells <= _FINEST:
        table = BridgeTable(curve, scale, octaves, cells, np.empty(0))
        table = replace(table, rows=columns_at(curve, table.gaps))
        worst, gap = _error(table)
        if worst <= tolerance:
            return table
        cells *= 2
    raise UnusableLawError(
        f"the finest table, of {_FINEST} cells per octave, has an error of {worst:.1g} at a gap of {gap:g} m; expected "
        f"a law that is smooth between contact, {scale:g} m and its rupture, {curve.rupture:g} m"
    )


def _error(table: BridgeTable) -> tuple[float, float]:
    """The largest relative error of the engine's interpolation between rows, and its gap (m)."""
    gaps = table.within(np.array([1.0 / 6.0, 0.5, 5.0 / 6.0]))
    exact = columns_at(table.curve, gaps)
    error = np.abs(table.interpolated(gaps) - exact)
    # Errors are relative to forces nearby: forces fall by orders of magnitude, and some end at zero.
    nearer = np.abs(exact[np.searchsorted(gaps, 0.5 * gaps)])
    size = np.maximum(np.maximum(nearer, np.abs(exact)), 1e-3 * np.abs(table.rows[:1]))
    relative = np.divide(error, size, out=np.zeros_like(error), where=size > 0.0).max(axis=1)
    worst = int(relative.argmax())
    return float(relative[worst]), float(gaps[worst])


def bridge_tables(
    surfaces: Sequence[Surface], sizes: Collection[tuple[int, float]], law: BridgeLaw | None = None
) -> str:
    """The bridge tables of a deck: one for every two surfaces that may meet (beads of different types never meet).

    The surfaces have the contact and the liquid of each atom type of beads, the sizes atom type and radius (m) of the
    beads; without a law, each liquid has its own.
    """
    parts = [
        "# Gap (m), pull (N), resistances: normal, sliding (N s/m), coupling (N s), rolling (N m s).\n"
    ]
    for kind, (contact, liquid) in enumerate(surfaces, 1):
        radii = sorted(radius for of, radius in sizes if of == kind)
        for number, radius in enumerate(radii):
            for other_kind, other_radius in [
                (len(surfaces) + 1, inf),
                *((kind, size) for size in radii[number:]),
            ]:
                for meeting in Surfaces.between(radius, other_radius, liquid, contact.roughness).volumes:
                    parts.append(
                        f'# law "{liquid.law}"\nbridge {kind} {other_kind} {radius!r} {other_radius!r}\n'
                    )
                    if liquid.conserved:
                        numbers = " ".join(map(repr, (meeting.volume, *chain(*meeting.films))))
                        parts.append(f"liquid {numbers}\n")
                    tolerance = _COARSE if liquid.conserved else TOLERANCE
                    parts.append(_table_text(law or by_name(liquid.law), meeting, tolerance))
    return "".join(parts)


@lru_cache(maxsize=256)
def _table_text(law: BridgeLaw, surfaces: Surfaces, tolerance: float) -> str:
    """The text of the table of a law for two surfaces; a deck and the manifest of its run need it."""
    return tabulated(law, surfaces, tolerance).text()


@dataclass(frozen=True)
class RecordedLaw:
    """A user's law as a run has recorded it: tables for its radii, interpolated as by the engine, and its file."""

    tables: str
    source: bytes | None

    @property
    def sha256(self) -> str | None:
        """SHA-256 of the file of the law."""
        return hashlib.sha256(self.source).hexdigest() if self.source is not None else None

    def __call__(self, surfaces: Surfaces) -> Curve:
        """The curve of two surfaces; raises `UnusableLawError` if the run has no such bridge."""
        for part in self.tables.split("\nbridge ")[1:]:
            head, text = part.split("\nrange ")
            if [float(word) for word in head.split()[2:4]] == [
                surfaces.radius,
                surfaces.other_radius,
            ]:
                return _recorded(text)
        raise UnusableLawError("the run has recorded no bridge between surfaces of these radii")


@lru_cache(maxsize=256)
def _recorded(text: str) -> Curve:
    head, *lines = text.partition("\n#")[0].splitlines()
    formation, rupture, scale, octaves, cells = map(float, head.split())
    rows = np.array([[float(word) for word in line.split()] for line in lines])
    curve = Curve(lambda gaps: Forces(*table.interpolated(gaps).T), rupture, formation, scale)
    table = BridgeTable(curve, scale, int(octaves), int(cells), rows[:, 1:])
    return curve
