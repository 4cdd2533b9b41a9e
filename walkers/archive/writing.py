"""Write an archive: one zip file with the files of a run or a sweep, checksums and descriptions."""

from __future__ import annotations

import hashlib
import io
import re
import time
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from walkers.archive.crate import METADATA_NAME, PAPER, README_NAME, Author, describe_crate
from walkers.archive.verification import SUMS_NAME, verify
from walkers.errors import InputError, Problem, WalkersError, refused
from walkers.extras import require
from walkers.runner.directory import CASE_NAME, case_of, name_of
from walkers.runner.files import beside, checksum, json_bytes
from walkers.runner.manifest import MANIFEST_NAME, read_manifest
from walkers.runner.provenance import PROJECT
from walkers.sweeps.table import RECORD_NAME, read_record, states
from walkers.text import printable, rendered

_STORED = ("/", ".parquet", ".png", ".mp4")
"""Suffixes of names that are not compressed again, and of folders."""
_CHUNK_BYTES = 1 << 20
_MOMENT = "%Y-%m-%dT%H:%M:%SZ"
RUNS = "runs"
"""Folder of the run directories in an archive: the default folder of the program."""
_MEANINGS = {
    CASE_NAME: ("case", "the resolved case: every number that determines the run, SI units"),
    MANIFEST_NAME: ("record", "provenance: versions, machine, times, and checksums of all files"),
    RECORD_NAME: ("record", "the points of the sweep: varied keys, derived quantities, names of the runs"),
    "result.json": ("result", "the result of the run, SI units"),
    "accuracy.json": ("result", "numerical errors of the run: of its time step and of its softened beads, SI units"),
    "walker.lig": ("deck", "the deck: input script of the engine"),
    "law.py": ("deck", "the file of the user's bridge law"),
    "bridges.txt": ("deck", "forces of each bridge against its gap, which the engine reads"),
    "loads.txt": ("deck", "gravity and drive of each bead, if they differ between beads"),
    "run.sh": ("deck", "script that runs the deck by hand"),
    "scale.awk": ("deck", "script that scales the forces of bridges if the deck is edited"),
    "deck.json": ("deck", "the case and the deck as they were written, before they were run by hand"),
    "layout.json": ("deck", "columns of the dumps; which bead belongs to which walker"),
    "engine.log": ("output", "the log of the engine"),
    "segment.json": ("output", "first and last step of the segment, and its cost"),
    "beads.bin": ("dump", "positions, velocities and spins of the beads, LIGGGHTS binary dump; columns in layout.json"),
    "bridges.pairs.txt": ("dump", "bridges between beads, frame by frame, text"),
    "bridges.walls.txt": ("dump", "bridges between beads and walls, frame by frame, text"),
    "state.restart": ("dump", "restart file of the engine, from which the next segment continues"),
    "table.csv": ("table", "the table of the sweep, one row per point, units in the header"),
    README_NAME: ("", "description for readers"),
}
_OF_SUFFIX = {
    ".parquet": ("table", "a table; units and meanings of its columns are in the field metadata"),
    ".toml": ("case", "the file of the case, including changes by --set, or of the sweep"),
}
_REST = ("output", "other output of the engine")


class ArchiveRefused(WalkersError):
    """A run whose files have changed since it was finished."""


@dataclass(frozen=True)
class File:
    """A file of an archive: source or contents, SHA-256, role (in the actions of the crate) and meaning."""

    source: Path | bytes
    sha256: str
    role: str
    meaning: str

    @classmethod
    def of(cls, place: str, source: Path | bytes, sha256: str | None = None) -> File:
        """A file, whose checksum is computed if no manifest has it."""
        if sha256 is None:
            sha256 = hashlib.sha256(source).hexdigest() if isinstance(source, bytes) else checksum(source)
        path = Path(place)
        return cls(source, sha256, *_MEANINGS.get(path.name, _OF_SUFFIX.get(path.suffix, _REST)))

    @property
    def size(self) -> int:
        """Size in bytes."""
        return len(self.source) if isinstance(self.source, bytes) else self.source.stat().st_size


