"""How far a sweep is, as text."""

from __future__ import annotations

from pathlib import Path

from walkers.inputs.errors import InputError, Problem
from walkers.sweeps.record import RECORD_NAME, read_record, states

_MOST_FAILURES = 10
_ORDER = ("finished", "running", "failed", "missing", "not needed")


def sweeps_in(directory: Path) -> list[Path]:
    """The sweep's directory itself, or those in a folder.

    Raises
    ------
    InputError
        If there is none.
    """
    if (directory / RECORD_NAME).exists():
        return [directory]
    found = sorted(path.parent for path in directory.glob(f"*/{RECORD_NAME}"))
    if not found:
        told = f"neither a sweep's directory (with a {RECORD_NAME}) nor a folder of such"
        raise InputError(str(directory), [Problem("", None, told)])
    return found


def describe_status(directory: Path) -> str:
    """Numbers of points by what has become of them, failures with their reasons, and the thresholds of descents.

    Raises
    ------
    InputError
        If it is no sweep's directory.
    """
    record = read_record(directory)
    found = states(record)
    count = {status: sum(state.status == status for state in found) for status in _ORDER}
    told = ", ".join(f"{number} {status}" for status, number in count.items() if number)
    lines = [f"{record.name}: {len(found)} points, {told or 'none'}"]
    failed = [(number, state) for number, state in enumerate(found) if state.status == "failed"]
    lines += [f"  failed     point {number}: {state.message}" for number, state in failed[:_MOST_FAILURES]]
    if len(failed) > _MOST_FAILURES:
        lines.append(f"             and {len(failed) - _MOST_FAILURES} more")
    if record.descent is not None:
        from walkers.sweeps.table import short_text, thresholds

        lines += [f"  {line}" for line in short_text(thresholds(directory)).splitlines()]
    lines.append(f"  table      walkers table {directory}")
    return "\n".join(lines)
