"""Whether a run, the runs of a sweep, or an archive are what they were.

Archives come from strangers: no more of one is read at once than a bound, none is unpacked, and what a zip file may do
to who reads it (members that unpack to far more than the file, that overlap, that are encrypted or links) is refused or
told.
"""

from __future__ import annotations

import hashlib
import io
import stat
import struct
import zipfile
import zlib
from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import IO, Any
from urllib.parse import unquote

from walkers.archive.crate import METADATA_NAME, PREVIEW_NAME
from walkers.inputs.errors import InputError, Problem
from walkers.runner.files import LARGEST_TEXT, json_object, read_text
from walkers.runner.manifest import MANIFEST_NAME
from walkers.runner.verification import Listed, Verification, files_below, is_within, listed_by, made_since, verify_run
from walkers.sweeps.record import PARSL, RECORD_NAME, SweepRecord, read_record, states

SUMS_NAME = "sha256sums.txt"
"""In an archive: as ``sha256sum -c`` reads it."""
_MOST_TIMES = 100
"""A zip file that unpacks to more than this many times its size is refused; those of runs to some five times."""
_MOST_ANYWAY = 1 << 28
"""Bytes: what unpacks to less is read in a second."""
_MOST_MEMBERS = 32 << 20
"""Bytes of a zip file's own list of members: some 250,000 of them."""
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_ENCRYPTED = 1
_LOCAL_HEADER = 30
"""Bytes before a member's contents, at least."""
_DAMAGED = (zipfile.BadZipFile, zlib.error, EOFError, struct.error, ValueError, OverflowError, RuntimeError)
"""What zipfile raises of members, and of the whole, that are not what their headers say."""


class _UnusableError(Exception):
    """A file of an archive that is not read: why."""


def verify(path: Path) -> list[Verification]:
    """Compare files with what manifests, or the checksums of an archive, say of them.

    All that is listed must be there and unchanged, and nothing else be there. What was made from finished runs since,
    and is read by nobody, is named and no failure: pictures, films, pages, files for ParaView, exports and hidden files
    (`walkers.runner.verification.made_since`), but in a zip file, which is written whole. The lists of an archive
    (its checksums, its RO-Crate, the manifests of its runs) must agree, and no two names may differ by upper and lower
    case alone. A sweep's directory is held to the same rule; its record has a checksum in archives only.

    Parameters
    ----------
    path
        A run directory, a sweep's directory, an archive (.zip), or a folder that one was unpacked into.

    Returns
    -------
    list of Verification
        One a run or archive; of a sweep that of its points and those of its finished runs.

    Raises
    ------
    InputError
        If it is none of these, cannot be read, or is made to fill the memory or the time of who reads it.
    """
    if path.is_dir():
        if (path / RECORD_NAME).is_file():
            return _verify_sweep(path)
        if (path / SUMS_NAME).is_file():
            return [_verify_unpacked(path)]
        if (path / MANIFEST_NAME).is_file():
            return [verify_run(path)]
    elif path.is_file():
        return [_verify_zip(path)]
    told = f"expected a run directory (with a {MANIFEST_NAME}), a sweep's ({RECORD_NAME}), or an archive ({SUMS_NAME})"
    raise _refused(path, told)


def _refused(path: Path, told: str) -> InputError:
    return InputError(str(path), [Problem("", None, told)])


def _verify_sweep(directory: Path) -> list[Verification]:
    record = read_record(directory)
    found = states(record)
    lacking = [
        f"{run} ({state.status}: point {number})"
        for number, (run, state) in enumerate(zip(record.runs, found, strict=True))
        if state.status not in ("finished", "not needed")
    ]
    finished = sum(state.status == "finished" for state in found)
    others = [name for name in files_below(directory, (PARSL,)) if name != RECORD_NAME]
    since = [name for name in others if made_since(name) or name in _beside_record(record)]
    points = Verification(
        record.name,
        finished,
        missing=tuple(lacking),
        unlisted=tuple(name for name in others if name not in since),
        since=tuple(since),
        of_points=True,
    )
    runs = list(dict.fromkeys(state.directory for state in found if state.directory and state.status == "finished"))
    return [points, *map(verify_run, runs)]


def _beside_record(record: SweepRecord) -> tuple[str, str]:
    """What archives put beside a sweep's record, and have a checksum of: nothing is read from them there."""
    return f"{record.name}.toml", "table.parquet"


def _verify_unpacked(folder: Path) -> Verification:
    folder = folder.resolve()
    try:
        places = files_below(folder)
        sizes = {place: (folder / place).stat().st_size for place in places if (folder / place).is_file()}
    except OSError as error:
        raise _refused(folder, f"cannot be read ({error})") from error
    return _Archive(folder, places, sizes, lambda place: (folder / place).open("rb"), made_since).compared()


