"""What all figures share: style, widths, letters of panels, legends, and files with metadata.

What a figure shows is decided elsewhere: of runs in `walkers.postprocess.show.figures`, of sweeps
in `walkers.sweeps.figure`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import wraps
from pathlib import Path
from string import ascii_lowercase
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import numpy as np

from walkers.errors import input_error
from walkers.files import replacing
from walkers.text import printable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend

ONE_COLUMN = 3.4
"""Width of a figure in one column of a journal, inches."""
TWO_COLUMNS = 7.0
"""Width of a figure in two columns of a journal, inches."""
FORMATS = ("png", "svg", "pdf")
"""Formats of figures."""
STYLE = Path(__file__).parent / "style.mplstyle"
"""Style of all figures, for matplotlib."""
_SOFTWARE = "granular-walkers"
"""Name of the program in the metadata of figures."""
_LEAST_ERROR = 0.02
"""Half of the height of a symbol over the height of its axes, approximately."""
_ORDERED_COLOURS = "viridis"
"""Colour map of ordered values, whose lightness rises from the smallest to the largest."""
_LIGHTEST = 0.78
"""Largest place in this colour map, of 1: yellow is hardly seen on white."""
_BELOW_AXES = 30.0
"""Distance of a legend below its axes, points: space for tick labels and the label of x."""
_POINTS_PER_INCH = 72.0
_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")


def styled(draw: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Decorator: draw in the style of the project and restore the settings of the caller."""

    @wraps(draw)
    def draw_in_style(*args: _Arguments.args, **kwargs: _Arguments.kwargs) -> _Result:
        import matplotlib.style

        with matplotlib.style.context(STYLE):
            return draw(*args, **kwargs)

    return draw_in_style


def ordered_colours(number: int) -> list[str]:
    """Colours that become lighter, for ordered values; a single one is the first of the style."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    if number == 1:
        return [to_hex("C0")]
    colours = colormaps[_ORDERED_COLOURS](np.linspace(0.0, _LIGHTEST, number))
    return [to_hex(colour) for colour in colours]


def plain_text(text: str) -> str:
    """A text of the user for matplotlib: without formulas and control characters."""
    lines = [printable(line) for line in text.split("\n")]
    return "\n".join(lines).replace("$", r"\$")


def new_figure(width: float, height: float) -> Figure:
    """A figure without axes (width and height in inches), for `styled` functions.

    It does not touch the global state of pyplot, and its layout is constrained.
    """
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def letter_panels(panels: Iterable[Axes]) -> None:
    """Put (a), (b), … before the titles of panels, and align the titles to the left."""
    for panel, letter in zip(panels, ascii_lowercase, strict=False):
        title = panel.get_title()
        size = panel.title.get_fontsize()
        panel.set_title("")
        panel.set_title(f"({letter}) {title}".rstrip(), loc="left", fontsize=size)


def errors_seen(errors: Any, values: Any) -> bool:
    """Whether error bars are longer than symbols are high, if the values fill the axes.

    Parameters
    ----------
    errors, values : array_like
        Half lengths of the error bars, and the values that the axes show, in the same unit. What is
        not finite is ignored.
    """
    finite_errors = np.asarray(errors)[np.isfinite(errors)]
    finite_values = np.asarray(values)[np.isfinite(values)]
    if not len(finite_errors):
        return False
    return bool(finite_errors.max() > _LEAST_ERROR * np.ptp(finite_values))


def legend_below(axes: Axes, *, ncols: int = 1, title: str | None = None) -> Legend:
    """Add a legend below axes of a figure with constrained layout, clear of the labels of x.

    Parameters
    ----------
    axes
        The axes, whose labelled lines the legend names.
    ncols
        Number of columns of the legend.
    title
        Title of the legend.

    Returns
    -------
    Legend
        The legend.
    """
    from matplotlib.transforms import ScaledTranslation

    down = ScaledTranslation(0.0, -_BELOW_AXES / _POINTS_PER_INCH, axes.figure.dpi_scale_trans)
    return axes.legend(
        loc="upper center",
        bbox_to_anchor=(0.5, 0.0),
        bbox_transform=axes.transAxes + down,
        borderaxespad=0.0,
        ncols=ncols,
        title=title,
    )


def check_formats(formats: str | Sequence[str]) -> list[str]:
    """Formats as a list without repetitions; commas may join several in one text.

    Raises `InputError` for a format that is not in `FORMATS`.
    """
    texts = [formats] if isinstance(formats, str) else formats
    expected = f"expected one of {', '.join(FORMATS)}"
    if not isinstance(texts, Sequence):
        raise input_error("formats", f"{texts!r}: {expected}, or several in a list")
    names: list[str] = []
    for text in texts:
        names += str(text).split(",")
    for name in names:
        if name not in FORMATS:
            raise input_error("formats", f"{name!r}: {expected}")
    return list(dict.fromkeys(names))


def check_place(path: Path, *suffixes: str) -> None:
    """Raise `InputError` for a path that is a folder or has none of these suffixes."""
    if path.suffix.lower() not in suffixes or path.is_dir():
        raise input_error(path, f"expected the name of a {' or '.join(suffixes)} file")


def save_figure(
    figure: Figure,
    path: Path,
    sources: Sequence[str],
    formats: str | Sequence[str] = ("png",),
    title: str = "",
) -> list[Path]:
    """Write a figure in some formats; each file is written beside its place and renamed.

    Parameters
    ----------
    figure
        The figure; afterwards its layout is fixed.
    path
        The file; each format replaces its suffix. Missing folders are made.
    sources
        Run directories for the metadata. Their names end in the hash of case and engine.
    formats
        Some of `FORMATS`.
    title
        Title for the metadata; by default the name of the file.

    Returns
    -------
    list of Path
        The files, one for each format.

    Raises
    ------
    InputError
        If a format is not in `FORMATS`.
    """
    formats = check_formats(formats)
    path.parent.mkdir(parents=True, exist_ok=True)
    metadata = _metadata(printable(title or path.stem), " ".join(dict.fromkeys(sources)))
    # All formats have one layout: a new one would start from the last and give another result.
    styled(figure.draw_without_rendering)()
    figure.set_layout_engine("none")
    written = []
    for name in formats:
        place = path.with_suffix(f".{name}")
        with replacing(place) as new:
            styled(figure.savefig)(new, format=name, metadata=metadata[name])
        written.append(place)
    return written


def _metadata(title: str, sources: str) -> dict[str, dict[str, str | None]]:
    """Metadata of a figure by format: without dates, so that equal figures are equal files."""
    return {
        "png": {"Title": title, "Source": sources, "Software": _SOFTWARE},
        "svg": {"Title": title, "Source": sources, "Creator": _SOFTWARE, "Date": None},
        "pdf": {  # has no field for the source
            "Title": title,
            "Subject": f"Source: {sources}",
            "Creator": _SOFTWARE,
            "CreationDate": None,
        },
    }
