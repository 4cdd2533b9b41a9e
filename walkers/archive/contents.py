"""Contents of an archive: the files of a run or a sweep, and what repeats the runs with the engine alone."""

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
from walkers.templates.deck import BRIDGES_NAME, DECK_NAME

RECORD_FILE = "archive.json"
"""Machine-readable description of an archive: its authors, and the programs that made each run."""
README_FILE = "README.md"
"""Description of an archive for readers."""
SUMS_NAME = "sha256sums.txt"
"""List of checksums in an archive, in the format of ``sha256sum -c``."""
RUNS = "runs"
"""Folder of the run directories in an archive: the default folder of the program."""
MODEL_FOLDER = "contact_model"
"""Folder of the sources of the contact model in an archive."""
REPEAT_NAME = "repeat.sh"
"""Script of an archive that repeats a run with the engine alone."""
_DUMPS = ("beads.bin", "bridges.*.txt", "state.restart")
"""Names of the dumps of the engine; ``bridges.txt`` has the tables of forces, which a deck needs."""


class ArchiveFile(NamedTuple):
    """A file of an archive: its source or its contents, and its SHA-256."""

    source: Path | bytes
    sha256: str

    @classmethod
    def of(cls, source: Path | bytes) -> ArchiveFile:
        """A file whose checksum no manifest has."""
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
        Of the run or the sweep.
    manifests
        Manifests of all runs by the places of their folders in the archive.
    cases
        Cases of all runs by these places.
    files
        Files by their places in the archive.
    main
        Places of the runs that the archive is about: not those of spreads and accuracies.
    """

    name: str
    title: str
    manifests: Mapping[str, dict[str, Any]]
    cases: Mapping[str, Case]
    files: Mapping[str, ArchiveFile]
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

    def deck_folder(self, place: str) -> str:
        """Folder of the first deck of a run, relative to the run; ``.`` for a deck that was run by hand."""
        for folder in (DECK_FOLDER, f"{SEGMENTS}/0000"):
            if f"{place}/{folder}/{DECK_NAME}" in self.files:
                return folder
        return "."

    def has_tables(self, place: str) -> bool:
        """Whether a run has the tables of forces, without which its deck cannot be run."""
        return (Path(place) / self.deck_folder(place) / BRIDGES_NAME).as_posix() in self.files


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
        record = read_sweep_record(directory)
        points = states(record)
        unfinished = sum(state.status != "finished" for state in points)
        if unfinished:
            message = f"{unfinished} of {len(points)} points are not finished; see: walkers list {directory}"
            raise input_error(directory, message)
        name, title = name_of(record.directory.name), record.sweep.title
        main = packing.add_sweep(record, name)
    else:
        main = [packing.add_run(directory)]
        title = packing.cases[main[0]].title
        name = Path(main[0]).name
    for place in main:
        packing.add_companions(packing.directories[place])
    packing.add_engine()
    return Contents(name, title, packing.manifests, packing.cases, packing.files, main)


class _Packing:
    """Files and manifests of an archive, which are collected."""

    def __init__(self, dumps: bool) -> None:
        self.dumps = dumps
        self.files: dict[str, ArchiveFile] = {}
        self.manifests: dict[str, dict[str, Any]] = {}
        self.cases: dict[str, Case] = {}
        self.directories: dict[str, Path] = {}
        """Directories of the runs by their places in the archive."""

    def add(self, place: str, source: Path | bytes) -> None:
        """Add a file that no manifest lists."""
        self.files[place] = ArchiveFile.of(source)

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
            if not self.dumps and _is_dump(name):
                left_out.add(name)
                continue
            source = directory / name
            sums = manifest["sha256"]
            file = ArchiveFile(source, sums[name]) if name in sums else ArchiveFile.of(source)
            self.files[f"{place}/{name}"] = file
        if case.document:
            self.add(f"{place}/{name_of(case.name)}.toml", toml_bytes(case.document))
        if left_out == before:
            self.add(f"{place}/{MANIFEST_NAME}", directory / MANIFEST_NAME)
        else:
            manifest["left_out"] = sorted(left_out)
            self.add(f"{place}/{MANIFEST_NAME}", json_bytes(manifest))
        self.manifests[place] = manifest
        self.cases[place] = case
        self.directories[place] = directory
        return place

    def add_sweep(self, record: SweepRecord, name: str) -> list[str]:
        """Add a sweep, its table and its finished runs; return the places of the runs."""
        from walkers.sweeps.table import encoded, load_table

        place, table = f"{RUNS}/{name}", load_table(record.directory)
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
            self.add_sweep(read_sweep_record(directory), directory.name)
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


def _is_dump(name: str) -> bool:
    return any(fnmatch(Path(name).name, pattern) for pattern in _DUMPS)
