"""The description of an archive: an RO-Crate (researchobject.org) by the Process Run Crate profile, with rocrate.

Each run is an action of the engine, from case and deck to the dumps; one action of this program makes the tables.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from urllib.parse import quote

from walkers.runner.provenance import PROJECT

if TYPE_CHECKING:
    from rocrate.model.entity import Entity

    from walkers.archive.writing import Contents, File

METADATA_NAME = "ro-crate-metadata.json"
README_NAME = "README.md"
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
_MEDIA = {
    ".json": "application/json",
    ".toml": "application/toml",
    ".parquet": "application/vnd.apache.parquet",
    ".csv": "text/csv",
    ".md": "text/markdown",
    **dict.fromkeys((".lig", ".txt", ".log"), "text/plain"),
}


class Author(NamedTuple):
    """Author of the runs: name, and ORCID (``0000-0002-1825-0097``) or None."""

    name: str
    orcid: str | None = None


def describe_crate(contents: Contents, authors: Sequence[Author], licence: str) -> dict[str, Any]:
    """The metadata of an archive, JSON-LD; the licence is an SPDX identifier, the date is the end of the last run."""
    described = _Crate(contents, authors)
    root, profile = described.crate.root_dataset, {"name": "Process Run Crate", "version": PROFILE.rpartition("/")[2]}
    about = {"name": licence, "description": f"The licence {licence} of the SPDX list", "identifier": licence}
    root["name"] = f"{contents.name}: {contents.title}".rstrip(": ")
    root["description"] = contents.describe()
    root["datePublished"] = _moment(contents.finished)
    root["license"] = described.entity(f"https://spdx.org/licenses/{licence}", "CreativeWork", **about)
    root["conformsTo"] = described.entity(PROFILE, "CreativeWork", **profile)
    root["citation"] = described.entity(PAPER, "ScholarlyArticle", **_PAPER_PROPERTIES)
    root["mentions"] = [*(described.simulation(place) for place in contents.manifests), described.analysis()]
    if described.people:
        root["author"] = list(described.people)
    metadata: dict[str, Any] = described.crate.metadata.generate()
    for entity in metadata["@graph"]:  # by the specification, lists have more than one item
        entity.update({key: value[0] for key, value in entity.items() if isinstance(value, list) and len(value) == 1})
    return metadata


class _Crate:
    """A crate under construction, with files and people, to which other entities refer."""

    def __init__(self, contents: Contents, authors: Sequence[Author]) -> None:
        from rocrate.rocrate import ROCrate

        self.contents, self.crate = contents, ROCrate(version=VERSION)
        self.crate.metadata.extra_terms["sha256"] = "http://schema.org/sha256"  # not in the context of that version
        identifiers = [f"https://orcid.org/{orcid}" if orcid else f"#{quote(name)}" for name, orcid in authors]
        self.people = [
            self.entity(identifier, "Person", name=author.name)
            for identifier, author in zip(identifiers, authors, strict=True)
        ]
        self.files = {place: self.file(place, file) for place, file in contents.files.items()}

    def entity(self, identifier: str, kind: str, /, **properties: Any) -> Entity:
        """A contextual entity, added once."""
        from rocrate.model.contextentity import ContextEntity

        added = ContextEntity(self.crate, identifier, properties={"@type": kind, **properties})
        return self.crate.get(identifier) or self.crate.add(added)

    def file(self, place: str, file: File) -> Entity:
        """A file of the archive, a table with its columns; without a source, because rocrate only describes it."""
        properties: dict[str, Any] = {
            "name": Path(place).name,
            "description": file.meaning,
            "encodingFormat": _MEDIA.get(Path(place).suffix, "application/octet-stream"),
            "contentSize": str(file.size),
            "sha256": file.sha256,
        }
        if place.endswith(".parquet"):
            columns = _columns(Path(place).stem, file)
            described = [self.entity(f"#{quote(column['name'])}", "PropertyValue", **column) for column in columns]
            properties["variableMeasured"] = described
        return self.crate.add_file(None, place, properties=properties)

    def with_role(self, *roles: str, folder: str = "") -> list[Entity]:
        """The files below a folder that have one of the roles."""
        files = self.contents.files
        return [self.files[place] for place in files if files[place].role in roles and place.startswith(folder)]

    def simulation(self, place: str) -> Entity:
        """The action of the engine in the folder of a run."""
        manifest, name, folder = self.contents.manifests[place], Path(place).name, f"{place}/"
        text = f"Run directory of the case {manifest['name']}, finished {manifest['finished']}"
        run = self.crate.add_dataset(None, folder, properties={"name": name, "description": text})
        run["hasPart"] = [file for path, file in self.files.items() if path.startswith(folder)]
        engine, others = manifest["engine"], int(manifest.get("shared_deck", {}).get("runs", 1)) - 1
        text = "Discrete element method. The SHA-256 combines those of the executable and libliggghts."
        more = {"url": ENGINE_HOME, "sha256": engine["sha256"], "description": text}
        binary = self.software(f"{ENGINE_HOME}#{engine['sha256'][:12]}", "LIGGGHTS", engine["version"], **more)
        text = f"The engine runs the deck{f', together with {others} other cases' if others else ''}."
        read, written = self.with_role("case", "deck", folder=folder), self.with_role("dump", "output", folder=folder)
        action = self.action(f"Simulation of {name}", text, binary, read, written, manifest["finished"])
        action["startTime"] = _moment(manifest["started"])
        return action

    def analysis(self) -> Entity:
        """The action of this program, which makes the tables of all runs."""
        manifests = [manifest.get("tabulated", manifest) for manifest in self.contents.manifests.values()]
        ends = [str(manifest.get("date", manifest.get("finished"))) for manifest in manifests]
        program = self.program(manifests[ends.index(max(ends))])
        read, written = self.with_role("case", "dump", "record"), self.with_role("table", "result")
        name, text = f"Tables of {self.contents.name}", "Analysis of the dumps: tables and results."
        return self.action(name, text, program, read, written, max(ends))

    def action(
        self, name: str, text: str, instrument: Entity, read: list[Entity], written: list[Entity], ended: str
    ) -> Entity:
        """Input and output files of a program."""
        action = self.entity(f"#{quote(name)}", "CreateAction", name=name, description=text, instrument=instrument)
        action["object"], action["result"], action["endTime"] = read, written, _moment(ended)
        action["actionStatus"] = "http://schema.org/CompletedActionStatus"
        if self.people:
            action["agent"] = list(self.people)
        return action

    def program(self, manifest: Mapping[str, Any]) -> Entity:
        """The program with Python and the packages, as listed in a manifest."""
        python, home = manifest["python"], "https://www.python.org/"
        pages = {name: f"https://pypi.org/project/{name}/{version}/" for name, version in manifest["packages"].items()}
        needed = [self.software(page, name, manifest["packages"][name], url=page) for name, page in pages.items()]
        needed.append(self.software(f"{home}#{python}", "Python", python, url=home))
        version = ", commit ".join(filter(None, (manifest["granular_walkers"], manifest["commit"])))
        text = "Cases, decks, runs and analyses of wet granular walkers."
        return self.software(f"#{PROJECT}", PROJECT, version, description=text, softwareRequirements=needed)

    def software(self, identifier: str, name: str, version: str, /, **more: Any) -> Entity:
        return self.entity(identifier, "SoftwareApplication", name=name, softwareVersion=version, **more)


def _moment(iso: str) -> str:
    return iso.removesuffix("Z") + "+00:00"


def _columns(table: str, file: File) -> list[dict[str, str]]:
    """Name, meaning and unit of each column of a table."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = []
    for field in pq.read_schema(pa.BufferReader(file.source) if isinstance(file.source, bytes) else file.source):
        metadata = {key.decode(): value.decode() for key, value in (field.metadata or {}).items()}
        column = {"name": f"{table}.{field.name}", "description": metadata.get("meaning", "")}
        columns.append(column | ({"unitText": metadata["unit"]} if metadata.get("unit") else {}))
    return columns
