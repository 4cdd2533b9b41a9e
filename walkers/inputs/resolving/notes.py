"""Notes about the values of a case that its file does not give, taken while they are resolved."""

from __future__ import annotations

from collections.abc import Mapping

from walkers.inputs.origins import Source, SourceKind


class Notes:
    """Sources of the values that a file does not give.

    Attributes
    ----------
    sources : dict of str to Source
        The sources by their keys.
    """

    def __init__(self, sources: Mapping[str, Source]) -> None:
        self.sources = dict(sources)

    def add(self, name: str, why: str, origin: SourceKind = "derived", text: str = "") -> None:
        """Note where the value of a key is from.

        Parameters
        ----------
        name
            Dotted key.
        why
            The source in words.
        origin
            Kind of the source.
        text
            The value in words; empty if it is a number.
        """
        self.sources[name] = Source(origin, why, text)
