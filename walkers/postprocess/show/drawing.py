"""Common parts of figures: style, widths, letters, legends, and files with metadata."""

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

ONE_COLUMN, TWO_COLUMNS = 3.4, 7.0
"""Widths of figures in one and in two columns of a journal, inches."""
FORMATS = ("png", "svg", "pdf")
"""Formats of figures."""
_STYLE = Path(__file__).parent / "style.mplstyle"
_MAKER = "granular-walkers"
_LEAST_ERROR = 0.02  # about half of the height of a symbol, over the range of values
_Given = ParamSpec("_Given")
_Drawn = TypeVar("_Drawn")


def styled(draw: Callable[_Given, _Drawn]) -> Callable[_Given, _Drawn]:
    """Decorator: draw in the style of the project and restore the settings of the caller."""

    @wraps(draw)
    def drawn(*given: _Given.args, **options: _Given.kwargs) -> _Drawn:
        import matplotlib.style

        with matplotlib.style.context(_STYLE):
            return draw(*given, **options)

    return drawn


def plain_text(text: str) -> str:
    """A text of the user for matplotlib: without formulas and control characters."""
    return "\n".join(map(printable, text.split("\n"))).replace("$", r"\$")


def new_figure(
    width: float, height: float, *, mosaic: Any = None, **options: Any
) -> tuple[Figure, Any]:
    """A figure (size in inches) and its axes without the global state of pyplot, for `styled` functions.

    Options are those of `matplotlib.figure.Figure.subplots`, or with a ``mosaic`` those of ``subplot_mosaic``.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.subplots(**options) if mosaic is None else figure.subplot_mosaic(
        mosaic, **options
    )


def letter_panels(panels: Iterable[Axes]) -> None:
    """Put (a), (b), … before the titles of panels, aligned to the left."""
    for panel, letter in zip(panels, ascii_lowercase, strict=False):
        title, size = panel.get_title(), panel.title.get_fontsize()
        panel.set_title("")
        panel.set_title(f"({letter}) {title}".rstrip(), loc="left", fontsize=size)


def errors_seen(errors: Any, values: Any) -> bool:
    """Whether error bars exceed the symbols, if the values fill the axes."""
    finite, shown = np.asarray(errors)[np.isfinite(errors)], np.asarray(values)[np.isfinite(values)]
    return bool(len(finite) and finite.max() > _LEAST_ERROR * np.ptp(shown))


def legend_below(axes: Axes, **options: Any) -> Legend:
    """A legend below axes of a figure with constrained layout, below tick labels and the label of the abscissa."""
    from matplotlib.transforms import ScaledTranslation

    down = ScaledTranslation(0.0, -30.0 / 72.0, axes.figure.dpi_scale_trans)
    options |= {
        "bbox_to_anchor": (0.5, 0.0),
        "bbox_transform": axes.transAxes + down,
        "borderaxespad": 0.0,
    }
    return axes.legend(loc="upper center", **options)


def check_formats(formats: str | Sequence[str]) -> list[str]:
    """Formats as a list; they may be joined by commas. Raises `InputError` for any that is not in `FORMATS`."""
    given = [
        form
        for text in ([formats] if isinstance(formats, str) else formats)
        for form in text.split(",")
    ]
    for form in given:
        if form not in FORMATS:
            raise input_error("format", f"{form!r}: expected one of {', '.join(FORMATS)}")
    return list(dict.fromkeys(given))


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
    """Write a figure beside its final place and rename it; each of the formats (`FORMATS`) replaces the suffix.

    Its metadata name the ``sources``, run directories, which end in the hash of case and engine, and a title.
    """
    formats = check_formats(formats)
    path.parent.mkdir(parents=True, exist_ok=True)
    name, runs = printable(title or path.stem), " ".join(dict.fromkeys(sources))
    # Without dates equal figures are equal files. PDF has no field for the source.
    metadata: dict[str, dict[str, str | None]] = {
        "png": {"Title": name, "Source": runs, "Software": _MAKER},
        "svg": {"Title": name, "Source": runs, "Creator": _MAKER, "Date": None},
        "pdf": {
            "Title": name,
            "Subject": f"Source: {runs}",
            "Creator": _MAKER,
            "CreationDate": None,
        },
    }
    # One layout for all formats: each further one would begin with the last and give another result.
    styled(figure.draw_without_rendering)()
    figure.set_layout_engine("none")
    written = [path.with_suffix(f".{form}") for form in formats]
    for place in written:
        form = place.suffix[1:]
        with replacing(place) as new:
            styled(figure.savefig)(new, format=form, metadata=metadata[form])
    return written
