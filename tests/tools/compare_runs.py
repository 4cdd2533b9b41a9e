"""Digests of what the shipped cases compute, to compare before and after a change of the program.

    python tests/tools/compare_runs.py record before.json     # runs what is missing, into runs/compare
    python tests/tools/compare_runs.py check before.json      # after the change: bitwise, or how far apart

Places and velocities are compared as they are: a deck whose physics is unchanged gives the same trajectory bit for bit.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import sys
from pathlib import Path

import numpy as np

from walkers import run
from walkers.inputs.reading import shipped
from walkers.postprocess.dump import BinaryDump

LEFT_OUT = ("pile-small", "pile-fig1a")  # minutes
OUT = Path("runs/compare")
COLUMNS = ("x", "y", "z", "vx", "vy", "vz")


def digests(out: Path) -> dict[str, dict[str, object]]:
    """Of each shipped case: digest of its bead dumps, and numbers of its result."""
    found: dict[str, dict[str, object]] = {}
    for name in shipped("case"):
        if name in LEFT_OUT:
            continue
        outcome = run(name, out)
        digest = hashlib.sha256()
        for path in sorted(outcome.directory.rglob("beads.bin")):
            dump = BinaryDump(path, tuple(json.loads((path.parent / "layout.json").read_text())["bead_columns"]))
            columns = [dump.column(name) for name in COLUMNS]
            digest.update(np.ascontiguousarray(dump.stack()[:, :, columns]).tobytes())
        found[name] = {"beads": digest.hexdigest(), "numbers": _numbers(outcome.result)}
        print(name, digest.hexdigest()[:12], flush=True)
    return found


def _numbers(result: object, key: str = "") -> dict[str, float]:
    """All numbers of a result, by dotted key."""
    if isinstance(result, dict):
        return {k: v for name, value in result.items() for k, v in _numbers(value, f"{key}.{name}").items()}
    if isinstance(result, list):
        return {k: v for place, value in enumerate(result) for k, v in _numbers(value, f"{key}.{place}").items()}
    return {key: float(result)} if isinstance(result, (int, float)) and not isinstance(result, bool) else {}


def main(action: str, file: str) -> int:
    """Record, or compare with what was recorded; 1 if anything differs."""
    if action == "record":
        Path(file).write_text(json.dumps(digests(OUT), indent=1))
        return 0
    before = json.loads(Path(file).read_text())
    shutil.rmtree(OUT, ignore_errors=True)
    after = digests(OUT)
    worst = 0
    for name, known in before.items():
        if name not in after:
            print(f"{name}: gone")
            worst = 1
        elif known["beads"] == after[name]["beads"]:
            print(f"{name}: bitwise the same")
        else:
            common = known["numbers"].keys() & after[name]["numbers"].keys()  # type: ignore[attr-defined]
            pairs = np.array([[known["numbers"][key], after[name]["numbers"][key]] for key in sorted(common)])  # type: ignore[index]
            apart = np.abs(pairs[:, 0] - pairs[:, 1]) / np.maximum(np.abs(pairs).max(axis=1), 1e-12)
            print(f"{name}: trajectories differ; numbers of the result by up to {apart.max():.2g} of themselves")
            worst = 1
    return worst


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
