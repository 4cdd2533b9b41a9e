"""The description of an archive: an RO-Crate (researchobject.org) by the Process Run Crate profile, with rocrate.

What made what is told in three actions a run, each with its program, what it read and what it gave: from the case to
the deck (this program), from the deck to the dumps (the engine), from the dumps to tables and result (this program).
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from walkers.archive.citation import LICENCES, PAPER, PAPER_PROPERTIES, Author
from walkers.archive.contents import Contents, Item, PackedRun
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
    about = {"@type": "CreativeWork", "name": "What this is, for people", "encodingFormat": "text/html"}
    _entity(crate, PREVIEW_NAME, {**about, "about": {"@id": "./"}})
    described = _Described(crate, sums, people)
    for item in contents.sweep:
        described.file(item)
    for run in contents.runs:
        described.run(run)
    actions = [action for run in contents.runs for action in described.actions(run)]
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

    def run(self, run: PackedRun) -> None:
        """A run's folder, and its files."""
        told = f"Run directory of the case {run.manifest['name']}, finished {run.manifest['finished']}"
        entity = self.crate.add_dataset(None, f"{run.place}/", properties={"name": run.name, "description": told})
        entity["hasPart"] = [self.file(item) for item in run.items]

    def actions(self, run: PackedRun) -> list[Entity]:
        """What made the files of a run."""
        manifest, name = run.manifest, run.name
        began, ended = str(manifest["started"]), str(manifest["finished"])
        program = self.program(manifest)
        cases, decks = run.with_role("case"), run.with_role("deck")
        others = int(manifest.get("shared_deck", {}).get("runs", 1)) - 1
        company = f", together with {others} other cases" if others else ""
        deck = self.action(
            f"#{name}-deck",
            f"Deck of {name}",
            f"The case resolved, and the deck of it rendered{company}.",
            program,
            (cases, decks),
            (None, began),
        )
        engine = self.action(
            f"#{name}-engine",
            f"Engine's run of {name}",
            "The engine's run of the deck: the motion of the beads, step by step.",
            self.engine(manifest),
            (decks, run.with_role("dump", "output")),
            (began, ended),
        )
        again = manifest.get("tabulated")
        read = [*cases, *run.with_role("dump"), *(item for item in run.items if item.name == "layout.json")]
        tables = self.action(
            f"#{name}-tables",
            f"Tables of {name}",
            "The dumps analysed: tables and result.",
            self.program(again) if again else program,
            (read, run.with_role("table", "result")),
            (None, str(again["date"]) if again else ended),
        )
        return [deck, engine, tables]

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
        version, sha256 = manifest["engine"]["version"], manifest["engine"]["sha256"]
        told = "Discrete element method. The SHA-256 is over those of the executable and its libliggghts."
        more = {"url": ENGINE_HOME, "sha256": sha256, "description": told}
        return self._software(f"{ENGINE_HOME}#{sha256[:12]}", "LIGGGHTS", version, **more)

    def program(self, made_by: Mapping[str, Any]) -> Entity:
        """Our own, with Python and the packages, as a manifest names them."""
        version, commit, python = made_by["granular_walkers"], made_by.get("commit"), made_by.get("python")
        packages = dict(made_by.get("packages", {}))
        homes = {name: f"https://pypi.org/project/{name}/{one}/" for name, one in packages.items()}
        needed = [self._software(home, name, packages[name], url=home) for name, home in homes.items()]
        if python:
            home = "https://www.python.org/"
            needed.append(self._software(f"{home}#{python}", "Python", python, url=home))
        identity = json.dumps([version, commit, python, packages], sort_keys=True)
        more = {"softwareRequirements": needed} if needed else {}
        return self._software(
            f"#{PROJECT}-{hashlib.sha256(identity.encode()).hexdigest()[:8]}",
            PROJECT,
            f"{version}, commit {commit}" if commit else version,
            description="Cases, decks, runs and analyses of wet granular walkers.",
            **more,
        )

    def _software(self, identifier: str, name: str, version: str, **more: Any) -> Entity:
        properties = {"@type": "SoftwareApplication", "name": name, "softwareVersion": version, **more}
        return _entity(self.crate, identifier, properties)
