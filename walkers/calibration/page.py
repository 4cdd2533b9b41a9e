"""The report of a calibration as one HTML file: observations beside predictions, the posterior, figures, settings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.calibration.report import RECORD_NAME, as_dict, rows_of
from walkers.inputs.errors import InputError, Problem
from walkers.inputs.origins import text_of
from walkers.postprocess.analysis import Number
from walkers.postprocess.report.page import NAME, check_report, fill, picture_uri, write_page
from walkers.postprocess.report.run import flat
from walkers.runner.files import read_json

if TYPE_CHECKING:
    from walkers.calibration.calibrate import Outcome

_FIGURES = {
    "predictions": "Published values and the engine's",
    "corner": "Posterior of the parameters; lines: the set with which the engine gives most observations",
    "sobol": "What each observation depends on: total Sobol indices",
    "bands": "The engine over samples of the posterior",
}
_SHOWN_ELSEWHERE = frozenset({"title", "parameters", "observations"})


def report_calibration(directory: Path, to: Path | None = None) -> Path:
    """Write the report of a calibration: one HTML file to mail, which needs no network.

    Parameters
    ----------
    directory
        Where ``walkers calibrate`` wrote its tables and figures, such as ``runs/ruby``.
    to
        The file; ``report.html`` in that directory if None.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If it is no such directory, or the name is none of an HTML file.
    """
    path = to or directory / NAME
    check_report(path)
    try:
        record = read_json(directory / RECORD_NAME)
        body = fill("calibration.html.j2", "walkers.calibration", **_shown(record, directory))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        told = f"no calibration that can be shown ({error}); make it again: walkers calibrate"
        raise InputError(str(directory), [Problem("", None, told)]) from error
    return write_page(path, record["title"] or record["calibration"], body, {})


def outcome_html(found: Outcome) -> str:
    """The tables of a calibration as a piece of HTML, without figures."""
    return fill("calibration.html.j2", "walkers.calibration", **_shown(as_dict(found, rows_of(found)), None))


def _shown(record: dict[str, Any], directory: Path | None) -> dict[str, Any]:
    """What the template shows; figures of a directory, if there is one."""
    settings = record["settings"]
    figures = {told: directory / f"{name}.png" for name, told in _FIGURES.items()} if directory else {}
    return {
        "title": record["title"] or record["calibration"],
        "record": record,
        "observations": [_observation(record, place) for place in range(len(record["observations"]))],
        "parameters": [
            {
                "label": label,
                "keys": ", ".join(settings["parameters"][name]["keys"]),
                "range": " … ".join(text_of(end) for end in settings["parameters"][name]["range"]),
                "numbers": [
                    Number(f"best.{name}", record["best"][name]),
                    *(
                        Number(f"intervals.{name}.{place}", value)
                        for place, value in enumerate(record["intervals"][name])
                    ),
                ],
                "words": record["words"][name],
            }
            for name, label in record["parameters"].items()
        ],
        "posteriors": {"of all observations": record["posterior"], **record["held_out_posteriors"]},
        "settings": [
            (key, text_of(value)) for key, value in flat(settings) if key.partition(".")[0] not in _SHOWN_ELSEWHERE
        ],
        "figures": {told: picture_uri(file) for told, file in figures.items() if file.is_file()},
    }


def _observation(record: dict[str, Any], place: int) -> dict[str, Any]:
    """An observation with its numbers, each to the digits that its error allows."""
    row = record["observations"][place]
    errors = dict.fromkeys(("value", "deviation", "engine", "low", "high"), row["deviation"])
    numbers = {
        name: None if row[name] is None else Number(f"observations.{place}.{name}", row[name], error=error)
        for name, error in {**errors, "emulator": row["error"], "error": row["error"]}.items()
    }
    return {**row, **numbers}
