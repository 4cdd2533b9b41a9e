"""The audit's table, as text, as JSON, and as docs/explanation/engine.md."""

from __future__ import annotations

from math import isfinite
from typing import Any

from walkers.audit.check import Line, Verdict
from walkers.audit.run import AuditReport
from walkers.inputs.text import rendered
from walkers.templates.engine import DEFECTS

GROUPS = {
    1: "Capillary force between beads",
    2: "Capillary force at a wall",
    3: "Contact angle",
    4: "Viscous forces",
    5: "Contacts",
    6: "Drive",
    7: "Independence, repeatability, restart, ranks",
    8: "Time step",
    9: "Energy",
    10: "Published benchmarks (Chung, Ooi 2011)",
    11: "Closed forms",
}


def _number(value: float) -> str:
    return f"{value:.5g}" if isfinite(value) else "-"


def _error(line: Line) -> str:
    return f"{line.relative_error:.1e}" if isfinite(line.relative_error) else "-"


def as_text(report: AuditReport) -> str:
    """A line a measurement, grouped, with a verdict at the end."""
    rows = []
    for group, title in GROUPS.items():
        lines = [line for checked in report.checked if checked.check.group == group for line in checked.lines]
        if not lines:
            continue
        rows.append(f"\n{group}. {title}")
        rows += [
            f"{line.verdict:7} {line.what:80} {_number(line.expected):>11} {_number(line.measured):>11} {line.unit:5} "
            f"error {_error(line):>7}" + (f" of {line.tolerance:.1e}" if line.tolerance is not None else "")
            for line in lines
        ]
    return "\n".join(rows).lstrip("\n") + f"\n\n{verdict(report)}"


def verdict(report: AuditReport) -> str:
    """One sentence on the whole."""
    passed, failed = report.count(Verdict.PASS), report.count(Verdict.FAIL)
    outcome = f"{failed} of {passed + failed} lines fail" if failed else f"all {passed} lines pass"
    if not passed + failed:
        outcome = "no line was judged"
    for other, words in ((Verdict.ERROR, "could not be measured"), (Verdict.SKIPPED, "skipped")):
        outcome += f", {report.count(other)} {words}" if report.count(other) else ""
    present, gone = report.count(Verdict.PRESENT), report.count(Verdict.GONE)
    outcome += f"; known defects: {present} present, {gone} gone" if present + gone else ""
    return f"{report.version}, binary {report.engine.sha256[:12]}: {outcome}"


def as_dict(report: AuditReport) -> dict[str, Any]:
    """Plain JSON types; numbers that are none become null."""

    def plain(value: float | None) -> float | None:
        return value if value is not None and isfinite(value) else None

    return {
        "engine": {"path": str(report.engine.path), "sha256": report.engine.sha256, "version": report.version},
        "passed": not report.failures,
        "checks": [
            {
                "name": checked.check.name,
                "group": checked.check.group,
                "title": checked.check.title,
                "seconds": checked.seconds,
                "lines": [
                    {
                        "what": line.what,
                        "source": line.source,
                        "expected": plain(line.expected),
                        "measured": plain(line.measured),
                        "unit": line.unit,
                        "error": plain(line.relative_error),
                        "tolerance": line.tolerance,
                        "verdict": str(line.verdict),
                    }
                    for line in checked.lines
                ],
            }
            for checked in report.checked
        ],
    }


def as_markdown(report: AuditReport) -> str:
    """docs/explanation/engine.md: the defects, what is done about them, and what the audit measured."""
    groups = {
        f"{group}. {title}": [checked for checked in report.checked if checked.check.group == group]
        for group, title in GROUPS.items()
    }
    measured = {title: checks for title, checks in groups.items() if checks}
    return rendered("walkers.audit", "engine.md.j2", verdict=verdict(report), defects=DEFECTS, groups=measured)
