"""What all figures share: the style file, and how they are written, with what they were made from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from walkers.inputs.errors import InputError, Problem
from walkers.runner.files import beside

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_STYLE = Path(__file__).parent / "style.mplstyle"
_Given = ParamSpec("_Given")
_Drawn = TypeVar("_Drawn")


def styled(draw: Callable[_Given, _Drawn]) -> Callable[_Given, _Drawn]:
    """Let a function draw in the project's style; the settings of whoever calls it are put back."""

    @wraps(draw)
    def drawn(*given: _Given.args, **options: _Given.kwargs) -> _Drawn:
        import matplotlib.style

        with matplotlib.style.context(_STYLE):
            return draw(*given, **options)

    return drawn


def plain_text(text: str) -> str:
    """A text of the user's as matplotlib shows it literally: a dollar begins no formula."""
    return text.replace("$", r"\$")


def new_figure(width: float, height: float, *, mosaic: Any = None, **options: Any) -> tuple[Figure, Any]:
    """A figure without pyplot's global state, for functions that are `styled`.

    Parameters
    ----------
    width, height
        Inches.
    mosaic
        Of `matplotlib.figure.Figure.subplot_mosaic`; left out, ``subplots`` makes the axes.
    options
        Of either.

    Returns
    -------
    figure, axes
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.subplots(**options) if mosaic is None else figure.subplot_mosaic(mosaic, **options)


def check_picture(path: Path, suffix: str) -> None:
    """Refuse a place for a picture or a film that would be written as something else.

    Raises
    ------
    InputError
        If it has another suffix or is a folder.
    """
    if path.suffix.lower() != suffix or path.is_dir():
        raise InputError("--to", [Problem("", None, f"{path}: expected the name of a {suffix} file")])


def save_figure(
    figure: Figure, path: Path, sources: Sequence[str], formats: Sequence[str] = ("png",), title: str = ""
) -> list[Path]:
    """Write a figure, in one or several formats, beside its place and rename it.

    Parameters
    ----------
    figure
        To write.
    path
        Where; the suffix is replaced by each format's.
    sources
        Names of the run directories that it shows, written into the file: they end in the hash of case and engine.
    formats
        ``png``, ``svg``, ``pdf``.
    title
        Written into the file.

    Returns
    -------
    list of Path
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    names = {"Title": title or path.stem, "Source": " ".join(dict.fromkeys(sources))}
    extra: dict[str, dict[str, str | None]] = {
        "png": {"Software": "granular-walkers"},
        "svg": {"Creator": "granular-walkers", "Date": None},
        "pdf": {"Creator": "granular-walkers", "CreationDate": None, "Source": None},  # it knows no source
    }
    written = []
    for form in formats:
        place = path.with_suffix(f".{form}")
        with beside(place) as new:
            styled(figure.savefig)(new, format=form, metadata={**names, **extra[form]})
        written.append(place)
    return written
