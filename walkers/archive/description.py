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

ARCHIVE_FORMAT = 1
"""Version of the format of ``archive.json``."""
PAPER_URL = "https://doi.org/10.48550/arXiv.1003.1623"
"""The paper with the experiment and the theory of the walkers."""
_SOFTWARE_KEYS = ("granular_walkers", "commit", "python", "packages")
"""Keys of a manifest that name the software of a run."""


def archive_record(
    contents: Contents, authors: Sequence[str], licence: str | None
) -> dict[str, Any]:
    """The contents of ``archive.json``: what the archive is, and which software made each run.

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
        ``runs`` has for the folder of each run its ``case``, when it was ``finished``, the
        software that made it (``made_by``), the software that measured it again (``measured_by``)
        if any did, the version and SHA-256 of the ``engine``, and the version of the
        ``contact_model``. The ``finished`` of the archive is that of the last run.
    """
    return {
        "format": ARCHIVE_FORMAT,
        "name": contents.name,
        "title": contents.title,
        "authors": list(authors),
        "licence": licence,
        "finished": contents.finished,
        "runs": {run: _about_run(manifest) for run, manifest in contents.manifests.items()},
    }


def _about_run(manifest: Mapping[str, Any]) -> dict[str, Any]:
    """What ``archive.json`` says about a run, from its manifest."""
    about = {
        "case": manifest["name"],
        "finished": manifest["finished"],
        "made_by": _software_in(manifest),
    }
    if "tabulated" in manifest:
        measured = manifest["tabulated"]
        about["measured_by"] = {"date": measured.get("date"), **_software_in(measured)}
    engine = manifest["engine"]
    about["engine"] = {"version": engine["version"], "sha256": engine["sha256"]}
    model = manifest.get("contact_model")
    if model:
        about["contact_model"] = {name: model[name] for name in model if name != "path"}
    return about


def _software_in(manifest: Mapping[str, Any]) -> dict[str, Any]:
    return {name: manifest[name] for name in _SOFTWARE_KEYS if name in manifest}


def readme(contents: Contents, authors: Sequence[str], licence: str | None) -> str:
    """The ``README.md`` of an archive, whose commands are for the first of its runs.

    Parameters are as for `archive_record`.
    """
    example = contents.main[0]
    deck_folder = contents.deck_folder(example)
    return rendered(
        "walkers.archive",
        "README.md.j2",
        {
            "contents": contents,
            "by": ", ".join(authors),
            "licence": licence or "",
            "paper": PAPER_URL,
            "record": RECORD_FILE,
            "sums": SUMS_NAME,
            "example": example,
            "deck_folder": deck_folder,
            "has_tables": contents.has_tables(example),
            "ranks": contents.cases[example].run.ranks,
            "model_folder": MODEL_FOLDER,
            "model_sentence": _model_sentence(contents.manifests.values()),
            "repeat": REPEAT_NAME,
        },
    )


def _model_sentence(manifests: Collection[Mapping[str, Any]]) -> str:
    """Tells whether the runs were made with the sources of the contact model in the archive."""
    present = model_version()
    # The manifest of a deck that was run by hand has no contact model, or null.
    models = [manifest.get("contact_model") or {} for manifest in manifests]
    if all(model.get("sources") == present["sources"] for model in models):
        return "The runs were made with these sources."
    versions = {model.get("forces_version") for model in models}
    if versions == {present["forces_version"]}:
        return "Some runs were made with other sources that compute the same forces."
    return (
        "Some runs were made with another version of the contact model, or do not record it: their "
        "manifests name the version of granular-walkers. Such runs may give other dumps with these "
        "sources."
    )
