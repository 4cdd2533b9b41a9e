"""Check whether the files of a run, a sweep or an unpacked archive are unchanged."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

from walkers.archive.crate import METADATA_NAME
from walkers.errors import refused, shortened
from walkers.postprocess.uncertainty import SPREAD_NAME
from walkers.runner.directory import CASE_NAME, SEGMENTS
from walkers.runner.manifest import MANIFEST_NAME, checksums, read_manifest
from walkers.sweeps.table import PARSL, RECORD_NAME, read_record, states
from walkers.text import printable

SUMS_NAME = "sha256sums.txt"
"""List of checksums in an archive, in the format of ``sha256sum -c``."""
_SHOWN = (
    *(".png", ".pdf", ".svg", ".gif", ".mp4", ".html", ".htm"),
    *(".vtu", ".pvd", ".py", ".lammpstrj", ".csv"),
)
"""Suffixes of pictures, films, pages, files for ParaView and exports, which the program writes and never reads."""
_LONGEST_SHOWN = 300


@dataclass(frozen=True)
class Verification:
    """State of the files of a run or an archive, or of the points of a sweep; ``intact`` counts unchanged ones.

    ``findings`` are the names of the others by kind: ``changed``, ``missing``, ``not listed``, ``doubtful`` (with the
    reason in brackets), and ``made since`` from the run (`_made_since`), without influence on results. ``left_out`` is
    the number of files that were left out of an archive on purpose.
    """

    name: str
    intact: int
    findings: Mapping[str, Sequence[str]]
    left_out: int = 0
    of_points: bool = False

    @property
    def passed(self) -> bool:
        """Whether all listed files are unchanged and no unlisted file could influence a result."""
        return not any(names for kind, names in self.findings.items() if kind != "made since")

    def describe(self) -> str:
        """The outcome, and one line for each file that has changed or is not listed."""
        head = f"{self.name}: {self.intact} {'points have a run' if self.of_points else 'files are unchanged'}"
        lines = [f"{head}, {self.left_out} left out of the archive" if self.left_out else head]
        for kind, names in self.findings.items():  # names in archives may contain escape sequences
            lines += [f"  {kind:<10} {printable(shortened(name, _LONGEST_SHOWN))}" for name in names]
        return "\n".join(lines)


def verify(path: Path) -> list[Verification]:
    """Compare a run, a sweep, or an unpacked archive with the checksums in manifests or in the archive.

    All listed files must exist and be unchanged, and there must be no other files. Files that were made from finished
    runs and are never read (pictures, films, pages, files for ParaView, exports, hidden files) are named and are no
    failure. The same applies to a sweep's directory; its record has a checksum only in archives.

    Runs and archives have one verification; sweeps have one of the points, and one of each finished run. `InputError`
    if the path is none of these or cannot be read.
    """
    if (path / RECORD_NAME).is_file():
        return _verify_sweep(path)
    if (path / SUMS_NAME).is_file():
        return [_verify_archive(path.resolve())]
    if (path / MANIFEST_NAME).is_file():
        return [_verify_run(path)]
    if path.is_file():
        raise refused(path, "not a folder; unpack an archive, then: walkers check files FOLDER")
    kinds = f"a run directory (with a {MANIFEST_NAME}), a sweep's ({RECORD_NAME}), or an archive ({SUMS_NAME})"
    raise refused(path, f"expected {kinds}")


def _verify_run(directory: Path) -> Verification:
    """Compare a run with its manifest; a run without a readable manifest does not pass."""
    name = directory.resolve().name
    try:
        manifest = read_manifest(directory)
        listed = {CASE_NAME: "", **manifest["sha256"]}  # every run has a case
        beside, left_out = f"{manifest['name']}.toml", set(manifest.get("left_out", ()))  # in archives
        return _compared(directory, listed, {MANIFEST_NAME}, lambda path: path == beside, left_out)
    except FileNotFoundError:
        return Verification(name, 0, {"missing": [MANIFEST_NAME]})
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        return Verification(name, 0, {"doubtful": [f"{MANIFEST_NAME} (it, or what it names, cannot be read: {error})"]})


def _verify_sweep(directory: Path) -> list[Verification]:
    record = read_record(directory)
    points = states(record)
    missing = [
        f"{run} ({state.status}: point {number})"
        for number, (run, state) in enumerate(zip(record.runs, points, strict=True))
        if state.status not in ("finished", "not needed")
    ]
    runs = [state.directory for state in points if state.directory and state.status == "finished"]
    # Bands are only printed, and the other files are those of an archive: no result depends on them.
    beside = (SPREAD_NAME, f"{record.name}.toml", "table.parquet")
    files = _compared(directory, {}, {RECORD_NAME}, lambda path: path in beside or path.startswith(f"{PARSL}/"))
    findings = {**files.findings, "missing": missing}
    whole = replace(files, name=record.name, intact=len(runs), findings=findings, of_points=True)
    return [whole, *map(_verify_run, dict.fromkeys(runs))]


def _verify_archive(path: Path) -> Verification:
    listed: dict[str, str] = {}
    for line in (path / SUMS_NAME).read_bytes().decode("utf-8", "replace").removesuffix("\n").split("\n"):
        checksum, _, place = line.partition("  ")
        if len(checksum) != 64 or not place or place in listed:
            raise refused(path, f"{SUMS_NAME}: expected a checksum and a path, each path once, found {line[:80]!r}")
        listed[place] = checksum
    listed.setdefault(METADATA_NAME, "")  # every archive has metadata
    compared = _compared(path, listed, {SUMS_NAME})
    if any(place.count("/") == 2 and place.endswith(f"/{MANIFEST_NAME}") for place in listed):
        return compared
    return replace(compared, findings={**compared.findings, "doubtful": [f"{SUMS_NAME} (it lists no run)"]})


def _compared(
    folder: Path,
    listed: Mapping[str, str],
    lists: Collection[str],
    beside: Callable[[str], bool] = lambda _: False,
    left_out: Collection[str] = (),
) -> Verification:
    """Compare the files of a folder with their listed checksums, by relative path.

    ``lists`` are the files that list them; ``beside`` tells which other files are no failure.
    """
    there = [name for name in _files_below(folder) if name not in lists]
    now = checksums(folder, [name for name in there if name in listed and (folder / name).is_file()])
    changed = [name for name, checksum in now.items() if checksum != listed[name]]
    others = [name for name in there if name not in listed]
    since = [name for name in others if _made_since(name) or beside(name)]
    folders = {"", *(name.rpartition("/")[0] for name in listed)}
    shown = [(name, name.rpartition("/")[0]) for name in since]
    findings = {
        "changed": changed,
        "missing": [name for name in listed if name not in now and name not in left_out],
        "not listed": [name for name in others if name not in since],
        "made since": list(dict.fromkeys(name if parent in folders else f"{parent}/" for name, parent in shown)),
    }
    absent = sum(name in listed and name not in now for name in left_out)
    return Verification(folder.resolve().name, len(now) - len(changed), findings, left_out=absent)


def _made_since(name: str) -> bool:
    """Whether an unlisted file (relative path) was made from a run and cannot influence a result: `_SHOWN`, hidden."""
    path = PurePosixPath(name)
    hidden = any(part.startswith(".") and part != ".." for part in path.parts)
    # Everything in the folder of segments is read as a part of the run.
    return SEGMENTS not in path.parts and (hidden or path.suffix.lower() in _SHOWN)


def _files_below(folder: Path) -> list[str]:
    """Relative paths of all files, empty folders (with a slash) and links to folders in a folder."""
    names = []
    for path in folder.rglob("*"):
        name = path.relative_to(folder).as_posix()
        if path.is_symlink() or not path.is_dir():
            names.append(name)
        elif not any(path.iterdir()):
            names.append(f"{name}/")
    return sorted(names)
