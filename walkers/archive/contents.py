"""Contents of an archive: files of a run or a sweep, and what repeats it.

The zip file is written in `walkers.archive.writing`.
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from importlib import resources
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from walkers.errors import input_error
from walkers.files import checksum, json_bytes, open_regular
from walkers.inputs.tables.case import Case
from walkers.inputs.toml import toml_bytes
from walkers.postprocess.measure.uncertainty import ACCURACY, SPREAD, SPREAD_NAME
from walkers.runner.compiled_model import build_script
from walkers.runner.manifest import MANIFEST_NAME, read_manifest
from walkers.runner.model_sources import model_sources
from walkers.runner.run_directory import SEGMENTS, case_of, name_of
from walkers.runs.making import DECK_FOLDER
from walkers.sweeps.record import RECORD_NAME, SweepRecord, read_sweep_record, states
from walkers.sweeps.table import encoded, load_table
from walkers.templates.deck import BRIDGES_NAME, DECK_NAME

RECORD_FILE = "archive.json"
"""Description of an archive for programs: its authors, and the software that made each run."""
README_FILE = "README.md"
"""Description of an archive for readers."""
SUMS_NAME = "sha256sums.txt"
"""List of checksums in an archive, in the format of ``sha256sum -c``."""
RUNS_FOLDER = "runs"
"""Folder of the run directories in an archive: the default folder of the program."""
MODEL_FOLDER = "contact_model"
"""Folder of the sources of the contact model in an archive."""
REPEAT_NAME = "repeat.sh"
"""Script of an archive that repeats a run with the engine alone."""
_DUMPS = ("beads.bin", "bridges.*.txt", "state.restart")
"""Names of the dumps of the engine. ``bridges.txt`` is none: it has the tables of forces, which a
deck needs."""


class ArchiveFile(NamedTuple):
    """A file of an archive.

    Attributes
    ----------
    source
        The file on this machine, or its contents.
    sha256
        Its SHA-256 in hexadecimal digits.
    """

    source: Path | bytes
    sha256: str

    @classmethod
    def of(cls, source: Path | bytes) -> ArchiveFile:
        """A file, or contents, whose checksum is computed because no manifest has it."""
        if isinstance(source, bytes):
            return cls(source, hashlib.sha256(source).hexdigest())
        return cls(source, checksum(source))

    def open(self) -> BinaryIO:
        """Open the contents for reading."""
        if isinstance(self.source, bytes):
            return io.BytesIO(self.source)
        return open_regular(self.source)


@dataclass(frozen=True)
class Contents:
    """Contents of an archive.

    Attributes
    ----------
    name, title
        Name and title of the run or the sweep.
    manifests
        Manifests of all runs, by the paths of their folders in the archive.
    cases
        Cases of all runs, by the paths of their folders in the archive.
    files
        Files, by their paths in the archive.
    main
        Folders of the runs that the archive is about, without those of spreads and accuracies.
    """

    name: str
    title: str
    manifests: Mapping[str, dict[str, Any]]
    cases: Mapping[str, Case]
    files: Mapping[str, ArchiveFile]
    main: Sequence[str]

    @property
    def finished(self) -> str:
        """Time when the last run was finished, ISO 8601."""
        return max(str(manifest["finished"]) for manifest in self.manifests.values())

    @property
    def companions(self) -> bool:
        """Whether the archive has runs of spreads or accuracies too."""
        return len(self.manifests) > len(self.main)

    @property
    def left_out(self) -> bool:
        """Whether dumps of the runs that the archive is about are left out."""
        return any("left_out" in self.manifests[run] for run in self.main)

    def deck_folder(self, run: str) -> str:
        """Folder of the first deck of a run, relative to the folder of the run.

        It is ``.`` for a deck that was run by hand. ``run`` is the folder of the run in the
        archive.
        """
        for folder in (DECK_FOLDER, f"{SEGMENTS}/0000"):
            if f"{run}/{folder}/{DECK_NAME}" in self.files:
                return folder
        return "."

    def has_tables(self, run: str) -> bool:
        """Whether a run has the tables of forces, without which its deck cannot be run."""
        table = Path(run) / self.deck_folder(run) / BRIDGES_NAME
        return table.as_posix() in self.files


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
        The files of the run, or of the sweep and its runs; those of the spreads and accuracies of
        these runs; and what is needed to repeat them with the engine alone.

    Raises
    ------
    InputError
        If points of the sweep are not finished, or the record of a sweep cannot be read.
    """
    packing = _Packing(dumps)
    if (directory / RECORD_NAME).is_file():
        record = read_sweep_record(directory)
        points = states(record)
        unfinished = sum(state.status != "finished" for state in points)
        if unfinished:
            raise input_error(
                directory,
                f"{unfinished} of {len(points)} points are not finished; "
                f"see: walkers list {directory}",
            )
        name = name_of(record.directory.name)
        title = record.sweep.title
        main = packing.add_sweep(record, name)
    else:
        main = [packing.add_run(directory)]
        title = packing.cases[main[0]].title
        name = Path(main[0]).name
    for run in main:
        packing.add_companions(packing.directories[run])
    packing.add_engine()
    return Contents(
        name=name,
        title=title,
        manifests=packing.manifests,
        cases=packing.cases,
        files=packing.files,
        main=main,
    )


