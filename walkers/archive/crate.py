"""The description of an archive: an RO-Crate (researchobject.org) by the Process Run Crate profile.

Each run is an action of the engine, from case and deck to the dumps; one action of this program makes the tables.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

from walkers.archive.contents import METADATA_NAME, Contents, File
from walkers.runner.provenance import PROJECT

CRATE = "https://w3id.org/ro/crate/1.1"
"""Version of RO-Crate that the profile extends."""
PROFILE = "https://w3id.org/ro/wfrun/process/0.5"
ENGINE_HOME = "https://github.com/CFDEMproject/LIGGGHTS-PUBLIC"
_ENGINE_LICENCE = "GPL-2.0-or-later"
"""Licence of the contact model, which is loaded into LIGGGHTS."""
PAPER = "https://doi.org/10.48550/arXiv.1003.1623"
_PAPER_PROPERTIES = {
    "name": "Self-assembled granular walkers",
    "author": "Z. S. Khan, A. Steinberger, R. Seemann, S. Herminghaus",
    "datePublished": "2010",
    "identifier": PAPER,
    "url": "https://arxiv.org/abs/1003.1623",
}
_MEDIA = {".json": "application/json", ".parquet": "application/vnd.apache.parquet", ".csv": "text/csv"}


class Author(NamedTuple):
    """Author of the runs: name, and ORCID (``0000-0002-1825-0097``) or None."""

    name: str
    orcid: str | None = None


Reference = dict[str, str]


class _Graph(dict[str, dict[str, Any]]):
    """Entities of a crate by identifier."""

    def add(self, identifier: str, kind: str, /, **properties: Any) -> Reference:
        """Add an entity, once; returns a reference to it."""
        self.setdefault(identifier, {"@id": identifier, "@type": kind, **properties})
        return {"@id": identifier}

    def action(self, name: str, text: str, instrument: Reference, ended: str, /, **more: Any) -> Reference:
        """What a program has done."""
        more |= {"endTime": ended, "actionStatus": "http://schema.org/CompletedActionStatus"}
        return self.add(f"#{quote(name)}", "CreateAction", name=name, description=text, instrument=instrument, **more)


def describe_crate(contents: Contents, authors: Sequence[Author], licence: str) -> dict[str, Any]:
    """The metadata of an archive, JSON-LD; the licence is an SPDX identifier, the date is the end of the last run."""
    graph = _Graph()
    about, profile = {"@id": "./"}, {"name": "Process Run Crate", "version": PROFILE.rpartition("/")[2]}
    graph.add(METADATA_NAME, "CreativeWork", about=about, conformsTo={"@id": CRATE})
    people = [
        graph.add(f"https://orcid.org/{orcid}" if orcid else f"#{quote(name)}", "Person", name=name)
        for name, orcid in authors
    ]
    agents = {"agent": people} if people else {}
    spdx = {"name": licence, "description": f"The licence {licence} of the SPDX list", "identifier": licence}
    graph.add(
        "./",
        "Dataset",
        name=f"{contents.name}: {contents.title}".rstrip(": "),
        description=f"Wet granular walkers, simulated by the discrete element method with LIGGGHTS through {PROJECT}.",
        datePublished=contents.finished,
        license=graph.add(f"https://spdx.org/licenses/{licence}", "CreativeWork", **spdx),
        conformsTo=graph.add(PROFILE, "CreativeWork", **profile),
        citation=graph.add(PAPER, "ScholarlyArticle", **_PAPER_PROPERTIES),
        hasPart=[_describe_file(graph, place, file) for place, file in contents.files.items()]
        + [{"@id": quote(f"{place}/")} for place in contents.manifests],
        mentions=[
            *(_simulation(graph, contents, place, **agents) for place in contents.manifests),
            _analysis(graph, contents, **agents),
        ],
        **({"author": people} if people else {}),
    )
    entities = [  # by the specification, lists have more than one item
        {key: value[0] if isinstance(value, list) and len(value) == 1 else value for key, value in entity.items()}
        for entity in graph.values()
    ]
    # This version of the context has no checksums.
    return {"@context": [f"{CRATE}/context", {"sha256": "http://schema.org/sha256"}], "@graph": entities}


def _with_role(contents: Contents, *roles: str, folder: str = "") -> list[Reference]:
    """The files below a folder that have one of the roles."""
    places = (place for place, file in contents.files.items() if file.role in roles and place.startswith(folder))
    return [{"@id": quote(place)} for place in places]


def _describe_file(graph: _Graph, place: str, file: File) -> Reference:
    with file.open() as opened:
        size = opened.seek(0, 2)
    path = Path(place)
    media = _MEDIA.get(path.suffix, "application/octet-stream" if file.role == "dump" else "text/plain")
    about: dict[str, Any] = {"name": path.name, "encodingFormat": media, "contentSize": str(size)}
    about["sha256"] = file.sha256
    if file.role == "engine":
        text = {"name": _ENGINE_LICENCE, "identifier": _ENGINE_LICENCE}
        spdx = f"https://spdx.org/licenses/{_ENGINE_LICENCE}"
        about["license"] = graph.add(spdx, "CreativeWork", **text)
    return graph.add(quote(place), "File", **about)


def _simulation(graph: _Graph, contents: Contents, place: str, **agents: Any) -> Reference:
    """The folder of a run, and the action of the engine in it."""
    manifest, folder, name = contents.manifests[place], f"{place}/", Path(place).name
    text = f"Run directory of the case {manifest['name']}, finished {manifest['finished']}"
    parts = [{"@id": quote(path)} for path in contents.files if path.startswith(folder)]
    graph.add(quote(folder), "Dataset", name=name, description=text, hasPart=parts)
    engine, further_cases = manifest["engine"], int(manifest.get("shared_deck", {}).get("runs", 1)) - 1
    text = "Discrete element method. The SHA-256 combines the checksums of the executable and libliggghts."
    more = {"name": "LIGGGHTS", "softwareVersion": engine["version"], "url": ENGINE_HOME, "description": text}
    binary = f"{ENGINE_HOME}#{engine['sha256'][:12]}"
    return graph.action(
        f"Simulation of {name}",
        f"The engine runs the deck{f', together with {further_cases} other cases' if further_cases else ''}.",
        graph.add(binary, "SoftwareApplication", **more, sha256=engine["sha256"]),
        manifest["finished"],
        startTime=manifest["started"],
        object=_with_role(contents, "case", "deck", folder=folder),
        result=_with_role(contents, "dump", "output", folder=folder),
        **agents,
    )


def _analysis(graph: _Graph, contents: Contents, **agents: Any) -> Reference:
    """The action of this program, which makes the tables of all runs."""
    manifests = [manifest.get("tabulated", manifest) for manifest in contents.manifests.values()]
    ends = [str(manifest.get("date", manifest.get("finished"))) for manifest in manifests]
    manifest = manifests[ends.index(max(ends))]
    version = ", commit ".join(filter(None, (manifest["granular_walkers"], manifest["commit"])))
    text = "Cases, decks, runs and analyses of wet granular walkers. Manifests name the packages that it used."
    return graph.action(
        f"Tables of {contents.name}",
        "Analysis of the dumps: tables and results.",
        graph.add(f"#{PROJECT}", "SoftwareApplication", name=PROJECT, softwareVersion=version, description=text),
        max(ends),
        object=_with_role(contents, "case", "dump", "record"),
        result=_with_role(contents, "table", "result"),
        **agents,
    )
