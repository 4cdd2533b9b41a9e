"""Write an archive: one zip file with the files of a run or a sweep, checksums and descriptions."""

from __future__ import annotations

import hashlib
import io
import re
import shutil
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from fnmatch import fnmatch
from importlib import resources
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from walkers.archive.crate import METADATA_NAME, PAPER, Author, describe_crate
from walkers.archive.verification import SUMS_NAME
from walkers.errors import refused
from walkers.extras import require
from walkers.files import beside, checksum, json_bytes, open_regular
from walkers.inputs.toml import toml_bytes
from walkers.postprocess.measure.uncertainty import ACCURACY, ACCURACY_NAME, SPREAD, SPREAD_NAME
from walkers.runner.compiled_model import build_script
from walkers.runner.directory import CASE_NAME, case_of, name_of
from walkers.runner.manifest import MANIFEST_NAME, FileChanged, read_manifest
from walkers.runner.model_sources import model_sources, model_version
from walkers.sweeps.record import RECORD_NAME, SweepRecord, read_record, states
from walkers.text import printable, rendered

RUNS = "runs"
"""Folder of the run directories in an archive: the default folder of the program."""
MODEL_FOLDER = "contact_model"
"""Folder of the sources of the contact model in an archive."""
REPEAT_NAME = "repeat.sh"
"""Script of an archive that repeats a run with the engine alone."""
_ROLES: Mapping[str, Sequence[str]] = {
    "case": (CASE_NAME, "*.toml"),
    "record": (MANIFEST_NAME, RECORD_NAME),
    "dump": ("beads.bin", "bridges.*.txt", "state.restart"),
    "deck": ("walker.lig", "layout.json", "deck.json", "law.py", "run.sh", "scale.awk", "*.txt"),
    "table": ("table.csv", "*.parquet"),
    "result": ("result.json", ACCURACY_NAME, SPREAD_NAME),
    "engine": ("*.cpp", "*.h", "*.map", "COPYING", "build.sh", REPEAT_NAME),
}
"""Roles of files in the actions of the crate, by their names; the first that fits. Others are output of the engine."""


class File(NamedTuple):
    """A file of an archive: source or contents, SHA-256, and role in the actions of the crate."""

    source: Path | bytes
    sha256: str
    role: str

    @classmethod
    def of(cls, place: str, source: Path | bytes, sha256: str | None = None) -> File:
        """A file, whose checksum is computed if no manifest has it."""
        if sha256 is None:
            sha256 = hashlib.sha256(source).hexdigest() if isinstance(source, bytes) else checksum(source)
        name = Path(place).name
        roles = (role for role, names in _ROLES.items() if any(fnmatch(name, pattern) for pattern in names))
        return cls(source, sha256, next(roles, "output"))

    def open(self) -> BinaryIO:
        """The contents, to be read."""
        return io.BytesIO(self.source) if isinstance(self.source, bytes) else open_regular(self.source)


@dataclass(frozen=True)
class Contents:
    """Contents of an archive.

    Attributes
    ----------
    name, title
        Of the run or the sweep.
    manifests
        Manifests of all runs by the places of their folders in the archive.
    files
        Files by their places in the archive.
    main
        Places of the runs that the archive is about: not those of spreads and accuracies.
    """

    name: str
    title: str
    manifests: Mapping[str, dict[str, Any]]
    files: Mapping[str, File]
    main: Sequence[str]

    @property
    def finished(self) -> str:
        """End of the last run, ISO 8601."""
        return max(str(manifest["finished"]) for manifest in self.manifests.values())

    @property
    def companions(self) -> bool:
        """Whether there are runs of spreads or accuracies."""
        return len(self.manifests) > len(self.main)

    @property
    def left_out(self) -> bool:
        """Whether dumps of the runs that the archive is about are left out."""
        return any("left_out" in self.manifests[place] for place in self.main)


