"""What notebooks show: pictures beside their paths, progress as a bar. Nothing here needs a notebook to be there."""

from __future__ import annotations

import base64
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from html import escape
from pathlib import Path
from typing import Any


class Pictures(list[Path]):
    """Paths of pictures; a notebook shows the pictures themselves."""

    def _repr_html_(self) -> str:
        """The PNGs, one below the other; of other files the names."""
        return "\n".join(map(_image, self))


def _image(path: Path) -> str:
    if path.suffix.lower() != ".png" or not path.is_file():
        return f"<p>{escape(str(path))}</p>"
    encoded = base64.b64encode(path.read_bytes()).decode()
    return f'<img src="data:image/png;base64,{encoded}" alt="{escape(path.stem)}" style="max-width:100%">'


def in_notebook() -> bool:
    """Whether a Jupyter kernel runs this; IPython is not imported for it."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return shell is not None and hasattr(shell, "kernel")


@contextmanager
def progress_bar(name: str) -> Iterator[Callable[[float, float, str, float], None]]:
    """Yield a function that shows the whole, how much of it is done, and words, as a bar that is replaced in place.

    Rich would show it by a widget, of which a stored notebook keeps an empty box; this leaves a line.
    """
    import IPython.display

    # IPython has types for some of its functions, and not for these.
    shown: Any = IPython.display
    handle = shown.display(shown.HTML(""), display_id=True)
    told = "stopped"

    def show(whole: float, done: float, words: str, elapsed: float) -> None:
        del elapsed
        bar = f'<progress max="{whole:g}" value="{done:g}"></progress>'
        handle.update(shown.HTML(f"{escape(name)} {bar} {escape(words)}"))

    try:
        yield show
        told = "done"
    finally:
        handle.update(shown.HTML(f"{escape(name)}: {told}"))
