"""Numbers of two cases over the draws of their spreads (`walkers.runs.draws`) as text."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence

from walkers.postprocess.measure.quantities import unit_shown
from walkers.postprocess.measure.uncertainty import few_draws
from walkers.rounding import percent, rounded
from walkers.runs.draws import Band, ComparedDraws, PairsOfDraws, Unknown
from walkers.terminal import table_width, wrapped
from walkers.text import aligned_blocks, with_unit

HEADS = ("unknowns", "difference", "ratio", "second larger")
"""Heads of the cells of `rows_of`."""


def compared_draws_text(compared: ComparedDraws, first: str, second: str) -> str:
    """The bands of difference and ratio of two cases, and what they assume, as lines of text.

    Parameters
    ----------
    compared
        The compared draws.
    first, second
        Names of both cases.
    """
    unit, _ = unit_shown(compared.unit)
    rows = [[with_unit(compared.quantity, unit), *HEADS[1:]], *rows_of(compared)]
    sentences = [
        f"difference: {second} less {first}; ratio: {second} over {first}; "
        f"median and in brackets 5 to 95 % of {draws_text([compared])}",
        *assumptions([compared]),
        *reasons(compared),
    ]
    lines = [aligned_blocks(rows, table_width()), *wrapped_sentences(sentences)]
    for name, unknowns in ((first, compared.for_first), (second, compared.for_second)):
        if compared.common is None and unknowns:
            lines += _uncertain_table(name, unknowns)
    return "\n".join(lines)


def _uncertain_table(name: str, unknowns: Mapping[str, Unknown]) -> list[str]:
    """Lines for the file of a case: ranges, and in comments the values that belong to them."""
    lines = [f"for {name}:", "  [uncertain]"]
    for key, unknown in unknowns.items():
        ends = json.dumps(unknown.ends, ensure_ascii=False)
        if unknown.logarithmic:
            ends = f"{{ loguniform = {ends} }}"
        lines.append(f"  {key} = {ends} # around {unknown.text}")
    return lines


def rows_of(compared: ComparedDraws) -> list[list[str]]:
    """Cells of the pairs with common unknowns, if there are any, and with independent ones.

    The cells of a row are which unknowns they are, the bands of difference and ratio, and how often
    the second number is larger (`HEADS`).
    """
    rows = []
    if compared.common is not None:
        pairs = compared.common
        larger = round(pairs.second_larger * pairs.pairs)
        rows.append(["common", *_bands(pairs, compared.unit), f"{larger} of {pairs.pairs} pairs"])
    pairs = compared.independent
    share = float(f"{pairs.second_larger:.2g}")
    rows.append(["independent", *_bands(pairs, compared.unit), f"{percent(share)} of pairs"])
    return rows


def _bands(pairs: PairsOfDraws, unit: str) -> list[str]:
    """The bands of difference (in this SI unit) and ratio as text."""
    return [band_text(pairs.difference, unit), band_text(pairs.ratio, "")]


def band_text(band: Band | None, unit: str) -> str:
    """A band (in this SI unit) in its displayed unit: ``4.44 (1.2 to 10.3)``.

    The text does not have the unit; it is a dash if there is no band.
    """
    if band is None:
        return "-"
    displayed_unit, factor = unit_shown(unit)
    texts = []
    for number in (band.median, band.low, band.high):
        texts.append(rounded(float(f"{number * factor:.3g}"), displayed_unit))
    median, low, high = texts
    return f"{median} ({low} to {high})"


def draws_text(several: Sequence[ComparedDraws]) -> str:
    """The numbers of draws of several comparisons, and that bands are approximate if few."""
    numbers: set[int] = set()
    are_few = False
    for compared in several:
        numbers.update(compared.draws)
        unknowns = len(compared.common_unknowns) + len(compared.other_unknowns)
        are_few |= few_draws(min(compared.draws), unknowns)
    text = f"{min(numbers)} draws"
    if len(numbers) > 1:
        text = f"{min(numbers)} to {max(numbers)} draws"
    return f"{text}, approximate" if are_few else text


def assumptions(several: Sequence[ComparedDraws]) -> list[str]:
    """What several comparisons assume about the unknowns, as sentences."""
    common_keys: dict[str, None] = {}
    for compared in several:
        if compared.common is not None:
            common_keys |= dict.fromkeys(compared.common_unknowns)
    sentences = []
    if common_keys:
        sentences.append(
            f"common unknowns: {', '.join(common_keys)} have the same value in both runs "
            "of a pair of draws, as for the same beads on the same substrate"
        )
        sentences.append("independent unknowns: each run has its own values of them")
    else:
        sentences.append("independent unknowns: each run has its own values of all unknowns")
    if any(compared.independent.ratio is None for compared in several):
        sentences.append(
            "no ratio (-): the first number is zero (or its walkers at rest) in a draw, "
            "or changes its sign"
        )
    return sentences


def reasons(compared: ComparedDraws) -> list[str]:
    """Why draws are not paired, and how to pair them, as sentences; none if they are."""
    if compared.common is not None:
        return []
    if not compared.other_unknowns:
        return [
            "no pairs of draws with common unknowns: no two draws have the same values; "
            "give both runs the same number of --points"
        ]
    sentences = [
        "no pairs of draws with common unknowns, because some differ: "
        + "; ".join(compared.other_unknowns)
    ]
    if compared.common_unknowns:
        sentences.append(f"the same in both: {', '.join(compared.common_unknowns)}")
    sentences.append(
        "to pair the draws, give both cases the same values in their tables, and the same ranges "
        "in [uncertain], as below, and run both with --spread"
    )
    return sentences


def wrapped_sentences(sentences: Iterable[str]) -> list[str]:
    """Sentences as lines of a terminal; the further lines of a sentence are indented."""
    lines = []
    for sentence in sentences:
        lines += wrapped(sentence, "  ")
    return lines