class _Packing:
    """Collects the files and manifests of an archive. A ``place`` is a path in the archive.

    Attributes
    ----------
    dumps
        Whether the archive includes the dumps of the engine.
    files
        Files by their places.
    manifests, cases, directories
        Manifests, cases and directories of the runs, by the places of their folders.
    """

    def __init__(self, dumps: bool) -> None:
        self.dumps = dumps
        self.files: dict[str, ArchiveFile] = {}
        self.manifests: dict[str, dict[str, Any]] = {}
        self.cases: dict[str, Case] = {}
        self.directories: dict[str, Path] = {}

    def add(self, place: str, source: Path | bytes) -> None:
        """Add a file that no manifest lists."""
        self.files[place] = ArchiveFile.of(source)

    def add_run(self, directory: Path, folder: str = RUNS_FOLDER) -> str:
        """Add the files of a run's manifest, and its case file if that is known.

        Parameters
        ----------
        directory
            The run directory.
        folder
            The folder in the archive that contains that of the run.

        Returns
        -------
        str
            The folder of the run in the archive.
        """
        directory = directory.resolve()
        place = f"{folder}/{directory.name}"
        if place in self.manifests:
            return place
        manifest = read_manifest(directory)
        case = case_of(directory)
        self._add_listed_files(directory, place, manifest)
        if case.document:
            self.add(f"{place}/{name_of(case.name)}.toml", toml_bytes(case.document))
        self._add_manifest(directory, place, manifest)
        self.manifests[place] = manifest
        self.cases[place] = case
        self.directories[place] = directory
        return place

    def _add_listed_files(self, directory: Path, place: str, manifest: dict[str, Any]) -> None:
        """Add the files that a manifest lists and that are in the archive."""
        sums = manifest["sha256"]
        left_out = self._left_out(manifest)
        for name in manifest["files"]:
            if name in left_out:
                continue
            source = directory / name
            if name in sums:
                self.files[f"{place}/{name}"] = ArchiveFile(source, sums[name])
            else:
                self.add(f"{place}/{name}", source)

    def _add_manifest(self, directory: Path, place: str, manifest: dict[str, Any]) -> None:
        """Add the manifest of a run. It is changed if dumps are left out that are in the run."""
        left_out = self._left_out(manifest)
        if left_out == set(manifest.get("left_out", ())):
            self.add(f"{place}/{MANIFEST_NAME}", directory / MANIFEST_NAME)
        else:
            manifest["left_out"] = sorted(left_out)
            self.add(f"{place}/{MANIFEST_NAME}", json_bytes(manifest))

    def _left_out(self, manifest: dict[str, Any]) -> set[str]:
        """Names of the files of a run that are not in the archive."""
        left_out = set(manifest.get("left_out", ()))
        if not self.dumps:
            left_out.update(name for name in manifest["files"] if _is_dump(name))
        return left_out

    def add_sweep(self, record: SweepRecord, name: str) -> list[str]:
        """Add the record, the table and the file of a sweep, and its finished runs.

        Parameters
        ----------
        record
            The record of the sweep.
        name
            Name of the folder of the sweep in the archive, and of the sweep file in it.

        Returns
        -------
        list of str
            The folders of the runs in the archive, each once. Points without a finished run have
            none.
        """
        place = f"{RUNS_FOLDER}/{name}"
        table = load_table(record.directory)
        folders = []
        runs: dict[str, None] = {}
        for state in states(record):
            folder = ""
            if state.directory:
                # Draws of a spread are in its directory, in the archive too.
                is_own = state.directory.parent == record.directory
                parent = place if is_own else RUNS_FOLDER
                folder = f"{parent}/{state.directory.name}"
                if state.status == "finished":
                    runs[self.add_run(state.directory, parent)] = None
            folders.append(folder)
        table["run"] = folders
        self.add(f"{place}/{RECORD_NAME}", record.directory / RECORD_NAME)
        for form in ("csv", "parquet"):
            self.add(f"{place}/table.{form}", encoded(table, form))
        tables_of_file = record.sweep.file
        self.add(f"{place}/{name}.toml", toml_bytes(tables_of_file))
        return list(runs)

    def add_companions(self, run: Path) -> None:
        """Add the spread and the accuracy of a run directory, which are sweeps beside it, if any.

        A sweep that was interrupted is added without the runs that it lacks. It can be continued
        from the archive.
        """
        for suffix in (SPREAD, ACCURACY):
            directory = run.with_name(f"{run.name}{suffix}")
            if not (directory / RECORD_NAME).is_file():
                continue
            self.add_sweep(read_sweep_record(directory), directory.name)
            bands = directory / SPREAD_NAME
            if bands.is_file():
                self.add(f"{RUNS_FOLDER}/{directory.name}/{SPREAD_NAME}", bands)

    def add_engine(self) -> None:
        """Add what repeats the runs without this program: the contact model and a script."""
        for source in model_sources():
            self.add(f"{MODEL_FOLDER}/{source.name}", source.read_bytes())
        self.add(f"{MODEL_FOLDER}/build.sh", build_script().encode())
        script = resources.files("walkers.archive").joinpath(REPEAT_NAME)
        self.add(REPEAT_NAME, script.read_bytes())


def _is_dump(name: str) -> bool:
    return any(fnmatch(Path(name).name, pattern) for pattern in _DUMPS)
