"""Descriptions of an archive: ``archive.json`` for programs, and ``README.md`` for readers."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from walkers.archive.contents import (
    MODEL_FOLDER,
    RECORD_FILE,
    REPEAT_NAME,
    SUMS_NAME,
    Contents,
)
from walkers.runner.model_sources import model_version
from walkers.text import rendered

FORMAT = 1
"""Version of ``archive.json``."""
PAPER = "https://doi.org/10.48550/arXiv.1003.1623"
_PROGRAM = ("granular_walkers", "commit", "python", "packages")
"""Software of a run, as manifests have it."""


def archive_record(
    contents: Contents, authors: Sequence[str], licence: str | None
) -> dict[str, Any]:
    """The contents of ``archive.json``: what the archive is, and which programs made each run.

    Parameters
    ----------
    contents
        The contents of the archive.
    authors
        Names of the authors of the runs.
    licence
        Licence of the data; None: not stated.

    Returns
    -------
    dict
        ``runs`` has for each folder of a run its ``case``, the end of the run (``finished``), the software that
        made it (``made_by``) and that measured it again (``measured_by``), if it did, the ``engine`` with its
        SHA-256, and the version of the ``contact_model``. ``finished`` is the end of the last run.
    """
    return {
        "format": FORMAT,
        "name": contents.name,
        "title": contents.title,
        "authors": list(authors),
        "licence": licence,
        "finished": contents.finished,
        "runs": {place: _run_of(manifest) for place, manifest in contents.manifests.items()},
    }


def _run_of(manifest: Mapping[str, Any]) -> dict[str, Any]:
    """What ``archive.json`` says of a run, from its manifest."""
    about = {
        "case": manifest["name"],
        "finished": manifest["finished"],
        "made_by": _software_in(manifest),
    }
    if "tabulated" in manifest:
        again = manifest["tabulated"]
        about["measured_by"] = {"date": again.get("date"), **_software_in(again)}
    engine = manifest["engine"]
    about["engine"] = {"version": engine["version"], "sha256": engine["sha256"]}
    model = manifest.get("contact_model")
    if model:
        about["contact_model"] = {name: model[name] for name in model if name != "path"}
    return about


def _software_in(manifest: Mapping[str, Any]) -> dict[str, Any]:
    return {name: manifest[name] for name in _PROGRAM if name in manifest}


def readme(contents: Contents, authors: Sequence[str], licence: str | None) -> str:
    """The ``README.md`` of an archive, whose commands are for the first of its runs; see `archive_record`."""
    example = contents.main[0]
    deck_folder = contents.deck_folder(example)
    values = {
        "contents": contents,
        "by": ", ".join(authors),
        "licence": licence or "",
        "paper": PAPER,
        "record": RECORD_FILE,
        "sums": SUMS_NAME,
        "example": example,
        "deck_folder": deck_folder,
        "has_tables": contents.has_tables(example),
        "ranks": contents.cases[example].run.ranks,
        "model_folder": MODEL_FOLDER,
        "model_sentence": _model_sentence(contents.manifests.values()),
        "repeat": REPEAT_NAME,
    }
    return rendered("walkers.archive", "README.md.j2", values)


def _model_sentence(manifests: Collection[Mapping[str, Any]]) -> str:
    """Whether the sources of the contact model in the archive are those with which the runs were made."""
    present = model_version()
    # The manifest of a deck that was run by hand does not know the model.
    models = [manifest.get("contact_model") or {} for manifest in manifests]
    if all(model.get("sources") == present["sources"] for model in models):
        return "The runs were made with these sources."
    versions = {model.get("forces_version") for model in models}
    if versions == {present["forces_version"]}:
        return "Some runs were made with other sources that compute the same forces."
    return (
        "Some runs were made with another version of the contact model, or do not record it: their manifests name "
        "the version of granular-walkers. Such runs may give other dumps with these sources."
    )
