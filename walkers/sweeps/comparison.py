"""Comparison of two runs, or of two sweeps point by point: parameters and results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot, isfinite, nan
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from walkers.errors import refused
from walkers.postprocess.numbers import ASIDE, headline
from walkers.postprocess.quantities import is_error, scatter_of, unit_shown
from walkers.postprocess.results import Results, plain, read
from walkers.postprocess.sides import alike
from walkers.rounding import rounded
from walkers.runner.directory import case_of
from walkers.sweeps import table as sweeps
from walkers.sweeps.readable import differing, flattened, readable
from walkers.text import aligned

if TYPE_CHECKING:
    from walkers.inputs.case import Case

_VELOCITIES = ("velocity", "right_facing", "left_facing")
"""Columns whose scatter is in the result."""
_FIRST_MAKE = ("rotation", "sliding", "sliding_pair", "open", "open_pair")
_OF_ALL = ("orientation_end", "separated_fraction")
"""Columns that are means over walkers of the first make, and over all walkers."""


class Side(NamedTuple):
    """A side of a comparison: its name, its case, and the directory of its finished run if there is one."""

    name: str
    case: Case
    directory: Path | None


@dataclass(frozen=True)
class Comparison:
    """Differences as JSON, in SI units (keys of sweeps in the units of their files), and as text in readable units."""

    contents: Mapping[str, Any]
    text: str


def _pair(
    quantity: str, unit: str, values: Sequence[Any], scatters: Sequence[Any], numerical: float = nan
) -> tuple[dict[str, Any], list[str]]:
    """A quantity of both sides, with difference and errors, as JSON (SI units) and cells of text (readable units)."""
    quantities = (*values, *scatters)
    first, second, *errors = (nan if value is None or isinstance(value, str) else float(value) for value in quantities)
    difference = second - first
    names = ("quantity", "unit", "first", "second", "first_scatter", "second_scatter", "difference", "numerical_error")
    numbers = (quantity, unit, first, second, *errors, difference, numerical)
    contents = plain(dict(zip(names, numbers, strict=True)))
    usual, size = unit_shown(unit)
    printed = [rounded(value * size, usual) for value in (first, second)]
    if abs(difference) < 2e-3 * abs(first):  # digits that are not printed would contradict the printed ones
        difference = (float(printed[1]) - float(printed[0])) / size
    both = " and ".join(_two_digits(error * size, usual) for error in errors if isfinite(error)) or "-"
    cells = [*printed, _signed(difference * size, usual), both, _two_digits(numerical * size, usual)]
    return contents, [sweeps.with_unit(quantity, usual), *cells]


def _signed(value: float, unit: str) -> str:
    text = rounded(value, unit)
    return text if text[:1] == "-" or text == "0" else f"+{text}"


def _two_digits(value: float, unit: str) -> str:
    text = rounded(float(f"{value:.2g}"), unit)
    return f"{value:.1g}" if text == "0" else text


def compare_runs(first: Side, second: Side) -> Comparison:
    """Compare two runs, or cases not yet run."""
    names, runs = [first.name, second.name], [side.directory for side in (first, second) if side.directory]
    not_run = [side.name for side in (first, second) if side.directory is None]
    parameters, differences = _different([first.case, second.case], names)
    pairs = [] if not_run else _pairs([read(run) for run in runs])
    apart = [(row, cells) for row, cells in pairs if row["first"] != row["second"]]
    text = [differences or "the cases are the same"]
    for row, cells in apart:
        if row["quantity"] == "cycles" and not differences:
            text = [f"{text[0]}, but ran {' and '.join(cells[1:3])} cycles"]
    if apart:
        heads = ["result", *names, "difference", "scatter of copies", "numerical error"]
        text.append(aligned([heads, *(cells for _, cells in apart)]))
        text += [_times_the_error(row) for row, _ in apart if row["quantity"] in _VELOCITIES and row["numerical_error"]]
    if same := [row["quantity"] for row, _ in pairs if row["first"] == row["second"]]:
        text.append(f"the same in both: {', '.join(same)}" if apart else "all results are the same")
    text += [f"{name}: no finished run; only the parameters are compared" for name in not_run]
    contents = {"first": first.name, "second": second.name, "parameters": parameters, "not_run": not_run}
    return Comparison(contents | {"results": [row for row, _ in pairs]}, "\n\n".join(text))


def _times_the_error(row: Mapping[str, Any]) -> str:
    times = abs(row["difference"]) / row["numerical_error"]
    return f"{row['quantity']}: differs by {_two_digits(times, '')} times its numerical error"


def _different(cases: Sequence[Case], names: Sequence[str]) -> tuple[dict[str, list[Any]], str]:
    """The given values by which two cases differ (not derived values), in SI units, and as text."""
    flat = [flattened(case) for case in cases]
    parameters = {key: [parameters_of_case.get(key) for parameters_of_case in flat] for key in differing(flat)}
    rows = [[key, *(readable(key, value) for value in values)] for key, values in parameters.items()]
    return parameters, aligned([["parameter", *names], *rows]) if rows else ""


def _pairs(results: Sequence[Results]) -> list[tuple[dict[str, Any], list[str]]]:
    """The numbers of two results, without errors, values of the case and conditions, and means over both facings."""
    scatters, heads = [_scatters(result) for result in results], {*map(headline, results)}
    little = _VELOCITIES if "axial_velocity" in heads else ("velocity",) if "right_facing" in heads else ()
    names = {name for result in results for name in result if not is_error(name)}
    pairs = []
    for name, (unit, _) in sweeps.columns_of(names.difference(ASIDE, little, ["coverage"])).items():
        error = hypot(*(result.get(f"{name}_error", nan) for result in results))
        both = [result.get(name) for result in results], [scatter.get(name) for scatter in scatters]
        numbers, cells = _pair(name, unit, *both, error)
        if numbers["first"] is not None or numbers["second"] is not None:
            pairs.append((numbers, cells))
    return pairs


def _scatters(result: Results) -> dict[str, float]:
    """Standard deviations of columns over copies, from the result or from the table of the walkers."""
    if "velocity" not in result:
        return {}
    scatters = {name: float(result[scatter_of(name)]) for name in _VELOCITIES}
    walkers = result.table("walkers")
    walkers = walkers[alike(walkers, uphill=result["goes_uphill"])]
    for name in walkers.columns:
        of_first = name.rpartition("_")[0] in _FIRST_MAKE
        rows = walkers[walkers["make"] == 0] if of_first else walkers
        if len(rows) > 1 and (of_first or name in _OF_ALL):
            scatters[name] = float(rows[name].std(ddof=1))
    return scatters


def compare_sweeps(first: Path, second: Path, column: str | None = None) -> Comparison:
    """Compare a column of two sweeps (default: ``velocity`` or ``climbs``) at the points that are finished in both.

    `InputError` if the varied keys differ, no finished point is common, or a sweep has no such column.
    """
    tables, source = [sweeps.load(directory) for directory in (first, second)], f"{first}, {second}"
    names = [str(table.attrs["sweep"]) for table in tables]
    names = [str(first), str(second)] if names[0] == names[1] else names
    values, values_of_second = (
        {key: sweeps.key_values(table, key) for axis in table.attrs["axes"] for key in axis} for table in tables
    )
    units = [{key: unit for key, (_, unit) in keys.items()} for keys in (values, values_of_second)]
    heads = [[*map(sweeps.with_unit, units_of_keys, units_of_keys.values())] for units_of_keys in units]
    if units[0] != units[1]:
        differences = " and ".join(", ".join(head) or "nothing" for head in heads)
        raise refused(source, f"expected sweeps that vary the same keys in the same units: {differences}")
    numeric = [name for name in tables[0].columns if name in tables[1] and tables[0][name].dtype.kind in "fiu"]
    column = sweeps.find_name("column", column or sweeps.default_column(max(tables, key=sweeps.sides_differ)), numeric)
    keyed = [table.assign(at=[", ".join(row) for row in sweeps.key_texts(table).to_numpy()]) for table in tables]
    done = [table[table["status"] == "finished"] for table in keyed]
    both = done[0].merge(done[1], on="at", suffixes=("_first", "_second"))
    if both.empty:
        raise refused(source, "have no finished point in common")
    cases = [case_of(Path(both[f"run_{side}"].iloc[0])) for side in ("first", "second")]
    parameters, differences = _different(cases, names)
    unit, points, lines = tables[0].attrs["units"][column], [], []
    for row in both.to_dict("records"):
        numbers, errors = (
            [row.get(f"{name}_{side}") for side in ("first", "second")] for name in (column, scatter_of(column))
        )
        compared, (_, *cells) = _pair(column, unit, numbers, errors)
        point = {key: of_key[row["point_first"]] for key, (of_key, _) in values.items()}
        points.append({"point": point, **compared})
        lines.append([*map(sweeps.value_text, point.values()), *cells[:-1]])
    usual, size = unit_shown(unit)
    largest = max((point["difference"] or 0.0 for point in points), key=abs)
    line = f"{len(both)} points in both; largest difference {_signed(largest * size, usual)} {usual}".rstrip()
    unmatched = [len(table) - len(both) for table in tables]
    if any(unmatched):
        line += f"; left out: {unmatched[0]} of {names[0]}, {unmatched[1]} of {names[1]}"
    head = [
        *heads[0],
        *(f"{name}: {sweeps.with_unit(column, usual)}" for name in names),
        "difference",
        "scatter of copies",
    ]
    contents = {"first": names[0], "second": names[1], "keys": units[0], "parameters": parameters}
    text = "\n\n".join(filter(None, [differences, aligned([head, *lines]), line]))
    return Comparison({**contents, "points": points, "unmatched": unmatched}, text)
