"""Reports to mail, of whatever a directory holds: a run or a sweep."""

from __future__ import annotations

from pathlib import Path

from walkers.pipeline import DEFAULT_OUT, find_run, locate


def report(what: str | Path, to: Path | None = None, out: Path = DEFAULT_OUT) -> Path:
    """Write the report of a run or a sweep: one HTML file that needs no network.

    Parameters
    ----------
    what
        The directory of one of them, or its name in ``out``; or a case, whose run is looked up there.
    to
        The file; ``report.html`` in that directory if None.
    out
        Folder of the run directories.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If there is no such thing, or the name is none of an HTML file.

    Examples
    --------
    >>> walkers.report(walkers.run("fig1b", tmp).directory, tmp / "fig1b.html").name
    'fig1b.html'
    """
    from walkers.postprocess.report.page import check_report
    from walkers.sweeps.report import report_sweep

    if to is not None:
        check_report(to)
    place = locate(what, out)
    if place.kind == "sweep":
        return report_sweep(place.path, to)
    return find_run(what, out).report(to)