class _Bounded(io.BufferedReader):
    """A zip file of which no more is read at once than the list of members of the largest archive."""

    def read(self, size: int | None = -1, /) -> bytes:
        """Read at most so many bytes."""
        if size is not None and size > _MOST_MEMBERS:
            raise zipfile.BadZipFile(f"expected a list of members of at most {_MOST_MEMBERS >> 20} MB")
        return super().read(size)


def _verify_zip(path: Path) -> Verification:
    try:
        with _Bounded(io.FileIO(path)) as file, zipfile.ZipFile(file) as archive:
            members = archive.infolist()
            _refuse_bombs(path, members)
            # Later members of a name hide earlier ones: which of them is read does not matter, for neither passes.
            sizes = {member.filename: member.file_size for member in members if not member.is_dir()}
            places = [member.filename for member in members]
            return _Archive(path, places, sizes, lambda place: _opened(archive, place), lambda _: False).compared()
    except (OSError, *_DAMAGED) as error:
        raise _refused(path, f"not a zip file that can be read ({error})") from error


def _refuse_bombs(path: Path, members: Sequence[zipfile.ZipInfo]) -> None:
    """Refuse what takes far more time to read than it has bytes; what is declared here is all that is ever read."""
    unpacked, size = sum(member.file_size for member in members), path.stat().st_size
    if unpacked > max(_MOST_TIMES * size, _MOST_ANYWAY):
        told = f"unpacks to {unpacked / 1e6:.0f} MB, expected at most {_MOST_TIMES} times its {size / 1e6:.1f} MB"
        raise _refused(path, told)
    placed = sorted(members, key=lambda member: member.header_offset)
    if any(one.header_offset + _LOCAL_HEADER + one.compress_size > two.header_offset for one, two in pairwise(placed)):
        raise _refused(path, "expected members that follow each other, they overlap")


def _opened(archive: zipfile.ZipFile, place: str) -> IO[bytes]:
    member = archive.getinfo(place)
    if member.flag_bits & _ENCRYPTED:
        raise _UnusableError("encrypted")
    if stat.S_ISLNK(member.external_attr >> 16):
        raise _UnusableError("a symbolic link")
    if member.compress_type not in _METHODS:
        raise _UnusableError(f"compressed by method {member.compress_type}, expected deflated or stored")
    return archive.open(member)


