"""A scraper of sphinx-gallery for pictures that an example leaves as the last value of a block.

A notebook shows them in the same way. Figures of matplotlib have a scraper of their own.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from sphinx_gallery.scrapers import figure_rst

from walkers.api import Pictures
from walkers.postprocess.show.drawing import STYLE

_DOTS_PER_INCH = 100
"""Resolution of figures in the gallery; a screen with small pixels gets twice as many."""
_LAST_VALUE = "___"
"""The name under which sphinx-gallery keeps the last value of a block."""


def use_style(_configuration: dict[str, Any], _example: str) -> None:
    """Draw the figures of an example in the style of the project, whatever the last one has set."""
    import matplotlib as mpl

    mpl.rcdefaults()
    mpl.style.use(STYLE)
    mpl.rcParams["figure.dpi"] = _DOTS_PER_INCH


def scraper(_block: Any, variables: dict[str, Any], configuration: dict[str, Any]) -> str:
    """Show the last value of a block if it is pictures of `walkers` or an image of IPython.

    Parameters
    ----------
    variables
        What sphinx-gallery knows about the example.
    configuration
        The settings of sphinx-gallery.

    Returns
    -------
    str
        The pictures as reStructuredText; their files are copied beside the pages.
    """
    values = variables["example_globals"]
    last = values.get(_LAST_VALUE)
    files = last if isinstance(last, Pictures) else [getattr(last, "filename", None)]
    copies = []
    for file in files:
        if file is None:
            continue
        place = Path(next(variables["image_path_iterator"])).with_suffix(Path(file).suffix)
        copies.append(str(shutil.copy(file, place)))
    if copies:
        values[_LAST_VALUE] = None  # otherwise the value is printed too
    sizes = [{0: copy} for copy in copies]
    return str(figure_rst(copies, configuration["src_dir"], srcsetpaths=sizes))
