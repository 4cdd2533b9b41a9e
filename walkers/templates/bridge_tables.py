"""Tables of a bridge law that the contact model ``cohesion bridge`` interpolates.

``walkers/templates/engine/table.h`` describes their format. A law may have a kink at the gap
``scale``, between two cells.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import inf, isclose, log2

import numpy as np

from walkers.arrays import FloatArray
from walkers.inputs.bridge_laws import by_name
from walkers.physics.bridge import BridgeLaw, Curve, Forces, Surfaces, UnusableLawError, columns_at
from walkers.physics.edges import edge_resistance
from walkers.templates.placement import Surface

TOLERANCE = 1e-6
"""Tolerance of interpolated forces, relative to the larger value at the gap and at half of it."""
_COARSE_TOLERANCE = 1e-4
"""The same where liquid is conserved: volumes are steps, and there are ten times as many tables."""
_COARSEST_CELLS = 8
"""Cells per octave of the coarsest table."""
_FINEST_CELLS = 256
"""Cells per octave of the finest table."""
_ROW_FORMAT = "%.12g"
"""Format of a number in the engine's file: twelve digits, far more accurate than `TOLERANCE`."""


@dataclass(frozen=True)
class BridgeTable:
    """The table of a law for two surfaces, as the engine reads it.

    Attributes
    ----------
    curve
        The law for the two surfaces.
    scale
        Gap over which the forces vary near contact, m: the first octave.
    octaves
        Number of octaves near contact, each twice as long as the one before.
    cells
        Cells per octave; beyond the octaves there are twice as many.
    rows
        The columns of `walkers.physics.bridge.Forces` at `gaps`, shape
        (3 cells (octaves + 2) + 1, 5).
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

    @property
    def end_of_octaves(self) -> float:
        """Gap at which the octaves end, m."""
        return float(self.scale * (2.0**self.octaves - 1.0))

    def within(self, parts: FloatArray) -> FloatArray:
        """Gaps at the given parts (0 to 1) of all cells, m."""
        mantissas = (1.0 + (np.arange(self.cells)[:, None] + parts).ravel() / self.cells)[None, :]
        octaves = np.ldexp(1.0, np.arange(self.octaves))[:, None]
        near = self.scale * ((octaves * mantissas).ravel() - 1.0)
        middle = self.end_of_octaves
        even = (np.arange(2 * self.cells)[:, None] + parts).ravel() / (2 * self.cells)
        far = middle + (self.curve.rupture - middle) * (1.0 - (1.0 - even) ** 2)
        return np.concatenate([near, far])

    def interpolated(self, gaps: FloatArray) -> FloatArray:
        """Forces as the engine interpolates them: by a cubic through the rows of a cell.

        Parameters
        ----------
        gaps : ndarray, shape (n,)
            Gaps, m; those outside of the table are moved to its ends.

        Returns
        -------
        ndarray, shape (n, 5)
            The columns of `walkers.physics.bridge.Forces`.
        """
        rupture = self.curve.rupture
        middle = self.end_of_octaves
        gaps = np.clip(gaps, 0.0, rupture)
        mantissa, exponent = np.frexp(1.0 + gaps / self.scale)
        near = self.cells * ((exponent - 1) + 2.0 * mantissa - 1.0)
        far = self.cells * (
            self.octaves + 2.0 * (1.0 - np.sqrt((rupture - gaps) / (rupture - middle)))
        )
        place = np.where(gaps < middle, near, far)  # in cells from the start of the table
        cell = np.minimum(place.astype(int), (len(self.rows) - 1) // 3 - 1)
        # Lagrange's polynomials of the rows at 0, 1/3, 2/3 and 1 of the cell; products and sums
        # alone have the same bits on every processor.
        part = 3.0 * (place - cell)[:, None]
        first, second, third, fourth = (self.rows[3 * cell + number] for number in range(4))
        return np.asarray(
            -first * (part - 1.0) * (part - 2.0) * (part - 3.0) / 6.0
            + second * part * (part - 2.0) * (part - 3.0) / 2.0
            - third * part * (part - 1.0) * (part - 3.0) / 2.0
            + fourth * part * (part - 1.0) * (part - 2.0) / 6.0
        )

    def text(self) -> str:
        """The text of the table in the engine's file."""
        curve = self.curve
        ends = f"{curve.formation!r} {curve.rupture!r}"
        lines = [f"range {ends} {self.scale!r} {self.octaves} {self.cells}"]
        numbers = np.column_stack([self.gaps, self.rows])
        # A pile has millions of numbers: one format for a row takes half of the time.
        row_format = " ".join([_ROW_FORMAT] * numbers.shape[1])
        lines += [row_format % tuple(row) for row in numbers.tolist()]
        return "\n".join(lines) + "\n"


