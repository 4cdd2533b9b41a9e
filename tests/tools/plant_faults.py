"""Plant the faults of ``faults.toml`` one by one, and see whether the tests catch each.

    python tests/tools/plant_faults.py TABLE.md [WORD] [--all]

TABLE.md gets a row for each fault: caught or not, and the first test that failed. WORD chooses faults by their name or
file. Each entry of a fault's ``tests`` is what pytest is given (``tests/test_runner.py -k lost``), by itself, until one
fails; with ``--all`` the whole suite follows. A fault is taken back however its tests end, also after Ctrl-C.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
FAULTS = Path(__file__).with_name("faults.toml")
WHOLE = ["-n", "2", "-x", "-m", "not smoke and not slow", "tests"]
SECONDS, LONGEST = 600, 3600
"""Time limits of the tests of an entry, and of the whole suite."""


@contextmanager
def planted(fault: Mapping[str, Any]) -> Iterator[None]:
    """Have the fault in its file for a while."""
    path, old = ROOT / fault["file"], fault["old"]
    sound = path.read_text("utf-8")
    if sound.count(old) != 1:
        raise SystemExit(f"{fault['name']}: the old text is {sound.count(old)} times in {fault['file']}, not once")
    try:
        path.write_text(sound.replace(old, fault["new"]), "utf-8")
        yield
    finally:
        path.write_text(sound, "utf-8")


def failing(arguments: list[str], seconds: float) -> str | None:
    """The first test that fails, None if all pass."""
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:randomly", "-p", "no:cacheprovider", *arguments]
    # Of a set of parameters, processes have another order each. Bytecode of a fault could outlive it.
    environment = {**os.environ, "PYTHONHASHSEED": "0", "PYTHONDONTWRITEBYTECODE": "1"}
    tests = subprocess.Popen(
        command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    try:
        output, _ = tests.communicate(timeout=seconds)
    except subprocess.TimeoutExpired:
        return f"time limit of {seconds:g} s"
    finally:
        if tests.poll() is None:
            os.killpg(tests.pid, signal.SIGKILL)  # engines and other children end with their parents
    found = re.search(r"^(?:FAILED|ERROR) (\S+)", output, re.MULTILINE)
    if tests.returncode and not found:
        raise SystemExit(f"pytest {shlex.join(arguments)}: status {tests.returncode}\n{output[-2000:]}")
    return found[1] if found else None


def main() -> None:
    """Plant what is asked for and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("table", type=Path)
    parser.add_argument("word", nargs="?", default="")
    parser.add_argument("--all", action="store_true", help="the whole suite for what the listed tests miss")
    asked = parser.parse_args()
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # which a shell has those ignore that it starts with "&"
    known = tomllib.loads(FAULTS.read_text("utf-8"))["fault"]
    chosen = [one for one in known if asked.word in one["name"] + one["file"]]
    rows = ["| Fault | File | Caught | First failing test | s |", "| --- | --- | --- | --- | --- |"]
    for fault in chosen:
        began, entries = time.monotonic(), [(shlex.split(entry), SECONDS) for entry in fault["tests"]]
        with planted(fault):
            runs = [*entries, (WHOLE, LONGEST)] if asked.all else entries
            first = next((test for run in runs if (test := failing(*run))), None)
        caught, seconds = "yes" if first else "**no**", time.monotonic() - began
        rows.append(f"| {fault['name']} | `{fault['file']}` | {caught} | {first or '-'} | {seconds:.0f} |")
        asked.table.write_text("\n".join(rows) + "\n", "utf-8")
        print(rows[-1], flush=True)


if __name__ == "__main__":
    main()
