"""The description of an archive: an RO-Crate (researchobject.org) by the Process Run Crate profile, with rocrate.

Each run has three actions with program, input and output: from the case to the deck (this program), from the deck to
the dumps (the engine), from the dumps to tables and result (this program).
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from walkers.runner.provenance import PROJECT

if TYPE_CHECKING:
    from rocrate.model.entity import Entity

    from walkers.archive.writing import Contents, Item, PackedRun

METADATA_NAME = "ro-crate-metadata.json"
PREVIEW_NAME = "ro-crate-preview.html"
VERSION = "1.1"
"""Version of RO-Crate that the profile extends."""
PROFILE = "https://w3id.org/ro/wfrun/process/0.5"
ENGINE_HOME = "https://github.com/CFDEMproject/LIGGGHTS-PUBLIC"
PAPER = "https://doi.org/10.48550/arXiv.1003.1623"
_PAPER_PROPERTIES = {
    "name": "Self-assembled granular walkers",
    "author": "Z. S. Khan, A. Steinberger, R. Seemann, S. Herminghaus",
    "datePublished": "2010",
    "identifier": PAPER,
    "url": "https://arxiv.org/abs/1003.1623",
}
LICENCES = {
    "CC-BY-4.0": ("https://creativecommons.org/licenses/by/4.0/", "Creative Commons Attribution 4.0 International"),
    "CC0-1.0": ("https://creativecommons.org/publicdomain/zero/1.0/", "Creative Commons Zero 1.0 Universal"),
    "CC-BY-SA-4.0": (
        "https://creativecommons.org/licenses/by-sa/4.0/",
        "Creative Commons Attribution Share Alike 4.0 International",
    ),
    "BSD-3-Clause": ("https://opensource.org/license/bsd-3-clause", 'BSD 3-Clause "New" or "Revised" License'),
}
"""Addresses and names of licences, by SPDX identifier."""
_MEDIA = {
    ".json": "application/json",
    ".toml": "application/toml",
    ".parquet": "application/vnd.apache.parquet",
    ".csv": "text/csv",
    ".html": "text/html",
    **dict.fromkeys((".lig", ".txt", ".log"), "text/plain"),
}


@dataclass(frozen=True)
class Author:
    """Author of the runs: name, and ORCID (``0000-0002-1825-0097``) or None."""

    name: str
    orcid: str | None = None


def describe_crate(contents: Contents, authors: Sequence[Author], licence: str) -> dict[str, Any]:
    """The metadata of an archive, JSON-LD, under one of `LICENCES`; the date is the end of the last run."""
    made = _Crate(authors)
    for one in contents.sweep:
        made.file(one)
    for run in contents.runs:
        text = f"Run directory of the case {run.manifest['name']}, finished {run.manifest['finished']}"
        folder = made.crate.add_dataset(None, f"{run.place}/", properties={"name": run.name, "description": text})
        folder["hasPart"] = [made.file(one) for one in run.items]
    actions = [action for run in contents.runs for action in made.actions(run)]
    if contents.record is not None:
        results = [one for run in contents.runs for one in run.with_role("result")]
        table = made.action(
            f"#{contents.name}-table",
            f"Table of the sweep {contents.name}",
            "The results of the runs in one table, one row per point.",
            made.program(contents.runs[-1].manifest),
            [*(one for one in contents.sweep if one.role != "table"), *results],
            [one for one in contents.sweep if one.role == "table"],
            (None, contents.finished),
        )
        actions.append(table)
    made.describe_root(contents, licence)
    made.crate.root_dataset["mentions"] = actions
    metadata: dict[str, Any] = made.crate.metadata.generate()
    for entity in metadata["@graph"]:  # by the specification, lists have more than one item
        entity.update({key: one[0] for key, one in entity.items() if isinstance(one, list) and len(one) == 1})
    return metadata


def _moment(iso: str) -> str:
    return iso.removesuffix("Z") + "+00:00"


class _Crate:
    """A crate under construction, with files and people, to which other entities refer."""

    def __init__(self, authors: Sequence[Author]) -> None:
        from rocrate.rocrate import ROCrate

        self.crate = ROCrate(version=VERSION)
        self.crate.metadata.extra_terms["sha256"] = "http://schema.org/sha256"  # not in the context of that version
        self.files: dict[str, Entity] = {}
        self.people = []
        for author in authors:
            identifier = f"https://orcid.org/{author.orcid}" if author.orcid else f"#{quote(author.name)}"
            self.people.append(self.entity(identifier, "Person", name=author.name))

    def entity(self, identifier: str, kind: str, /, **properties: Any) -> Entity:
        """A contextual entity, added once."""
        from rocrate.model.contextentity import ContextEntity

        made = ContextEntity(self.crate, identifier, properties={"@type": kind, **properties})
        return self.crate.get(identifier) or self.crate.add(made)

    def describe_root(self, contents: Contents, licence: str) -> None:
        """Describe the archive: title, licence, authors and the cited paper."""
        runs = "A run" if contents.record is None else f"The {len(contents.runs)} runs of a sweep"
        left_out = any("left_out" in run.manifest for run in contents.runs)
        address, name = LICENCES[licence]
        profile = {"name": "Process Run Crate", "version": PROFILE.rpartition("/")[2]}
        root = self.crate.root_dataset
        root["datePublished"] = _moment(contents.finished)
        root["name"] = f"{contents.name}: {contents.title}".rstrip(": ")
        root["description"] = (
            f"{runs} of wet granular walkers, simulated by the discrete element method with LIGGGHTS through {PROJECT}"
            ": cases, decks, output of the engine, and the tables and results computed from it."
            + (" The dumps, from which the tables were computed, are left out." if left_out else "")
        )
        root["license"] = self.entity(address, "CreativeWork", name=name, identifier=licence)
        root["conformsTo"] = self.entity(PROFILE, "CreativeWork", **profile)
        root["citation"] = self.entity(PAPER, "ScholarlyArticle", **_PAPER_PROPERTIES)
        if self.people:
            root["author"] = list(self.people)
        about = {"name": "Description for readers", "encodingFormat": "text/html", "about": {"@id": "./"}}
        self.entity(PREVIEW_NAME, "CreativeWork", **about)

    def file(self, item: Item) -> Entity:
        """A file of the archive, a table with its columns."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        properties: dict[str, Any] = {
            "name": item.name,
            "description": item.meaning,
            "encodingFormat": _MEDIA.get(Path(item.name).suffix, "application/octet-stream"),
            "contentSize": str(item.size),
            "sha256": item.sha256,
        }
        if item.name.endswith(".parquet"):
            columns = properties["variableMeasured"] = []
            table, source = item.name.removesuffix(".parquet"), item.source
            for field in pq.read_schema(pa.BufferReader(source) if isinstance(source, bytes) else source):
                metadata = {key.decode(): value.decode() for key, value in (field.metadata or {}).items()}
                column = {"name": field.name, "description": metadata.get("meaning", "")}
                if metadata.get("unit"):
                    column["unitText"] = metadata["unit"]
                columns.append(self.entity(f"#{quote(f'{table}.{field.name}')}", "PropertyValue", **column))
        # Without a source, because rocrate only describes the archive.
        entity = self.files[item.place] = self.crate.add_file(None, item.place, properties=properties)
        return entity

    def actions(self, run: PackedRun) -> list[Entity]:
        """The actions that produced the files of a run."""
        manifest, name = run.manifest, run.name
        began, ended, again = manifest["started"], manifest["finished"], manifest.get("tabulated")
        cases, decks = run.with_role("case"), run.with_role("deck")
        layouts = [one for one in run.items if one.name == "layout.json"]
        others = int(manifest.get("shared_deck", {}).get("runs", 1)) - 1
        company = f", together with {others} other cases" if others else ""
        return [
            self.action(
                f"#{name}-deck",
                f"Deck of {name}",
                f"Resolving the case and writing its deck{company}.",
                self.program(manifest),
                cases,
                decks,
                (None, began),
            ),
            self.action(
                f"#{name}-engine",
                f"Simulation of {name}",
                "The engine runs the deck and integrates the motion of the beads.",
                self.engine(manifest["engine"]),
                decks,
                run.with_role("dump", "output"),
                (began, ended),
            ),
            self.action(
                f"#{name}-tables",
                f"Tables of {name}",
                "Analysis of the dumps: tables and result.",
                self.program(again or manifest),
                [*cases, *run.with_role("dump"), *layouts],
                run.with_role("table", "result"),
                (None, again["date"] if again else ended),
            ),
        ]

    def action(
        self,
        identifier: str,
        name: str,
        description: str,
        instrument: Entity,
        read: Sequence[Item],
        gave: Sequence[Item],
        times: tuple[str | None, str],
    ) -> Entity:
        """An action: input and output files of a program, begin (if known) and end."""
        began, ended = times
        properties: dict[str, Any] = {
            "name": name,
            "description": description,
            "instrument": instrument,
            "object": [self.files[item.place] for item in read],
            "result": [self.files[item.place] for item in gave],
            "endTime": _moment(ended),
            "actionStatus": "http://schema.org/CompletedActionStatus",
        }
        if began:
            properties["startTime"] = _moment(began)
        if self.people:
            properties["agent"] = list(self.people)
        return self.entity(identifier, "CreateAction", **properties)

    def engine(self, engine: Mapping[str, Any]) -> Entity:
        """LIGGGHTS, by its binary."""
        text = "Discrete element method. The SHA-256 combines those of the executable and libliggghts."
        more = {"url": ENGINE_HOME, "sha256": engine["sha256"], "description": text}
        return self._software(f"{ENGINE_HOME}#{engine['sha256'][:12]}", "LIGGGHTS", engine["version"], **more)

    def program(self, made_by: Mapping[str, Any]) -> Entity:
        """The program, Python and the packages, as listed in a manifest."""
        version, commit, python = (made_by[key] for key in ("granular_walkers", "commit", "python"))
        home, needed = "https://www.python.org/", []
        for name, one in made_by["packages"].items():
            page = f"https://pypi.org/project/{name}/{one}/"
            needed.append(self._software(page, name, one, url=page))
        needed.append(self._software(f"{home}#{python}", "Python", python, url=home))
        identity = json.dumps([version, commit, python, made_by["packages"]], sort_keys=True)
        return self._software(
            f"#{PROJECT}-{hashlib.sha256(identity.encode()).hexdigest()[:8]}",
            PROJECT,
            f"{version}, commit {commit}" if commit else version,
            description="Cases, decks, runs and analyses of wet granular walkers.",
            softwareRequirements=needed,
        )

    def _software(self, identifier: str, name: str, version: str, /, **more: Any) -> Entity:
        return self.entity(identifier, "SoftwareApplication", name=name, softwareVersion=version, **more)
