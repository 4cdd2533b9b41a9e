"""The article (article.md) as one HTML file with its pictures in it, and as PDF.

``python -m studies.article OUT`` writes both. The numbers and pictures of article.md itself are
made by `docs.illustrations`.
"""

from __future__ import annotations

import base64
import re
import shutil
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from walkers.commands.options import print_lines
from walkers.errors import input_error
from walkers.files import write_bytes
from walkers.main import main, new_app

TEXT = Path(__file__).with_name("article.md")
"""The article."""

DOCS = TEXT.parents[1] / "docs"
"""The folder with the settings of sphinx."""

TITLE = "Walkers and climbing piles of wet beads"
"""Title of the HTML page."""

_STYLE = """
body { max-width: 46em; margin: 2em auto; padding: 0 1em; font: 11pt/1.45 serif; }
img { max-width: 100%; }
img[alt="Threshold"], img[alt="A walker"] { max-width: 55%; }
table { border-collapse: collapse; font-size: 8.5pt; }
td, th { padding: 1pt 5pt; text-align: left; vertical-align: top; }
td p, th p { margin: 0; }
tr { border-bottom: 0.5pt solid #ccc; break-inside: avoid; }
thead tr { border-bottom: 1pt solid #000; }
a { color: inherit; text-decoration: none; }
.headerlink { display: none; }
@page { size: A4; margin: 18mm; }
"""
_PAGE = (
    '<!doctype html><html lang="en"><meta charset="utf-8">'
    "<title>{title}</title><style>{style}</style>{body}</html>"
)
app = new_app("python -m studies.article")


@app.default
def article(to: Annotated[Path, Parameter(name="OUT")], /) -> None:
    """Write the whole comparison with the paper into the folder OUT: article.html and article.pdf.

    Parameters
    ----------
    to
        The folder.
    """
    if find_spec("sphinx") is None or shutil.which("chromium") is None:
        raise input_error("the article", "needs sphinx and chromium: make paper installs them")
    if to.exists() and not to.is_dir():
        raise input_error(to, "expected a folder, this is a file")
    html = to / "article.html"
    pdf = to / "article.pdf"
    page = _page()
    to.mkdir(parents=True, exist_ok=True)
    write_bytes(html, page.encode())
    write_bytes(pdf, _printed(html))
    print_lines([html, pdf])


def _page() -> str:
    """The article as one HTML page with its pictures in it.

    Sphinx makes it with the settings of docs/; only the text of the article is taken.
    """
    settings = {
        "root_doc": TEXT.stem,
        "include_patterns": TEXT.name,
        "extensions": "myst_parser,mathml",
        "suppress_warnings": "myst.xref_missing",  # links to pages of docs/
    }
    command = [sys.executable, "-m", "sphinx", "-q", "-b", "html", "-c", str(DOCS)]
    for name, value in settings.items():
        command.append(f"-D{name}={value}")
    with tempfile.TemporaryDirectory() as work:
        subprocess.run([*command, str(TEXT.parent), work], check=True)
        page = (Path(work) / "article.html").read_text("utf-8")
        _, _, rest = page.partition('<article class="bd-article">')
        article_text, _, _ = rest.partition("</article>")
        body = re.sub(
            r'(?<=src=")[^"]+\.png',
            lambda source: _inline(Path(work) / source[0]),
            article_text,
        )
    return _PAGE.format(title=TITLE, style=_STYLE, body=body)


def _inline(picture: Path) -> str:
    """A picture as a URL that contains it."""
    return "data:image/png;base64," + base64.b64encode(picture.read_bytes()).decode()


def _printed(html: Path) -> bytes:
    """The content of a PDF of a page, printed by Chromium."""
    with tempfile.TemporaryDirectory() as work:
        pdf = Path(work) / "article.pdf"
        command = [
            "chromium",
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--no-pdf-header-footer",
            f"--print-to-pdf={pdf}",
            html.resolve().as_uri(),
        ]
        subprocess.run(command, check=True, capture_output=True)
        return pdf.read_bytes()


if __name__ == "__main__":
    main(app=app)
