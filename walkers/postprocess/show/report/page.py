"""Self-contained HTML pages with figures and players: they need no network and no other file.

Their tables need no JavaScript. What a page shows is decided in
`walkers.postprocess.show.report.run` and `walkers.sweeps.report`.
"""

from __future__ import annotations

import base64
import hashlib
import re
import zlib
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walkers.files import make_folder
from walkers.postprocess.show.drawing import check_place, styled
from walkers.runner.provenance import PROJECT, software
from walkers.text import environment

if TYPE_CHECKING:
    from matplotlib.figure import Figure

REPORT_NAME = "report.html"
"""Name of the report of a run."""
LARGEST_REPORT = 5_000_000
"""Largest size of a report in bytes, small enough for mail."""
_PACKAGE = "walkers.postprocess.show.report"
"""Package with the templates, styles and scripts of pages."""


def check_report(path: Path) -> None:
    """Raise `InputError` unless a path is an .html file; make its folder if it does not exist."""
    check_place(path, ".html", ".htm")
    make_folder(path.absolute().parent)


def page_of(title: str, body: str, players: Mapping[str, str] | None = None) -> str:
    """Make a page.

    Parameters
    ----------
    title
        Its title, plain text.
    body
        Its body, HTML.
    players
        Data of players, packed as text, by their ids; a page without players has no scripts.

    Returns
    -------
    str
        The HTML of the page.
    """
    scripts: list[str] = []
    packed: dict[str, str] = {}
    if players:
        scripts = [_text("k3d", "static/fflate.js"), _text(_PACKAGE, "player.js")]
        packed = {"library-k3d": _packed_k3d(), **players}
    values = {
        "title": title,
        "body": body,
        "style": _text(_PACKAGE, "report.css"),
        "packed": packed,
        "scripts": scripts,
        "hashes": [_hash(script) for script in scripts],
        "written_by": f"{PROJECT} {software()['granular_walkers']}",
    }
    return render_html("page.html.j2", values)


def render_html(template: str, values: Mapping[str, Any], package: str = _PACKAGE) -> str:
    """Render a template as HTML.

    Parameters
    ----------
    template
        Name of the template. It may use templates of this package, too.
    values
        Values of the template by name; they are escaped.
    package
        The package with the template.
    """
    return environment(package, _PACKAGE, html=True).get_template(template).render(values)


@styled
def svg_of(figure: Figure) -> str:
    """A figure as SVG for a page: without metadata, and only what is referred to has an id."""
    metadata: dict[str, str | None] = dict.fromkeys(("Creator", "Date", "Format", "Type"))
    text = StringIO()
    figure.savefig(text, format="svg", metadata=metadata)
    _, _, drawing = text.getvalue().partition("<svg")
    return "<svg" + re.sub(r' id="[A-Za-z0-9.]+_[0-9]+"', "", drawing)


def _hash(script: str) -> str:
    """The hash of a script by which the page allows it."""
    return base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()


@cache
def _packed_k3d() -> str:
    """The library of players, packed as text.

    It contains its font as woff2; of other formats browsers would look for files beside the page.
    """
    other_formats = r',url\(fonts/[^)]*\) format\("(?:woff|truetype)"\)'
    source = re.sub(other_formats, "", _text("k3d", "static/standalone.js"))
    return base64.b64encode(zlib.compress(source.encode(), 9)).decode()


@cache
def _text(package: str, name: str) -> str:
    """A file of a package as text."""
    return files(package).joinpath(name).read_text("utf-8")