class _Archive:
    """An archive that is compared with its lists: all that is in it, sizes of the files, and how they are opened."""

    def __init__(
        self,
        path: Path,
        places: Sequence[str],
        sizes: Mapping[str, int],
        opened: Callable[[str], IO[bytes]],
        may_be_added: Callable[[str], bool],
    ) -> None:
        self.path, self.places, self.sizes, self.opened, self.may_be_added = path, places, sizes, opened, may_be_added
        self.wanted: dict[str, str] = {}
        self.changed: list[str] = []
        self.doubtful = _clashes(places)
        self.unread: list[str] = []

    def compared(self) -> Verification:
        """What has become of its files."""
        if SUMS_NAME not in self.sizes:
            raise _refused(self.path, f"no archive of runs: it has no {SUMS_NAME}")
        text = self._read(SUMS_NAME, str)
        if text is None:
            return Verification(self.path.name, 0, doubtful=tuple(self.doubtful))
        wanted = self.wanted = _listed(self.path, text)
        intact = [place for place in wanted if place in self.sizes and self._is_intact(place)]
        self._compare_lists(intact)
        known, in_order = {*wanted, SUMS_NAME}, sorted(wanted)
        others = [place for place in dict.fromkeys(self.places) if place not in known]
        others = [place for place in others if not (place.endswith("/") and _is_start(place, in_order))]
        return Verification(
            self.path.name,
            len(intact),
            changed=tuple(self.changed),
            missing=tuple(place for place in dict.fromkeys([*wanted, METADATA_NAME]) if place not in self.sizes),
            unlisted=tuple(place for place in others if not self.may_be_added(place)),
            doubtful=tuple(dict.fromkeys(self.doubtful)),
            since=tuple(place for place in others if self.may_be_added(place)),
            unread=tuple(self.unread),
        )

    def _is_intact(self, place: str) -> bool:
        try:
            with self.opened(place) as file:
                if hashlib.file_digest(file, "sha256").hexdigest() == self.wanted[place]:  # type: ignore[arg-type]
                    return True
            self.changed.append(place)
        except _UnusableError as error:
            self.doubtful.append(f"{place} ({error})")
        except _DAMAGED:  # its own check failed
            self.changed.append(place)
        except OSError as error:
            self.doubtful.append(f"{place} ({error.strerror or error})")
        return False

    def _read(self, place: str, parsed: Callable[[str], Any]) -> Any:
        """What is made of a text in it; None, and a line in what is told, if it cannot be read."""
        if self.sizes[place] > LARGEST_TEXT:
            raise _refused(self.path, f"{place}: expected at most {LARGEST_TEXT >> 20} MB")
        try:
            with self.opened(place) as file:
                return parsed(read_text(place, file))
        except (_UnusableError, OSError, KeyError, TypeError, AttributeError, *_DAMAGED) as error:
            self.doubtful.append(f"{place} (cannot be read: {error})")
            return None

    def _compare_lists(self, intact: Iterable[str]) -> None:
        """Compare what its other lists say, as far as they are what they were, with the checksums."""
        lists = [place for place in intact if place == METADATA_NAME or _name(place) == MANIFEST_NAME]
        if not any(_name(place) == MANIFEST_NAME for place in self.wanted):
            self.doubtful.append(f"{SUMS_NAME} (it lists no run)")
        in_order = sorted(self.wanted)
        for place in lists:
            if place == METADATA_NAME and self.sizes[place] > LARGEST_TEXT:
                self.unread.append(f"{place} (larger than {LARGEST_TEXT >> 20} MB: compared by its checksum alone)")
                continue
            if place == METADATA_NAME:
                said = self._read(place, lambda text: _said_by_crate(json_object(METADATA_NAME, text)))
                own = [one for one in in_order if one not in (METADATA_NAME, PREVIEW_NAME)]
            else:
                folder = place.removesuffix(MANIFEST_NAME)
                listed = self._read(place, lambda text: listed_by(json_object(MANIFEST_NAME, text)))
                said = None if listed is None else _said_by_manifest(folder, listed)
                below = in_order[bisect_left(in_order, folder) : bisect_left(in_order, f"{folder}\U0010ffff")]
                own = [one for one in below if listed and not _is_beside(one.removeprefix(folder), listed)]
            if said is not None:
                odd = [one for one in {*own, *said} if not self._agrees(one, *said.get(one, ("", "")))]
                self.doubtful += [f"{one} ({SUMS_NAME} and {place} disagree)" for one in sorted(odd)]

    def _agrees(self, place: str, total: object, size: object) -> bool:
        same_size = place not in self.sizes or str(size) == str(self.sizes[place])
        return place in self.wanted and total == self.wanted[place] and same_size


def _said_by_manifest(folder: str, listed: Listed) -> dict[str, tuple[object, object]]:
    """Checksums and sizes of a run's files, by their places in the archive."""
    return {
        f"{folder}{name}": (str(listed.sums.get(name)), listed.sizes.get(name))
        for name in listed.names
        if name not in listed.left_out
    }


def _is_beside(name: str, listed: Listed) -> bool:
    """Whether an archive has a file in the folder of a run that is none of its manifest's."""
    return name in (MANIFEST_NAME, listed.case_file)


def _said_by_crate(metadata: Mapping[str, Any]) -> dict[str, tuple[object, object]]:
    """Checksums and sizes of the files that an RO-Crate describes."""
    files = [entity for entity in metadata["@graph"] if entity.get("@type") == "File"]
    return {unquote(entity["@id"]): (str(entity.get("sha256")), entity.get("contentSize")) for entity in files}


def _listed(path: Path, text: str) -> dict[str, str]:
    """The checksums of a list, by the places of the files."""
    wanted: dict[str, str] = {}
    for line in io.StringIO(text, newline="\n"):  # one by one: a list may be nothing but ends of lines
        one, _, place = line.removesuffix("\n").partition("  ")
        if len(one) != hashlib.sha256().digest_size * 2 or not is_within(place) or place in wanted:
            raise _refused(path, f"{SUMS_NAME}: expected a checksum and a path, each path once, found {line[:80]!r}")
        wanted[place] = one
    return wanted


def _name(place: str) -> str:
    return place.rpartition("/")[2]


def _is_start(folder: str, in_order: Sequence[str]) -> bool:
    """Whether one of some places, sorted, is in a folder (with its slash)."""
    first = bisect_left(in_order, folder)
    return first < len(in_order) and in_order[first].startswith(folder)


def _clashes(places: Sequence[str]) -> list[str]:
    """What would take another's place when unpacked: files and folders of one name, or of names that differ by case."""
    folded = [place.rstrip("/").casefold() for place in places]
    count, in_order = Counter(folded), sorted(folded)
    return [
        f"{place} (another file or folder has its name)"
        for place, one in dict(zip(places, folded, strict=True)).items()
        if count[one] > 1 or (not place.endswith("/") and _is_start(f"{one}/", in_order))
    ]
