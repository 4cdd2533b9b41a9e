"""The audit's table, as text and as JSON."""

from __future__ import annotations

from math import isfinite
from typing import Any

from walkers.check.audit import AuditReport
from walkers.check.lines import Verdict


def _number(value: float) -> str:
    return f"{value:.5g}" if isfinite(value) else "-"


def as_text(report: AuditReport) -> str:
    """A line a measurement, grouped, with a verdict at the end."""
    rows = []
    for checked in report.checked:
        rows.append(f"\n{checked.check.name}: {checked.check.title}")
        rows += [
            f"{line.verdict:7} {line.what:90} {_number(line.expected):>9} {_number(line.measured):>9} {line.unit:3} "
            f"error {_number(line.error)} of {line.tolerance:.0e}"
            for line in checked.lines
        ]
    return "\n".join(rows).lstrip("\n") + f"\n\n{verdict(report)}"


def verdict(report: AuditReport) -> str:
    """One sentence on the whole."""
    passed, failed = report.count(Verdict.PASS), report.count(Verdict.FAIL)
    outcome = f"{failed} of {passed + failed} lines fail" if failed else f"all {passed} lines pass"
    for other, words in ((Verdict.ERROR, "could not be measured"), (Verdict.SKIPPED, "skipped")):
        outcome += f", {report.count(other)} {words}" if report.count(other) else ""
    return f"{report.version}, binary and contact model {report.engine.sha256[:12]}: {outcome}"


def as_dict(report: AuditReport) -> dict[str, Any]:
    """Plain JSON types; numbers that are none become null."""

    def plain(value: float) -> float | None:
        return value if isfinite(value) else None

    return {
        "engine": {"path": str(report.engine.path), "sha256": report.engine.sha256, "version": report.version},
        "passed": not report.failures,
        "checks": [
            {
                "name": checked.check.name,
                "title": checked.check.title,
                "seconds": checked.seconds,
                "lines": [
                    {
                        "what": line.what,
                        "expected": plain(line.expected),
                        "measured": plain(line.measured),
                        "unit": line.unit,
                        "error": plain(line.error),
                        "tolerance": line.tolerance,
                        "verdict": str(line.verdict),
                    }
                    for line in checked.lines
                ],
            }
            for checked in report.checked
        ],
    }
