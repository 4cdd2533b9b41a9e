"""A folder's runs and sweeps as text and as JSON: what each varies, what it gave, how old and how large it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite, nan
from typing import Any, Literal

from walkers.inputs.readable import differing, readable
from walkers.sweeps.inventory import Entry

Order = Literal["name", "status", "velocity", "age", "size"]


def ordered(entries: Sequence[Entry], order: Order, *, reverse: bool = False) -> list[Entry]:
    """Entries in an order: the fastest, the youngest and the largest first; what has no velocity last."""
    keys = {
        "name": lambda entry: entry.name,
        "status": lambda entry: entry.status,
        "velocity": lambda entry: float("inf") if entry.velocity is None else -entry.velocity,
        "age": lambda entry: entry.age,
        "size": lambda entry: -entry.size,
    }
    return sorted(entries, key=keys[order], reverse=reverse)


def varied(runs: Sequence[Entry]) -> dict[str, list[str]]:
    """For each case the keys by which its runs differ, see `walkers.inputs.readable.differing`."""
    cases = dict.fromkeys(run.case for run in runs)
    return {case: differing([run.parameters for run in runs if run.case == case and run.parameters]) for case in cases}


def as_json(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    """Entries as JSON objects, SI units; ``varies`` has, of a run, the values by which runs of its case differ."""
    keys = varied([entry for entry in entries if not entry.is_sweep])
    common = ("name", "case", "status", "age", "size")
    of_runs = ("reason", "message", "velocity", "standard_error", "climbs")
    rows = []
    for entry in entries:
        told: dict[str, Any] = {name: getattr(entry, name) for name in common}
        if entry.is_sweep:
            told |= {"varies": dict(entry.parameters), "points": dict(entry.points or {}), "runs": list(entry.runs)}
        else:
            told |= {"varies": {key: entry.parameters.get(key) for key in keys[entry.case]}}
            told |= {name: getattr(entry, name) for name in of_runs}
        rows.append({"kind": "sweep" if entry.is_sweep else "run", "directory": str(entry.directory), **told})
    return rows


def as_text(entries: Sequence[Entry]) -> str:
    """Entries as text: sweeps, then the runs of each case with a column for each key by which they differ; mm/s."""
    sweeps = [entry for entry in entries if entry.is_sweep]
    runs = [entry for entry in entries if not entry.is_sweep]
    head = ["sweep", "points", "age", "size", "case", "varies (values)"]
    blocks = [aligned([head, *map(_sweep_cells, sweeps)])] if sweeps else []
    for case, keys in varied(runs).items():
        of_case = [run for run in runs if run.case == case]
        head = [f"{case} ({len(of_case)})", "status", "result", "age", "size", *short_names(keys)]
        blocks.append(aligned([head, *(_run_cells(run, keys) for run in of_case)]))
    counts = [(len(sweeps), "sweep"), (len(runs), "run")]
    total = ", ".join(
        f"{number} {kind}{'' if number == 1 else 's'}" for number, kind in counts if number or kind == "run"
    )
    return "\n\n".join([*blocks, f"{total}, {bytes_text(sum(run.size for run in runs))}"])


def _sweep_cells(sweep: Entry) -> list[str]:
    points = ", ".join(f"{number} {status}" for status, number in (sweep.points or {}).items())
    keys = ", ".join(f"{key} ({number})" for key, number in sweep.parameters.items())
    return [sweep.name, points, age_text(sweep.age), bytes_text(sweep.size), sweep.case, keys]


def _run_cells(run: Entry, keys: Sequence[str]) -> list[str]:
    status = f"{run.status}: {run.reason}" if run.reason else run.status
    values = [readable(key, run.parameters.get(key)) for key in keys]
    return [run.name, status, outcome_text(run), age_text(run.age), bytes_text(run.size), *values]


def short_names(keys: Sequence[str]) -> list[str]:
    """The shortest endings of dotted keys that tell them apart."""
    names = []
    for key in keys:
        parts = key.split(".")
        last = 2 if parts[-1] == "name" else 1
        endings = [".".join(parts[start:]) for start in reversed(range(len(parts) + 1 - last))]
        others = [other for other in keys if other != key]
        names.append(next(end for end in endings if not any(f".{other}".endswith(f".{end}") for other in others)))
    return names


def outcome_text(run: Entry) -> str:
    """What a run gave, in a few words."""
    if run.velocity is not None:
        error = nan if run.standard_error is None else run.standard_error
        return f"{with_error(run.velocity * 1e3, error * 1e3)} mm/s"
    return "-" if run.climbs is None else f"{run.climbs} climb{'' if run.climbs == 1 else 's'}"


def with_error(value: float, error: float) -> str:
    """A number with its standard error, if that is known; a dash for none."""
    if not isfinite(value):
        return "-"
    return f"{value:.4g} ± {error:.1g}" if isfinite(error) else f"{value:.4g}"


def aligned(rows: Sequence[Sequence[str]]) -> str:
    """Rows of cells as a text whose columns are aligned."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    )


_AGES: Mapping[str, float] = {"d": 86400.0, "h": 3600.0, "min": 60.0}
_SIZES: Mapping[str, float] = {"GB": 1e9, "MB": 1e6, "kB": 1e3}


def age_text(seconds: float) -> str:
    """An age in the largest unit of which it is at least two, such as ``3 d``."""
    return next(
        (f"{seconds / size:.0f} {unit}" for unit, size in _AGES.items() if seconds >= 2 * size), f"{seconds:.0f} s"
    )


def bytes_text(size: int) -> str:
    """A number of bytes, such as ``1.2 MB``."""
    return next((f"{size / unit:.3g} {name}" for name, unit in _SIZES.items() if size >= unit), f"{size} B")