@dataclass(frozen=True)
class Contents:
    """Contents of an archive: name, title, manifests of the runs by their folders, and files by their places."""

    name: str
    title: str
    manifests: Mapping[str, dict[str, Any]]
    files: Mapping[str, File]

    @property
    def finished(self) -> str:
        """End of the last run, ISO 8601."""
        return max(str(manifest["finished"]) for manifest in self.manifests.values())

    def describe(self) -> str:
        """The contents in a sentence."""
        runs = "A run" if len(self.manifests) == 1 else f"{len(self.manifests)} runs"
        left_out = any("left_out" in manifest for manifest in self.manifests.values())
        return (
            f"{runs} of wet granular walkers, simulated by the discrete element method with LIGGGHTS through {PROJECT}"
            ": cases, decks, output of the engine, and the tables and results computed from it."
            f"{' The dumps, from which the tables were computed, are left out.' if left_out else ''}"
        )


def write_archive(
    directory: str | Path,
    to: Path | None = None,
    *,
    dumps: bool = True,
    authors: Sequence[Author] = (),
    licence: str = "CC-BY-4.0",
) -> Path:
    """Pack a finished run, or a sweep whose runs are all finished, into an RO-Crate.

    Parameters
    ----------
    to
        Default: ``NAME.zip`` in the current directory. An older file is replaced.
    dumps
        Include the dumps of the engine; tables and results are always included.
    licence
        An SPDX identifier.

    Raises
    ------
    InputError
        If the directory is no run or sweep, is not finished, or an option is invalid.
    ArchiveRefused
        If a file differs from its manifest.
    """
    require("archive")
    _check(authors, licence)
    directory = Path(directory)
    changed = [part.describe() for part in verify(directory) if not (part.of_points or part.passed)]
    if changed:  # `contents_of` asks for all points
        raise ArchiveRefused(f"{directory} is not archived, files have changed:\n" + "\n".join(changed))
    contents = contents_of(directory, dumps=dumps)
    to = Path(f"{contents.name}.zip") if to is None else to
    if to.suffix != ".zip" or to.is_dir():
        raise refused("to", f"expected the name of a .zip file, not {to}")
    about = {
        METADATA_NAME: json_bytes(describe_crate(contents, authors, licence)),
        README_NAME: rendered(
            "walkers.archive",
            "README.md.j2",
            contents=contents,
            by=printable(", ".join(author.name for author in authors)),
            licence=licence,
            paper=PAPER,
            sums=SUMS_NAME,
        ).encode(),
    }
    listed = {**{place: File.of(place, text) for place, text in about.items()}, **contents.files}
    sums = "".join(f"{file.sha256}  {place}\n" for place, file in listed.items())
    moment = time.strptime(contents.finished, _MOMENT)[:6]  # of all files, for the same bytes again
    with beside(to) as new, zipfile.ZipFile(new, "w") as archive:
        for place in dict.fromkeys(f"{folder}/" for name in listed for folder in reversed(Path(name).parents[:-1])):
            archive.writestr(_info(place, moment), b"")
        archive.writestr(_info(SUMS_NAME, moment), sums)
        for place, file in listed.items():
            _write(archive, place, file, moment)
    return to


def _check(authors: Sequence[Author], licence: str) -> None:
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9.+-]*", licence):
        raise refused("licence", f"expected an SPDX identifier such as CC-BY-4.0, not {licence}")
    for author in authors:
        if not author.name.strip():
            raise refused("author", "expected a name")
        if author.orcid is not None and not re.fullmatch(r"\d{4}-\d{4}-\d{4}-\d{3}[\dX]", author.orcid):
            raise refused("orcid", f"expected an ORCID such as 0000-0002-1825-0097, found {author.orcid}")


def _info(place: str, moment: tuple[int, ...]) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(place, moment)  # type: ignore[arg-type]
    info.compress_type = zipfile.ZIP_STORED if place.endswith(_STORED) else zipfile.ZIP_DEFLATED
    info.create_system = 3
    info.external_attr = (0o40755 << 16 | 0x10) if place.endswith("/") else 0o100644 << 16
    return info


