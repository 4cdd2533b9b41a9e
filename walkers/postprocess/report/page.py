"""One HTML file that carries all that it shows: libraries, plots and players, packed; no network, no other file.

A page is a list of sections, one of which is shown at a time where there is JavaScript; without it all of their tables
can be read.
"""

from __future__ import annotations

import base64
import json
import re
import zlib
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.inputs.errors import InputError, Problem
from walkers.postprocess.drawing import check_place
from walkers.runner.files import write_text
from walkers.runner.provenance import PROJECT, software

if TYPE_CHECKING:
    from bokeh.models import Model
    from jinja2 import Environment

_PACKAGE = "walkers.postprocess.report"
NAME = "report.html"
LARGEST = 5_000_000
"""Bytes that a report may have: what any mail takes along."""


def check_report(path: Path) -> None:
    """Refuse a place for a report that is none.

    Raises
    ------
    InputError
        If its name does not end in .html, it is a folder, or there is no folder for it.
    """
    check_place(path, ".html", ".htm")
    if not path.absolute().parent.is_dir():
        raise InputError("--to", [Problem("", None, f"{path.absolute().parent}: there is no such folder")])


def write_page(path: Path, title: str, body: str, carried: Mapping[str, str]) -> Path:
    """Write a page beside its place and rename it.

    Parameters
    ----------
    path
        The file.
    title
        As plain text.
    body
        As HTML, of a template.
    carried
        What scripts unpack, by id: packed plots and players.
    """
    libraries = {f"library-{name}": _library(name) for name in ("bokeh", "k3d")} if carried else {}
    page = fill(
        "page.html.j2",
        title=title,
        body=body,
        style=_text(_PACKAGE, "report.css"),
        carried={**libraries, **carried},
        scripts=_scripts() if carried else [],
        written_by=f"{PROJECT} {software().version}",
    )
    write_text(path, page)
    return path


def overhead() -> int:
    """Bytes of a page's libraries and scripts."""
    texts = [_library("bokeh"), _library("k3d"), *_scripts(), _text(_PACKAGE, "report.css")]
    return sum(map(len, texts)) + 2000


def fill(template: str, package: str = _PACKAGE, **values: Any) -> str:
    """The HTML of a template; what is put in is escaped."""
    return _environment(package).get_template(template).render(**values)


def packed_plots(plots: Model) -> str:
    """Bokeh plots as the page carries them."""
    from bokeh.embed import json_item

    return _packed(json.dumps(json_item(plots)))


def picture_uri(path: Path) -> str:
    """A PNG as the source of an image."""
    return f"data:image/png;base64,{base64.b64encode(path.read_bytes()).decode()}"


def _packed(text: str) -> str:
    return base64.b64encode(zlib.compress(text.encode(), 9)).decode()


@cache
def _library(name: str) -> str:
    if name == "k3d":
        # Its letters are in it as woff2; the same in other formats would be looked for beside the page.
        source = _text("k3d", "static/standalone.js")
        return _packed(re.sub(r',url\(fonts/[^)]*\) format\("(?:woff|truetype)"\)', "", source))
    from bokeh.resources import Resources

    return _packed("\n".join(Resources(mode="inline", components=["bokeh"], log_level="error").js_raw))


def _scripts() -> list[str]:
    """What unpacks and plays."""
    return [_text("k3d", "static/fflate.js"), _text(_PACKAGE, "player.js")]


@cache
def _text(package: str, name: str) -> str:
    return files(package).joinpath(name).read_text("utf-8")


@cache
def _environment(package: str) -> Environment:
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

    return Environment(
        loader=ChoiceLoader([PackageLoader(package, "."), PackageLoader(_PACKAGE, ".")]),
        undefined=StrictUndefined,
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        auto_reload=False,
    )
