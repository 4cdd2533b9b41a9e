"""The page docs/article.md as one HTML file, with its pictures in it, and as PDF: ``python docs/article.py OUT``."""

from __future__ import annotations

import base64
import re
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
_OTHERS = "_ext,examples,gallery,explanation,how-to,reference,engine-reports,index.md,tutorial.md,figures/*.md"
_OPTIONS = {
    "root_doc": "article",
    "exclude_patterns": _OTHERS,
    "extensions": "myst_parser,mathml",
    "suppress_warnings": "myst.xref_missing",
}
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
_PAGE = '<!doctype html><html lang="en"><meta charset="utf-8"><title>{}</title><style>{}</style>{}</html>'


def article(to: Path) -> list[Path]:
    """Write ``article.html`` and ``article.pdf`` into a folder."""
    to.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as work:
        options = [f"-D{name}={value}" for name, value in _OPTIONS.items()]
        subprocess.run([sys.executable, "-m", "sphinx", "-q", "-bhtml", *options, str(HERE), work], check=True)
        text = (Path(work) / "article.html").read_text("utf-8")
        _, _, body = text.partition('<article class="bd-article">')
        body, _, _ = body.partition("</article>")
        body = re.sub(r'(?<=src=")[^"]+\.png', lambda match: _inline(Path(work) / match[0]), body)
    html, pdf = to / "article.html", to / "article.pdf"
    html.write_text(_PAGE.format("Walkers and climbing piles of wet beads", _STYLE, body), "utf-8")
    how = ["--headless", "--no-sandbox", "--disable-gpu", "--no-pdf-header-footer"]
    printed = [f"--print-to-pdf={pdf.resolve()}", html.resolve().as_uri()]
    subprocess.run(["chromium", *how, *printed], check=True, capture_output=True)
    return [html, pdf]


def _inline(picture: Path) -> str:
    return "data:image/png;base64," + base64.b64encode(picture.read_bytes()).decode()


if __name__ == "__main__":
    for path in article(Path(sys.argv[1])):
        print(path)