def write_archive(
    directory: str | Path,
    to: Path | None = None,
    *,
    dumps: bool = True,
    authors: Sequence[Author] = (),
    licence: str = "CC-BY-4.0",
) -> Path:
    """Pack a finished run, or a sweep whose runs are all finished, into an RO-Crate; an older file is replaced.

    The ``licence`` is an SPDX identifier. Without ``dumps``, tables and results are included all the same. `InputError`
    if something is unusable or unfinished; `FileChanged` if a file differs from its manifest.
    """
    require("archive")
    _check(authors, licence)
    contents = contents_of(Path(directory), dumps=dumps)
    to = Path(f"{contents.name}.zip") if to is None else to
    if to.suffix != ".zip" or to.is_dir():
        raise refused("to", f"expected the name of a .zip file, not {to}")
    described = {
        METADATA_NAME: json_bytes(describe_crate(contents, authors, licence)),
        "README.md": _readme(contents, authors, licence).encode(),
    }
    files = {**{place: File.of(place, text) for place, text in described.items()}, **contents.files}
    sums = "".join(f"{file.sha256}  {place}\n" for place, file in files.items()).encode()
    date = datetime.fromisoformat(contents.finished).timetuple()[:6]  # of all files, for the same bytes again
    with beside(to) as new, zipfile.ZipFile(new, "w") as archive:
        for place in contents.manifests:
            folder = zipfile.ZipInfo(f"{place}/", date)
            folder.external_attr = 0o40755 << 16 | 0x10
            archive.writestr(folder, b"")
        for place, file in {SUMS_NAME: File.of(SUMS_NAME, sums), **files}.items():
            _write(archive, zipfile.ZipInfo(place, date), file)
    return to


def _readme(contents: Contents, authors: Sequence[Author], licence: str) -> str:
    """Description of an archive for readers, in Markdown."""
    example = contents.main[0]
    deck_folder = "segments/0000"
    if any(place.startswith(f"{example}/shared_deck/") for place in contents.files):
        deck_folder = "shared_deck"
    elif f"{example}/walker.lig" in contents.files:  # a deck that was run by hand
        deck_folder = "."
    return rendered(
        "walkers.archive",
        "README.md.j2",
        contents=contents,
        by=printable(", ".join(author.name for author in authors)),
        licence=licence,
        paper=PAPER,
        sums=SUMS_NAME,
        left_out=contents.left_out,
        companions=contents.companions,
        example=example,
        deck_folder=deck_folder,
        up="" if deck_folder == "." else "../" * len(Path(deck_folder).parts),
        model_folder=MODEL_FOLDER,
        model_sentence=_model_sentence(contents.manifests.values()),
        repeat=REPEAT_NAME,
    )


def _model_sentence(manifests: Iterable[Mapping[str, Any]]) -> str:
    """Whether the sources of the contact model in the archive are those with which the runs were made."""
    present = model_version()
    models = [manifest["contact_model"] for manifest in manifests if manifest.get("contact_model")]
    if all(model.get("sources") == present["sources"] for model in models):
        return "The runs were made with these sources."
    versions = {model.get("forces_version") for model in models}
    if versions == {present["forces_version"]}:
        return "Some runs were made with other sources that compute the same forces."
    return (
        "Some runs were made with another version of the contact model, or do not record it: their manifests name "
        "the version of granular-walkers. Such runs may give other dumps with these sources."
    )


def _check(authors: Sequence[Author], licence: str) -> None:
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9.+-]*", licence):
        raise refused("licence", f"expected an SPDX identifier such as CC-BY-4.0, not {licence}")
    for author in authors:
        if not author.name.strip():
            raise refused("author", "expected a name")
        if author.orcid is not None and not re.fullmatch(r"\d{4}-\d{4}-\d{4}-\d{3}[\dX]", author.orcid):
            raise refused("orcid", f"expected an ORCID such as 0000-0002-1825-0097, found {author.orcid}")


def _write(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, file: File) -> None:
    """Write a file, and compare the written bytes with its checksum."""
    entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o100644 << 16
    with file.open() as source, archive.open(entry, "w", force_zip64=True) as copy:
        shutil.copyfileobj(source, copy)
    with archive.open(entry) as written:
        if hashlib.file_digest(written, "sha256").hexdigest() != file.sha256:  # type: ignore[arg-type]
            raise FileChanged(
                f"{entry.filename} has changed since the run was finished: walkers check files lists all changes"
            )


