"""Self-contained HTML page with figures and players: no network, no other file; its tables need no JavaScript."""

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

from walkers.errors import input_error
from walkers.postprocess.show.drawing import check_place, styled
from walkers.runner.provenance import PROJECT, software
from walkers.text import environment

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PACKAGE = "walkers.postprocess.show.report"
REPORT_NAME = "report.html"
LARGEST_REPORT = 5_000_000
"""Largest size of a report in bytes, small enough for mail."""


def check_report(path: Path) -> None:
    """Raise `InputError` unless a path is an .html file in an existing folder."""
    check_place(path, ".html", ".htm")
    if not path.absolute().parent.is_dir():
        raise input_error(path.absolute().parent, "there is no such folder")


def page_of(title: str, body: str, carried: Mapping[str, str] | None = None) -> str:
    """A page from a plain title, a body of HTML, and packed data by id, which players need."""
    scripts = [_text("k3d", "static/fflate.js"), _text(_PACKAGE, "player.js")] if carried else []
    return fill(
        "page.html.j2",
        title=title,
        body=body,
        style=_text(_PACKAGE, "report.css"),
        carried={"library-k3d": _k3d(), **carried} if carried else {},
        scripts=scripts,
        hashes=[
            base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
            for script in scripts
        ],
        written_by=f"{PROJECT} {software()['granular_walkers']}",
    )


def fill(template: str, package: str = _PACKAGE, **values: Any) -> str:
    """The HTML of a template; values are escaped."""
    return environment(package, _PACKAGE, html=True).get_template(template).render(**values)


@styled
def svg_of(figure: Figure) -> str:
    """A figure as SVG for a page: only what is referred to has an id."""
    text = StringIO()
    figure.savefig(
        text, format="svg", metadata=dict.fromkeys(("Creator", "Date", "Format", "Type"))
    )
    drawing = text.getvalue().partition("<svg")[2]
    return "<svg" + re.sub(r' id="[A-Za-z0-9.]+_[0-9]+"', "", drawing)


@cache
def _k3d() -> str:
    """The packed library; it contains its font as woff2, and browsers would look for other formats beside the page."""
    source = re.sub(
        r',url\(fonts/[^)]*\) format\("(?:woff|truetype)"\)',
        "",
        _text("k3d", "static/standalone.js"),
    )
    return base64.b64encode(zlib.compress(source.encode(), 9)).decode()


@cache
def _text(package: str, name: str) -> str:
    return files(package).joinpath(name).read_text("utf-8")
