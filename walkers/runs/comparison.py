"""Comparison of two runs: parameters and results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from math import hypot, nan
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from walkers.physics.laws import LAWS
from walkers.postprocess.measure.numbers import (
    ASIDE,
    band_of,
    error_text,
    headline,
    is_of_up,
    saying_nothing,
)
from walkers.postprocess.measure.quantities import (
    declared,
    described_columns,
    is_error,
    scatter_of,
    unit_shown,
)
from walkers.postprocess.measure.results import Results, json_numbers, not_computed, read_results
from walkers.rounding import counted, rounded
from walkers.runner.manifest import read_manifest
from walkers.runs.case_text import differing, flattened, readable
from walkers.templates.deck import bridge_tables_digest
from walkers.text import aligned, with_unit

if TYPE_CHECKING:
    from walkers.inputs.tables.case import Case

_VELOCITIES = ("velocity", "right_facing", "left_facing")
"""Numbers whose scatter is in the result."""


class Side(NamedTuple):
    """A side of a comparison: its name, its case, and the directory of its finished run if there is one."""

    name: str
    case: Case
    directory: Path | None


@dataclass(frozen=True)
class Comparison:
    """Differences as JSON in SI units, and as text in readable units."""

    contents: Mapping[str, Any]
    text: str


def compare_runs(first: Side, second: Side) -> Comparison:
    """Compare two runs, or cases not yet run."""
    names, flat = [first.name, second.name], [flattened(side.case) for side in (first, second)]
    parameters = {key: [values.get(key) for values in flat] for key in chain(*differing(flat))}
    sources = {key: [case.origin_words.get(key) for case in flat] for key in parameters}
    changed = [
        [
            key,
            *(readable(key, value) for value in values),
            " / ".join(dict.fromkeys(filter(None, sources[key]))),
        ]
        for key, values in parameters.items()
    ]
    text = [
        aligned([["parameter", *names, "source"], *changed])
        if changed
        else "the cases are the same"
    ]
    not_run, rows = [side.name for side in (first, second) if side.directory is None], []
    if first.directory and second.directory:
        results = [read_results(first.directory), read_results(second.directory)]
        rows = _rows(*results)
        apart = {row["quantity"]: row for row in rows if row["first"] != row["second"]}
        if "cycles" in apart and not changed:
            text = [
                f"{text[0]}, but ran {' and '.join(_cells(apart['cycles'], results)[1:3])} cycles"
            ]
        if apart:
            heads = ["result", *names, "difference", "scatter of copies", "numerical error"]
            columns = zip(heads, *(_cells(row, results) for row in apart.values()), strict=True)
            shown = [column for column in columns if {*column[1:]} != {"-"}]
            text.append(aligned([*zip(*shown, strict=True)]))
            if heads[4] in [column[0] for column in shown]:
                text.append(
                    "scatter of copies: how much copies differ by their start; no error of the difference"
                )
        named = dict(zip(names, results, strict=True))
        doubts = [
            f"{name}: warning: {doubt}"
            for name, result in named.items()
            for doubt in result.warnings
        ]
        text += ["\n".join(lines) for lines in (_of_errors(apart, named), doubts) if lines]
        if same := [row["quantity"] for row in rows if row["quantity"] not in apart]:
            text.append(
                f"the same in both: {', '.join(same)}" if apart else "all results are the same"
            )
    text += _of_tables(first, second)
    text += [f"{name}: no finished run; only the parameters are compared" for name in not_run]
    contents = {
        "first": first.name,
        "second": second.name,
        "parameters": parameters,
        "sources": sources,
    }
    return Comparison(contents | {"not_run": not_run, "results": rows}, "\n\n".join(text))


def _of_tables(*sides: Side) -> list[str]:
    """A line for each finished run whose bridge tables are not those that this program makes of its case."""
    lines = []
    for side in sides:
        if side.directory is None or side.case.liquid.law not in LAWS:
            continue
        try:
            manifest = read_manifest(side.directory)
        except (OSError, ValueError):  # what else reads it says so
            continue
        if manifest.get("by_hand") or manifest.get("bridge_tables") in (
            None,
            bridge_tables_digest(side.case),
        ):
            continue
        lines.append(
            f"{side.name}: its bridge tables are not those of this program: made by another version, "
            "or on another kind of machine"
        )
    return lines


def _of_errors(apart: Mapping[str, Mapping[str, Any]], named: Mapping[str, Results]) -> list[str]:
    """How many times its numerical error a velocity differs, bands of both runs, and which errors are not computed."""
    rows, results = [apart[name] for name in _VELOCITIES if name in apart], named.values()
    lines = [
        f"{row['quantity']}: differs by {error_text(abs(row['difference']) / row['numerical_error'], '')} times "
        "its numerical error"
        for row in rows
        if row["numerical_error"]
    ]
    if any(headline(result) in apart for result in results):
        lines += [f"{name}: {text}" for name, result in named.items() if (text := _of_band(result))]
        if shared := _shared_unknowns(*results):
            values = (
                "1 uncertain value belongs"
                if len(shared) == 1
                else f"{len(shared)} uncertain values belong"
            )
            may = "may be equal in both: the bands may overlap although the difference is certain"
            lines.append(f"{values} to both runs and {may}")
    places = [str(result.directory) for result in results if not_computed(result).numerical_error]
    if rows and places:
        lines.append(f"to measure numerical errors: walkers run {' '.join(places)} --accuracy")
    return lines


def _shared_unknowns(*results: Results) -> set[str]:
    """Keys of the uncertain values on which all of some results rest."""
    return set.intersection(*[_uncertain_keys(result) for result in results])


def _uncertain_keys(result: Results) -> set[str]:
    return {value["key"] for value in result.about["rests_on"] if value["range"]}


def _of_band(result: Results) -> str:
    """The band of the main number of a run, or on how many uncertain values it rests; empty if there are none."""
    if (main := headline(result)) and (band := band_of(result, quantity := declared(main))):
        return f"{with_unit(main, unit_shown(quantity.unit)[0])}, {band}"
    if not not_computed(result).uncertain_values:
        return ""
    uncertain = [value["origin"] for value in result.about["rests_on"] if value["range"]]
    rests = f"rests on {counted(len(uncertain), 'uncertain value')}, {uncertain.count('default')} guessed"
    return f"{main} {rests}; the band over the ranges is not computed (--spread)"


def _rows(first: Results, second: Results) -> list[dict[str, Any]]:
    """The numbers of two results, without errors, values of the case and conditions, and means over both facings.

    A level run and a slope have the velocity in common; up the slope alone, if walkers turned over or lean. Runs of
    which walkers came apart have none.
    """
    heads, results = {headline(first), headline(second)}, {"first": first, "second": second}
    little = {*_VELOCITIES} if "axial_velocity" in heads else {"velocity"} - heads
    if any(
        result.get("facings_differ") and not result.get("goes_uphill")
        for result in results.values()
    ):
        little.add("velocity")
    little.update(ASIDE, ["coverage"], *map(saying_nothing, results.values()))
    names = {name for name in {*first, *second} - little if not is_error(name)}
    rows = []
    for name, (unit, _) in described_columns(names).items():
        numbers = {side: _number(result.get(name)) for side, result in results.items()}
        scatters = {
            f"{side}_scatter": result.get(scatter_of(name)) for side, result in results.items()
        }
        error = hypot(*(result.get(f"{name}_error", nan) for result in results.values()))
        changes = {"difference": numbers["second"] - numbers["first"], "numerical_error": error}
        row = json_numbers({"quantity": name, "unit": unit, **numbers, **scatters, **changes})
        if row["first"] is not None or row["second"] is not None:
            rows.append(row)
    return rows


def _number(value: Any) -> float:
    return nan if value is None or isinstance(value, str) else float(value)


def _cells(row: Mapping[str, Any], results: Sequence[Results]) -> list[str]:
    """A row as text in readable units; a number of walkers that face up says so beside that of all walkers."""
    unit, size = unit_shown(row["unit"])
    first, second, difference = (
        size * _number(row[name]) for name in ("first", "second", "difference")
    )
    printed = [rounded(value, unit) for value in (first, second)]
    if abs(difference) < 2e-3 * abs(
        first
    ):  # digits that are not printed would contradict the printed ones
        difference = float(printed[1]) - float(printed[0])
    signed = rounded(difference, unit)
    signed = signed if signed[:1] == "-" or signed == "0" else f"+{signed}"
    up = [is_of_up(declared(row["quantity"]), result) for result in results]
    if not all(up):
        printed = [
            f"{text}{' facing up' * (facing and text != '-')}"
            for text, facing in zip(printed, up, strict=True)
        ]
    scatters = [row[f"{side}_scatter"] for side in ("first", "second")]
    both = (
        " and ".join(
            error_text(scatter, row["unit"]) for scatter in scatters if scatter is not None
        )
        or "-"
    )
    error = error_text(_number(row["numerical_error"]), row["unit"])
    return [with_unit(row["quantity"], unit), *printed, signed, both, error]
