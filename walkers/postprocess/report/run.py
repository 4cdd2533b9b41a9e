"""The report of a run: its parameters and where they come from, its numbers, its plots, and the beads to be played."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from walkers.inputs.case import Case
from walkers.inputs.changes import dotted
from walkers.inputs.origins import Origin, text_of
from walkers.postprocess.analysis import analyses_in, current_result, quantities_of, warnings_of
from walkers.postprocess.motion import read_motion
from walkers.postprocess.report.page import NAME, check_report, fill, packed_plots, packed_scene, write_page
from walkers.postprocess.report.plots import plots_of
from walkers.postprocess.report.scene import MOST_PLACES, Scene, scene_of
from walkers.runner.directory import case_of
from walkers.runner.files import read_json
from walkers.runner.manifest import MANIFEST_NAME


@dataclass(frozen=True)
class Parameter:
    """A row of the table of parameters, as text."""

    key: str
    text: str
    origin: str = ""
    source: str = ""
    range: str = ""
    guessed: bool = False


@dataclass(frozen=True)
class RunReport:
    """What the report of a run shows, for its template.

    Attributes
    ----------
    directory
        The run directory.
    id
        Of its section in the page.
    places
        Beads times instants of its scene at most.
    origins
        Where the values of the case come from; None: as the run recorded it.
    """

    directory: Path
    id: str = "run"
    places: int = MOST_PLACES
    origins: tuple[Origin, ...] | None = None

    @cached_property
    def result(self) -> dict[str, Any]:
        """What the run gave."""
        return current_result(self.directory)

    @cached_property
    def case(self) -> Case:
        """The resolved case."""
        return case_of(self.directory)

    @property
    def name(self) -> str:
        """Of the run directory."""
        return self.directory.resolve().name

    @property
    def title(self) -> str:
        """What the case calls itself."""
        return self.case.title or self.case.name

    @cached_property
    def shown(self) -> dict[str, Any]:
        """What is told of a result and its case wherever they are shown."""
        return shown_of(self.directory, self.result, self.origins)

    @cached_property
    def manifest(self) -> dict[str, Any]:
        """What the run directory says of the run."""
        return read_json(self.directory / MANIFEST_NAME)

    @cached_property
    def scene(self) -> Scene:
        """The beads in three dimensions."""
        return scene_of(read_motion(self.directory), places=self.places)

    @property
    def cameras(self) -> dict[str, str]:
        """Buttons that put the camera somewhere: its places as JSON."""
        return {name: json.dumps(camera) for name, camera in self.scene.cameras.items()}

    @cached_property
    def carried(self) -> dict[str, str]:
        """What the page's scripts unpack."""
        plots = plots_of(self.directory)
        packed = {f"scene-{self.id}": packed_scene(self.scene)}
        return packed if plots is None else {**packed, f"plots-{self.id}": packed_plots(plots)}


def report_run(directory: Path, to: Path | None = None, origins: tuple[Origin, ...] | None = None) -> Path:
    """Write the report of a run: one HTML file to mail, which needs no network.

    Parameters
    ----------
    directory
        A run directory.
    to
        The file; ``report.html`` in the run directory if None.
    origins
        Where the values of the case come from; None: as the run recorded it.

    Returns
    -------
    Path
        The file, less than 5 MB.

    Raises
    ------
    InputError
        If the name is none of an HTML file, or there is no folder for it.
    postprocess.dump.DumpError
        If the dumps cannot be read.
    """
    path = to or directory / NAME
    check_report(path)
    run = RunReport(directory, origins=origins)
    return write_page(path, run.title, fill("run.html.j2", run=run), run.carried)


def summary_of(case: Case) -> str:
    """What is run, in a sentence."""
    bodies = []
    for make in case.walkers:
        radii = " / ".join(f"{radius * 1e3:g}" for radius in make.radii)
        bodies.append(f"{make.replicates} walkers of R = {radii} mm")
    if case.loose:
        bodies.append(f"{case.count - sum(make.count for make in case.walkers)} loose beads")
    boundary = f"in a {case.boundary.shape}" if case.boundary.closed else f"on a {case.boundary.shape}"
    liquid = f", {case.liquid.name}" if case.liquid.name else ""
    return f"{', '.join(bodies)} {boundary} of {case.boundary.material}{liquid}; {case.drive.described()}."


def shown_of(directory: Path, result: dict[str, Any], origins: tuple[Origin, ...] | None = None) -> dict[str, Any]:
    """Of a result the warnings and quantities; of its case a summary, the parameters, and those that are guessed.

    Of runs that did not keep where their values come from, the parameters are in SI units.
    """
    case = case_of(directory)
    known = [_parameter(one) for one in (case.origins if origins is None else origins)]
    return {
        "summary": summary_of(case),
        "warnings": warnings_of(result),
        "quantities": quantities_of(result),
        "guessed": [parameter for parameter in known if parameter.guessed],
        "parameters": known or [Parameter(key, text_of(value)) for key, value in flat(case.as_dict())],
    }


def _parameter(one: Origin) -> Parameter:
    ends = " … ".join(text_of(end) for end in one.range) if one.range else ""
    return Parameter(one.key, one.text, one.origin, one.source, ends, one.guessed)


def flat(values: Any) -> Iterator[tuple[str, Any]]:
    """Values of nested tables by dotted keys, of those that say something."""
    return ((key, value) for key, value in dotted(values) if value not in (None, "", [], ()))


def result_html(directory: Path, result: dict[str, Any], origins: tuple[Origin, ...] | None = None) -> str:
    """A result as a piece of HTML: a table with errors and units, warnings, and the parameters folded in."""
    headline = [line for one in analyses_in(result) for line in one.lines(result)][:1] or [result["case"]]
    shown = shown_of(directory, result, origins)
    return fill("result.html.j2", headline=headline[0], shown=shown, run=directory.name)