@lru_cache(maxsize=4096)
def tabulated(law: BridgeLaw, surfaces: Surfaces, tolerance: float = TOLERANCE) -> BridgeTable:
    """Tabulate a law as finely as the tolerance requires.

    Parameters
    ----------
    law
        The law.
    surfaces
        The two surfaces and the volume of their bridge.
    tolerance
        Largest error of the interpolation between rows, relative to the forces nearby.

    Returns
    -------
    BridgeTable
        The coarsest table with this tolerance.

    Raises
    ------
    UnusableLawError
        If the law gives unusable forces, or is not smooth enough for the finest table.
    """
    curve = law(surfaces)
    scale = curve.scale or surfaces.roughness
    octaves = max(int(log2(1.0 + 0.5 * curve.rupture / scale)), int(curve.rupture > scale))
    cells = _COARSEST_CELLS
    while cells <= _FINEST_CELLS:
        table = BridgeTable(curve, scale, octaves, cells, np.empty(0))
        table = replace(table, rows=columns_at(curve, table.gaps))
        worst, gap = _error(table)
        if worst <= tolerance:
            return table
        cells *= 2
    raise UnusableLawError(
        f"the finest table, of {_FINEST_CELLS} cells per octave, has an error of {worst:.1g} "
        f"at a gap of {gap:g} m; expected a law that is smooth between contact, {scale:g} m "
        f"and its rupture, {curve.rupture:g} m"
    )


_LEAST_REFERENCE = 1e-3
"""Smallest force to which errors are relative, over the force at contact."""


def _error(table: BridgeTable) -> tuple[float, float]:
    """The largest relative error of the engine's interpolation between rows, and its gap (m).

    Errors are relative to the forces nearby, because forces fall by orders of magnitude, some to
    zero; but not to less than `_LEAST_REFERENCE` of the force at contact.
    """
    # Cells have rows at their ends and thirds. Errors are largest in between.
    gaps = table.within(np.array([1.0 / 6.0, 0.5, 5.0 / 6.0]))
    exact = columns_at(table.curve, gaps)
    error = np.abs(table.interpolated(gaps) - exact)
    at_half_gap = np.abs(exact[np.searchsorted(gaps, 0.5 * gaps)])
    nearby = np.maximum(at_half_gap, np.abs(exact))
    reference = np.maximum(nearby, _LEAST_REFERENCE * np.abs(table.rows[:1]))
    relative = np.divide(error, reference, out=np.zeros_like(error), where=reference > 0.0)
    largest = relative.max(axis=1)
    worst = int(largest.argmax())
    return float(largest[worst]), float(gaps[worst])


def bridge_tables(
    surfaces: Sequence[Surface], sizes: Collection[tuple[int, float]], law: BridgeLaw | None = None
) -> str:
    """The bridge tables of a deck: for every two surfaces that may meet, one for each volume.

    A bridge has a single volume unless liquid is conserved. Beads of different atom types never
    meet: they belong to walkers of different cases, which stand apart in a shared deck.

    Parameters
    ----------
    surfaces
        Contact parameters and liquid of each atom type of beads.
    sizes
        The different atom types (from 1) and radii (m) of the beads.
    law
        The law of all bridges; None: that of each liquid.

    Returns
    -------
    str
        The text of the engine's file (``engine/table.h``).

    Raises
    ------
    ValueError
        If there is no such law, or it cannot be tabulated (`UnusableLawError`).
    """
    parts = [
        "# Gap (m), pull (N), resistances: normal, sliding (N s/m), coupling (N s), "
        "rolling (N m s).\n"
    ]
    wall_type = len(surfaces) + 1
    for bead_type, surface in enumerate(surfaces, 1):
        radii = sorted(radius for atom_type, radius in sizes if atom_type == bead_type)
        for number, radius in enumerate(radii):
            parts += _tables_of_pair(surface, (bead_type, wall_type), (radius, inf), law)
            for other_radius in radii[number:]:
                types = (bead_type, bead_type)
                parts += _tables_of_pair(surface, types, (radius, other_radius), law)
    return "".join(parts)


