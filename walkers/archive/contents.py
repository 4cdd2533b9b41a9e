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

from walkers.errors import refused
from walkers.files import checksum, json_bytes, open_regular
from walkers.inputs.toml import toml_bytes
from walkers.postprocess.measure.uncertainty import ACCURACY, ACCURACY_NAME, SPREAD, SPREAD_NAME
from walkers.runner.compiled_model import build_script
from walkers.runner.directory import CASE_NAME, case_of, name_of
from walkers.runner.manifest import MANIFEST_NAME, read_manifest
from walkers.runner.model_sources import model_sources
from walkers.sweeps.record import RECORD_NAME, SweepRecord, read_record, states

METADATA_NAME = "ro-crate-metadata.json"
"""Machine-readable description of an archive."""
SUMS_NAME = "sha256sums.txt"
"""List of checksums in an archive, in the format of ``sha256sum -c``."""
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