def _write(archive: zipfile.ZipFile, place: str, file: File, moment: tuple[int, ...]) -> None:
    """Write a file, and check its checksum again."""
    digest = hashlib.sha256()
    source = io.BytesIO(file.source) if isinstance(file.source, bytes) else file.source.open("rb")
    with source, archive.open(_info(place, moment), "w", force_zip64=file.size >= zipfile.ZIP64_LIMIT) as copy:
        while chunk := source.read(_CHUNK_BYTES):
            digest.update(chunk)
            copy.write(chunk)
    if digest.hexdigest() != file.sha256:
        raise ArchiveRefused(f"{place} changed while it was archived")


def contents_of(directory: Path, *, dumps: bool = True) -> Contents:
    """Contents of the archive of a finished run or a sweep; without the engine's dumps if ``dumps`` is false.

    `InputError` if points of a sweep are not finished.
    """
    from walkers.sweeps.table import encoded, load

    if not (directory / RECORD_NAME).is_file():
        place, manifest, files = _packed(directory, dumps)
        return Contents(Path(place).name, case_of(directory).title, {place: manifest}, files)
    record = read_record(directory)
    points = states(record)
    unfinished = sum(state.status not in ("finished", "not needed") for state in points)
    if unfinished:
        message = f"{unfinished} of {len(points)} points are not finished; see: walkers list {directory}"
        raise refused(directory, message)
    name = name_of(record.directory.name)
    place, table = f"{RUNS}/{name}", load(record.directory)
    table["run"] = [f"{RUNS}/{Path(run).name}" if run else "" for run in table["run"]]  # not where this machine has it
    sources: dict[str, Path | bytes] = {f"{place}/{RECORD_NAME}": record.directory / RECORD_NAME}
    sources |= {f"{place}/table.{form}": encoded(table, form) for form in ("csv", "parquet")}
    sources |= {f"{place}/{name}.toml": _toml(record.file)} if record.file else {}
    files, manifests = {path: File.of(path, source) for path, source in sources.items()}, {}
    for run in dict.fromkeys(state.directory for state in points if state.directory is not None):
        place, manifests[place], of_run = _packed(run, dumps)
        files |= of_run
    return Contents(name, record.title, manifests, files)


def _packed(directory: Path, dumps: bool) -> tuple[str, dict[str, Any], dict[str, File]]:
    """Place and manifest of a run, and its files by place: those of the manifest, and its case file, if it is known."""
    manifest = read_manifest(directory)
    for key in ("started", "finished"):
        try:
            time.strptime(manifest[key], _MOMENT)
        except (ValueError, TypeError) as error:
            text = "expected a time such as 2026-01-31T12:00:00Z"
            raise InputError(str(directory / MANIFEST_NAME), [Problem(key, f'"{manifest[key]}"', text)]) from error
    case, place = case_of(directory), f"{RUNS}/{directory.resolve().name}"
    before = set(manifest.get("left_out", ()))
    listed = {name: File.of(name, directory / name, manifest["sha256"].get(name)) for name in manifest["files"]}
    left_out = {name for name, file in listed.items() if name in before or (file.role == "dump" and not dumps)}
    record: Path | bytes = directory / MANIFEST_NAME
    if left_out - before:
        manifest["left_out"] = sorted(left_out)
        record = json_bytes(manifest)
    written: dict[str, Path | bytes] = {f"{name_of(case.name)}.toml": _toml(case.document)} if case.document else {}
    files = {name: File.of(name, source) for name, source in (written | {MANIFEST_NAME: record}).items()}
    files |= {name: file for name, file in listed.items() if name not in left_out}
    return place, manifest, {f"{place}/{name}": file for name, file in files.items()}


def _toml(tables: Any) -> bytes:
    import tomli_w

    return tomli_w.dumps(tables).encode("utf-8")
