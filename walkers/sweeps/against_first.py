"""The points of a sweep compared with its first point, over the draws of their spreads.

`walkers.runs.draws` says what is compared. Runs that are no points of a sweep are compared in
`walkers.runs.comparison`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict

from walkers.errors import input_error
from walkers.postprocess.measure.quantities import declared, unit_shown
from walkers.runs.comparison import Comparison
from walkers.runs.draws import ComparedDraws, Draws, compare_draws
from walkers.runs.draws_text import (
    HEADS,
    assumptions,
    draws_text,
    reasons,
    rows_of,
    wrapped_sentences,
)
from walkers.sweeps.left_out import warn_left_out
from walkers.sweeps.spread import draws_of
from walkers.sweeps.table import SweepTable, default_column, key_texts
from walkers.terminal import table_width, wrapped
from walkers.text import aligned_blocks, with_unit


def compare_points(table: SweepTable) -> Comparison:
    """Compare the main number of each point of a sweep with that of the first point.

    Parameters
    ----------
    table
        The table of the sweep.

    Returns
    -------
    Comparison
        The bands of differences and ratios (`walkers.runs.draws.ComparedDraws`) by point. A
        `walkers.sweeps.left_out.LeftOutWarning` counts points without a spread.

    Raises
    ------
    InputError
        If the first point, or all others, have no spread.
    """
    frame = table.frame
    quantity = default_column(frame)
    name = str(frame.attrs["sweep"])
    draws = _draws_of_points(table, quantity)
    if 0 not in draws or len(draws) < 2:
        raise input_error(
            name,
            "expected a spread of the first point and of another one; "
            "first do: walkers sweep SWEEP --spread",
        )
    unit = declared(quantity).si_unit
    points: dict[int, ComparedDraws] = {}
    for point, draws_of_point in draws.items():
        compared = compare_draws(draws[0], draws_of_point, quantity, unit)
        if point and compared is not None:
            points[point] = compared
    left_out = len(frame) - 1 - len(points)
    if left_out:
        warn_left_out(f"{left_out} of {len(frame)} points have no spread of {quantity}")
    contents = {
        "sweep": name,
        "first": 0,
        "points": [{"point": point, **asdict(compared)} for point, compared in points.items()],
    }
    return Comparison(contents, _text(table, points))


def _draws_of_points(table: SweepTable, quantity: str) -> dict[int, Draws]:
    """The draws of the points whose table has a band of a quantity."""
    draws = {}
    for point, result in table.results.items():
        if f"{quantity}_low" not in result:
            continue  # no spread, or one over other ranges than those of the case
        draws_of_point = draws_of(result.directory)
        if draws_of_point is not None:
            draws[point] = draws_of_point
    return draws


def _text(table: SweepTable, points: Mapping[int, ComparedDraws]) -> str:
    """The bands of all points as a table, and what they assume."""
    several = list(points.values())
    unit, _ = unit_shown(several[0].unit)
    texts = key_texts(table.frame)
    rows = [["point", HEADS[0], *texts.columns, *HEADS[1:]]]
    sentences = []
    for point, compared in points.items():
        for unknowns, *cells in rows_of(compared):
            rows.append([str(point), unknowns, *texts.loc[point], *cells])
        sentences += [f"point {point}: {reason}" for reason in reasons(compared)]
    first = ", ".join(texts.astype(str).iloc[0])
    title = (
        f"{table.frame.attrs['sweep']}: {with_unit(several[0].quantity, unit)} of each point "
        f"against point 0 ({first})"
    )
    meaning = (
        "difference: less point 0; ratio: over point 0; median and in brackets 5 to 95 % of "
        f"{draws_text(several)}"
    )
    table_text = aligned_blocks(rows, table_width(), repeated=2)
    lines = wrapped_sentences([meaning, *assumptions(several), *sentences])
    return "\n".join([*wrapped(title, "  "), "", table_text, "", *lines])
