"""The description of an archive: an RO-Crate (researchobject.org) by the Process Run Crate profile, with rocrate.

What made what is told in three actions a run, each with its program, what it read and what it gave: from the case to
the deck (this program), from the deck to the dumps (the engine), from the dumps to tables and result (this program).
Runs that shared a deck share the first two.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from walkers.archive.citation import LICENCES, PAPER, PAPER_PROPERTIES, Author
from walkers.archive.contents import Contents, Item, PackedFolder
from walkers.runner.provenance import PROJECT

if TYPE_CHECKING:
    from rocrate.model.entity import Entity
    from rocrate.rocrate import ROCrate

METADATA_NAME = "ro-crate-metadata.json"
PREVIEW_NAME = "ro-crate-preview.html"
VERSION = "1.1"
"""Of RO-Crate: the one that the profile extends."""
PROFILE = "https://w3id.org/ro/wfrun/process/0.5"
_TERMS = {"sha256": "http://schema.org/sha256"}
"""Younger than that version's context."""
ENGINE_HOME = "https://github.com/CFDEMproject/LIGGGHTS-PUBLIC"


def describe_crate(
    contents: Contents, sums: Mapping[str, str], authors: Sequence[Author], licence: str
) -> dict[str, Any]:
    """The metadata of an archive.

    Parameters
    ----------
    contents
        What it holds.
    sums
        From the places of its files to their SHA-256.
    authors
        Of the runs.
    licence
        Key of `walkers.archive.citation.LICENCES`.

    Returns
    -------
    dict
        JSON-LD. Dated by the last of the runs, not by the day: the same runs give the same archive.
    """
    from rocrate.rocrate import ROCrate

    crate = ROCrate(version=VERSION)
    crate.metadata.extra_terms.update(_TERMS)
    root = crate.root_dataset
    root["datePublished"] = _moment(contents.finished)
    root["name"] = f"{contents.name}: {contents.title}".rstrip(": ")
    root["description"] = _what(contents)
    address, name = LICENCES[licence]
    root["license"] = _entity(crate, address, {"@type": "CreativeWork", "name": name, "identifier": licence})
    root["conformsTo"] = _entity(
        crate, PROFILE, {"@type": "CreativeWork", "name": "Process Run Crate", "version": PROFILE.rpartition("/")[2]}
    )
    root["citation"] = _entity(crate, PAPER, PAPER_PROPERTIES)
    people = [_person(crate, author) for author in authors]
    if people:
        root["author"] = people
    _preview(crate)
    described = _Described(crate, sums, people)
    for item in contents.sweep:
        described.file(item)
    for folder in contents.folders:
        described.folder(folder)
    actions = [action for folder in contents.folders for action in described.actions(folder, contents.runs)]
    if contents.record is not None:
        last = contents.runs[-1].manifest
        results = [item for run in contents.runs for item in run.with_role("result")]
        record, tables = ([item for item in contents.sweep if (item.role == "table") == table] for table in (0, 1))
        actions.append(
            described.action(
                f"#{contents.name}-table",
                f"Table of the sweep {contents.name}",
                "The results of the runs, put into one table, one row per point.",
                described.program(last),
                (record + results, tables),
                (None, contents.finished),
            )
        )
    root["mentions"] = actions
    metadata: dict[str, Any] = crate.metadata.generate()
    for entity in metadata["@graph"]:  # what is one is no list, by the specification
        entity.update({key: one[0] for key, one in entity.items() if isinstance(one, list) and len(one) == 1})
    return metadata


def as_bytes(metadata: Mapping[str, Any]) -> bytes:
    """The metadata as its file has it."""
    return (json.dumps(metadata, indent=2, ensure_ascii=False) + "\n").encode("utf-8")


def _what(contents: Contents) -> str:
    runs = "A run" if contents.record is None else f"The {len(contents.runs)} runs of a sweep"
    left_out = any("left_out" in run.manifest for run in contents.runs)
    return (
        f"{runs} of wet granular walkers, simulated by the discrete element method with LIGGGHTS through {PROJECT}: "
        "cases, decks, what the engine wrote, and the tables and results made from that."
        + (" The dumps that the tables were made from are left out." if left_out else "")
    )


def _entity(crate: ROCrate, identifier: str, properties: Mapping[str, Any]) -> Entity:
    """A contextual entity, once."""
    from rocrate.model.contextentity import ContextEntity

    there = crate.get(identifier)
    return there if there is not None else crate.add(ContextEntity(crate, identifier, properties=dict(properties)))


def _person(crate: ROCrate, author: Author) -> Entity:
    identifier = f"https://orcid.org/{author.orcid}" if author.orcid else f"#{quote(author.name)}"
    return _entity(crate, identifier, {"@type": "Person", "name": author.name})


def _preview(crate: ROCrate) -> None:
    properties = {"@type": "CreativeWork", "name": "What this is, for people", "about": {"@id": "./"}}
    _entity(crate, PREVIEW_NAME, {**properties, "encodingFormat": "text/html"})


def _moment(iso: str) -> str:
    return iso.removesuffix("Z") + "+00:00"


