"""Warnings about what a figure of a sweep leaves out."""

from __future__ import annotations

from walkers.warning import warn_user


class LeftOutWarning(UserWarning):
    """Something is not in a figure.

    It may be a point without a result, a key that is not distinguished, or a theory's prediction.
    """


def warn_left_out(message: str) -> None:
    """Warn that something is not in a figure."""
    warn_user(message, LeftOutWarning)
