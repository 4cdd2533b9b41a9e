"""Packages that only some commands need: the extras of ``pyproject.toml``.

They are imported where they are used. A function that needs an extra calls `require` before it
computes or writes anything.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec

from walkers.errors import InputError, Problem

EXTRAS = {
    "archive": ("an archive", ("tomli-w",)),
    "calibrate": ("a calibration", ("scikit-learn", "tomli-w")),
    "check": ("a check of the engine", ("numba",)),
    "cluster": ("a sweep on a cluster", ("parsl",)),
    "film": ("an MP4", ("imageio-ffmpeg",)),
    "report": ("a report or an interactive view", ("k3d",)),
    "theory": ("the theory", ("numba",)),
}
"""For each extra: the feature that needs it, and its packages by their names on PyPI."""


class ExtraMissing(InputError):
    """Packages of an extra are not installed; the message says how to install them.

    Attributes
    ----------
    extra
        Name of the extra.
    missing
        The packages that are not installed, by their names on PyPI.
    """

    def __init__(self, extra: str, missing: list[str]) -> None:
        self.extra = extra
        self.missing = missing
        feature, _ = EXTRAS[extra]
        installing = f"make extras, or pip install 'granular-walkers[{extra}]'"
        problem = Problem("", None, f"needs {', '.join(missing)}: {installing}")
        super().__init__(feature, [problem])

    def __reduce__(self) -> tuple[type[ExtraMissing], tuple[str, list[str]]]:
        """How the error is made again in another process."""
        return ExtraMissing, (self.extra, self.missing)

    def __str__(self) -> str:
        return f"{self.source} {self.problems[0]}"

    def in_command(self, name_of: Callable[[str], str]) -> ExtraMissing:  # noqa: ARG002
        """The error itself: its source is a feature and not an argument."""
        return self


def require(extra: str) -> None:
    """Raise `ExtraMissing` unless the packages of an extra are installed; imports none of them."""
    _, packages = EXTRAS[extra]
    missing = [package for package in packages if find_spec(module_of(package)) is None]
    if missing:
        raise ExtraMissing(extra, missing)


def module_of(package: str) -> str:
    """Name under which a package of `EXTRAS` is imported."""
    if package == "scikit-learn":
        return "sklearn"
    return package.replace("-", "_")