def _tables_of_pair(
    surface: Surface,
    types: tuple[int, int],
    radii: tuple[float, float],
    law: BridgeLaw | None,
) -> list[str]:
    """Lines of the tables of two surfaces, one table for each volume that their bridge may have.

    Parameters
    ----------
    surface
        Contact parameters and liquid of both.
    types
        Atom types of the two.
    radii
        Radii of the two, m; that of a wall is infinite.
    law
        The law; None: that of the liquid.
    """
    contact, liquid = surface
    law = law or by_name(liquid.law)
    tolerance = _COARSE_TOLERANCE if liquid.conserved else TOLERANCE
    first_type, second_type = types
    first_radius, second_radius = radii
    bridge = f"bridge {first_type} {second_type} {first_radius!r} {second_radius!r}"
    lines = []
    meeting = Surfaces.between(first_radius, second_radius, liquid, contact.roughness)
    for with_volume in meeting.volumes:
        lines.append(f'# law "{liquid.law}"\n{bridge}\n')
        if liquid.conserved:
            lines.append(_liquid_line(with_volume))
        edge = edge_resistance(with_volume)
        if edge:
            lines.append(f"edge {edge!r}\n")
        lines.append(_table_text(law, with_volume, tolerance))
    return lines


def _liquid_line(surfaces: Surfaces) -> str:
    """The line with the volume of a bridge, and shares and films of its surfaces, all in m³."""
    shares, films = surfaces.films
    numbers = [surfaces.volume, *shares, *films]
    return f"liquid {' '.join([repr(number) for number in numbers])}\n"


@lru_cache(maxsize=256)
def _table_text(law: BridgeLaw, surfaces: Surfaces, tolerance: float) -> str:
    """The text of the table of a law for two surfaces, which deck and manifest of a run need."""
    return tabulated(law, surfaces, tolerance).text()


_SAME_VOLUME = 1e-6
"""Relative difference below which two volumes are the same: one step between volumes is √2."""


@dataclass(frozen=True)
class RecordedLaw:
    """A user's law as a run has recorded it; the user's file is not executed.

    Attributes
    ----------
    tables
        Text of the tables for the radii of the run, which are interpolated as by the engine.
    source
        Contents of the file of the law; None if the run has no copy.
    """

    tables: str
    source: bytes | None

    @property
    def sha256(self) -> str | None:
        """SHA-256 of the file of the law."""
        if self.source is None:
            return None
        return hashlib.sha256(self.source).hexdigest()

    def __call__(self, surfaces: Surfaces) -> Curve:
        """The curve of two surfaces and the volume of their bridge.

        Atom types are not compared: all beads of a run have the same surface and liquid.

        Raises
        ------
        UnusableLawError
            If the run has recorded no bridge between such surfaces, or none of this volume.
        """
        for table in self.tables.split("\nbridge ")[1:]:
            head, text = table.split("\nrange ")
            if _is_head_of(head, surfaces):
                return _recorded_curve(text)
        raise UnusableLawError(
            "the run has recorded no bridge between surfaces of these radii, or none of this volume"
        )


def _is_head_of(head: str, surfaces: Surfaces) -> bool:
    """Whether the head of a table, without the word ``bridge``, is that of two surfaces."""
    first_line, *further_lines = head.splitlines()
    _, _, *radii = first_line.split()  # after two atom types, the smaller radius first
    if [float(radius) for radius in radii] != [surfaces.radius, surfaces.other_radius]:
        return False
    for line in further_lines:
        word, number, *_ = line.split()  # of liquid, shares and films follow
        if word == "liquid":
            return isclose(float(number), surfaces.volume, rel_tol=_SAME_VOLUME)
    return True  # without conserved liquid, the radii determine the volume


@lru_cache(maxsize=256)
def _recorded_curve(text: str) -> Curve:
    """The curve that a table of the engine's file describes, from the text after ``range``."""
    head, *lines = text.partition("\n#")[0].splitlines()
    formation, rupture, scale, octaves, cells = _numbers_in(head)
    rows = np.array([_numbers_in(line) for line in lines])

    def forces(gaps: FloatArray) -> Forces:
        """Forces at gaps (m), interpolated in the table that is made below."""
        return Forces(*table.interpolated(gaps).T)

    curve = Curve(forces, rupture, formation, scale)
    table = BridgeTable(
        curve=curve, scale=scale, octaves=int(octaves), cells=int(cells), rows=rows[:, 1:]
    )
    return curve


def _numbers_in(line: str) -> list[float]:
    """The numbers of a line."""
    return [float(word) for word in line.split()]