def contents_of(directory: Path, *, dumps: bool = True) -> Contents:
    """Contents of the archive of a finished run or a sweep.

    Parameters
    ----------
    directory
        The run directory or the directory of the sweep.
    dumps
        Whether to include the dumps of the engine.

    Returns
    -------
    Contents
        The files of the run or of the sweep and its runs, of the spreads and accuracies of these runs, and what is
        needed to repeat them with the engine alone.

    Raises
    ------
    InputError
        If points of the sweep are not finished, or the record of a sweep cannot be read.
    """
    packing = _Packing(dumps)
    if (directory / RECORD_NAME).is_file():
        record = read_record(directory)
        points = states(record)
        unfinished = sum(state.status != "finished" for state in points)
        if unfinished:
            message = f"{unfinished} of {len(points)} points are not finished; see: walkers list {directory}"
            raise refused(directory, message)
        name, title = name_of(record.directory.name), record.sweep.title
        main = packing.add_sweep(record, name)
    else:
        title = case_of(directory).title
        main = [packing.add_run(directory)]
        name = Path(main[0]).name
    for place in main:
        packing.add_companions(packing.directories[place])
    packing.add_engine()
    return Contents(name, title, packing.manifests, packing.files, main)


class _Packing:
    """Files and manifests of an archive, which are collected."""

    def __init__(self, dumps: bool) -> None:
        self.dumps = dumps
        self.files: dict[str, File] = {}
        self.manifests: dict[str, dict[str, Any]] = {}
        self.directories: dict[str, Path] = {}
        """Directories of the runs by their places in the archive."""

    def add(self, place: str, source: Path | bytes, sha256: str | None = None) -> None:
        """Add a file; without its checksum, this is computed."""
        self.files[place] = File.of(place, source, sha256)

    def add_run(self, directory: Path) -> str:
        """Add the files of a run's manifest, and its case file if that is known; return the place of the run."""
        directory = directory.resolve()
        place = f"{RUNS}/{directory.name}"
        if place in self.manifests:
            return place
        manifest, case = read_manifest(directory), case_of(directory)
        before = set(manifest.get("left_out", ()))
        left_out = set(before)
        for name in manifest["files"]:
            if name in before:
                continue
            file = File.of(name, directory / name, manifest["sha256"].get(name))
            if file.role == "dump" and not self.dumps:
                left_out.add(name)
            else:
                self.files[f"{place}/{name}"] = file
        if case.document:
            self.add(f"{place}/{name_of(case.name)}.toml", toml_bytes(case.document))
        source: Path | bytes = directory / MANIFEST_NAME
        if left_out != before:
            manifest["left_out"] = sorted(left_out)
            source = json_bytes(manifest)
        self.add(f"{place}/{MANIFEST_NAME}", source)
        self.manifests[place] = manifest
        self.directories[place] = directory
        return place

    def add_sweep(self, record: SweepRecord, name: str) -> list[str]:
        """Add a sweep, its table and its finished runs; return the places of the runs."""
        from walkers.sweeps.table import encoded, load

        place, table = f"{RUNS}/{name}", load(record.directory)
        # Places in the archive, not paths on this machine.
        table["run"] = [f"{RUNS}/{Path(run).name}" if run else "" for run in table["run"]]
        self.add(f"{place}/{RECORD_NAME}", record.directory / RECORD_NAME)
        for form in ("csv", "parquet"):
            self.add(f"{place}/table.{form}", encoded(table, form))
        self.add(f"{place}/{name}.toml", toml_bytes(record.sweep.file))
        finished = [state for state in states(record) if state.status == "finished"]
        places = [self.add_run(state.directory) for state in finished if state.directory]
        return list(dict.fromkeys(places))

    def add_companions(self, run: Path) -> None:
        """Add the spread and the accuracy of a run, which are sweeps beside it, if it has any.

        One that was interrupted is added as far as it is; it can be continued from the archive.
        """
        for suffix in (SPREAD, ACCURACY):
            directory = run.with_name(f"{run.name}{suffix}")
            if not (directory / RECORD_NAME).is_file():
                continue
            self.add_sweep(read_record(directory), directory.name)
            bands = directory / SPREAD_NAME
            if bands.is_file():
                self.add(f"{RUNS}/{directory.name}/{SPREAD_NAME}", bands)

    def add_engine(self) -> None:
        """Add what repeats the runs without this program: the contact model, and a script."""
        for source in model_sources():
            self.add(f"{MODEL_FOLDER}/{source.name}", source.read_bytes())
        self.add(f"{MODEL_FOLDER}/build.sh", build_script().encode())
        script = resources.files("walkers.archive").joinpath(REPEAT_NAME)
        self.add(REPEAT_NAME, script.read_bytes())