class _Described:
    """A crate that is being described."""

    def __init__(self, crate: ROCrate, sums: Mapping[str, str], people: Sequence[Entity]) -> None:
        self.crate, self.sums, self.people = crate, sums, people
        self.files: dict[str, Entity] = {}

    def file(self, item: Item) -> Entity:
        """A file of the archive, a table with its columns."""
        properties: dict[str, Any] = {
            "name": item.name,
            "description": item.meaning,
            "encodingFormat": item.media_type,
            "contentSize": str(item.size),
            "sha256": self.sums[item.place],
        }
        if item.name.endswith(".parquet"):
            properties["variableMeasured"] = self._columns(item)
        # Without a source: the archive is written by ourselves, this is its description.
        entity = self.files[item.place] = self.crate.add_file(None, item.place, properties=properties)
        return entity

    def _columns(self, item: Item) -> list[Entity]:
        import pyarrow as pa
        import pyarrow.parquet as pq

        table = item.name.removesuffix(".parquet")
        entities = []
        for field in pq.read_schema(pa.BufferReader(item.source) if isinstance(item.source, bytes) else item.source):
            told = {key.decode(): value.decode() for key, value in (field.metadata or {}).items()}
            properties = {"@type": "PropertyValue", "name": field.name, "description": told.get("meaning", "")}
            if told.get("unit"):
                properties["unitText"] = told["unit"]
            entities.append(_entity(self.crate, f"#{quote(f'{table}.{field.name}')}", properties))
        return entities

    def folder(self, folder: PackedFolder) -> None:
        """A run's folder, and its files."""
        parts = [self.file(item) for item in folder.items]
        shared = "shared_deck" in folder.manifest and folder.shares is None
        told = "A deck that several cases shared" if shared else f"Run directory of the case {folder.manifest['name']}"
        properties = {"name": folder.name, "description": f"{told}, finished {folder.manifest['finished']}"}
        entity = self.crate.add_dataset(None, f"{folder.place}/", properties=properties)
        entity["hasPart"] = parts

    def actions(self, folder: PackedFolder, runs: Sequence[PackedFolder]) -> list[Entity]:
        """What made the files of a run, or those that the runs of an ensemble share."""
        manifest, name = folder.manifest, folder.name
        began, ended = str(manifest["started"]), str(manifest["finished"])
        program = self.program(manifest)
        made: list[Entity] = []
        if folder.shares is None:
            within = [folder, *(run for run in runs if run.shares == folder.place)]
            cases = [item for one in within for item in one.with_role("case")]
            deck = folder.with_role("deck")
            outputs = [item for one in within for item in one.with_role("dump", "output")]
            made = [
                self.action(
                    f"#{name}-deck",
                    f"Deck of {name}",
                    "The case resolved, and the deck of it rendered.",
                    program,
                    (cases, deck),
                    (None, began),
                ),
                self.action(
                    f"#{name}-engine",
                    f"Engine's run of {name}",
                    "The engine's run of the deck: the motion of the beads, step by step.",
                    self.engine(manifest),
                    (deck, outputs),
                    (began, ended),
                ),
            ]
        tables = folder.with_role("table", "result")
        if tables:
            again = manifest.get("tabulated")
            read = [*folder.with_role("dump"), *(item for item in folder.items if item.name == "layout.json")]
            made.append(
                self.action(
                    f"#{name}-tables",
                    f"Tables of {name}",
                    "The dumps analysed: tables and result.",
                    self.program(again) if again else program,
                    ([*folder.with_role("case"), *read], tables),
                    (None, str(again["date"]) if again else ended),
                )
            )
        return made

    def action(
        self,
        identifier: str,
        name: str,
        description: str,
        instrument: Entity,
        files: tuple[Iterable[Item], Iterable[Item]],
        times: tuple[str | None, str],
    ) -> Entity:
        """What a program read and gave, and when (begin, if known, and end)."""
        read, gave = ([self.files[item.place] for item in some] for some in files)
        began, ended = times
        properties: dict[str, Any] = {
            "@type": "CreateAction",
            "name": name,
            "description": description,
            "instrument": instrument,
            "object": read,
            "result": gave,
            "endTime": _moment(ended),
            "actionStatus": "http://schema.org/CompletedActionStatus",
        }
        if began:
            properties["startTime"] = _moment(began)
        if self.people:
            properties["agent"] = list(self.people)
        return _entity(self.crate, identifier, properties)

    def engine(self, manifest: Mapping[str, Any]) -> Entity:
        """LIGGGHTS, by its binary."""
        engine = manifest["engine"]
        properties = {
            "@type": "SoftwareApplication",
            "name": "LIGGGHTS",
            "softwareVersion": engine["version"],
            "url": ENGINE_HOME,
            "sha256": engine["sha256"],
            "description": "Discrete element method. The SHA-256 is over those of the executable and its libliggghts.",
        }
        return _entity(self.crate, f"{ENGINE_HOME}#{engine['sha256'][:12]}", properties)

    def program(self, made_by: Mapping[str, Any]) -> Entity:
        """Our own, with Python and the packages, as a manifest names them."""
        version, commit = made_by["granular_walkers"], made_by.get("commit")
        packages = dict(made_by.get("packages", {}))
        needed = [self._package(name, version) for name, version in packages.items()]
        if python := made_by.get("python"):
            properties = {"@type": "SoftwareApplication", "name": "Python", "softwareVersion": python}
            needed.append(
                _entity(
                    self.crate, f"https://www.python.org/#{python}", {**properties, "url": "https://www.python.org/"}
                )
            )
        properties = {
            "@type": "SoftwareApplication",
            "name": PROJECT,
            "softwareVersion": f"{version}, commit {commit}" if commit else version,
            "description": "Cases, decks, runs and analyses of wet granular walkers.",
            **({"softwareRequirements": needed} if needed else {}),
        }
        identity = json.dumps([version, commit, python, packages], sort_keys=True)
        return _entity(self.crate, f"#{PROJECT}-{_short(identity)}", properties)

    def _package(self, name: str, version: str) -> Entity:
        home = f"https://pypi.org/project/{name}/{version}/"
        properties = {"@type": "SoftwareApplication", "name": name, "softwareVersion": version, "url": home}
        return _entity(self.crate, home, properties)


def _short(identity: str) -> str:
    import hashlib

    return hashlib.sha256(identity.encode()).hexdigest()[:8]
