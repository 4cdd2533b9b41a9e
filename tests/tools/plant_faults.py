"""Plant the faults of ``faults.toml`` one by one, and see whether the tests catch each.

    python tests/tools/plant_faults.py TABLE.md [WORD]

TABLE.md gets a row for each fault: caught or not, and the first test that failed. WORD chooses faults by their name or
file. Each entry of a fault's ``tests`` is what pytest is given (``tests/test_runner.py -k lost``), by itself, until one
fails. A fault is taken back however its tests end, also after Ctrl-C.
"""

from __future__ import annotations

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
SECONDS = 600
"""Time limit of the tests of an entry."""


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


def failing(arguments: list[str]) -> str | None:
    """The first test that fails, None if all pass."""
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:randomly", "-p", "no:cacheprovider", *arguments]
    # Of a set of parameters, processes have another order each. Bytecode of a fault could outlive it.
    environment = {**os.environ, "PYTHONHASHSEED": "0", "PYTHONDONTWRITEBYTECODE": "1"}
    how = {"cwd": ROOT, "env": environment, "stdout": subprocess.PIPE, "text": True, "start_new_session": True}
    tests = subprocess.Popen(command, **how)
    try:
        output, _ = tests.communicate(timeout=SECONDS)
    except subprocess.TimeoutExpired:
        return f"time limit of {SECONDS} s"
    finally:
        if tests.poll() is None:
            os.killpg(tests.pid, signal.SIGKILL)  # engines and other children end with their parents
    found = re.search(r"^(?:FAILED|ERROR) (\S+)", output, re.MULTILINE)
    if tests.returncode and not found:
        raise SystemExit(f"pytest {shlex.join(arguments)}: status {tests.returncode}\n{output[-2000:]}")
    return found[1] if found else None


def main(table: str, word: str = "") -> None:
    """Plant what is asked for and write the table."""
    for number in (signal.SIGTERM, signal.SIGINT):  # which a shell has those ignore that it starts with "&"
        signal.signal(number, signal.default_int_handler)
    known = tomllib.loads(Path(__file__).with_name("faults.toml").read_text("utf-8"))["fault"]
    rows = ["| Fault | File | Caught | First failing test | s |", "| --- | --- | --- | --- | --- |"]
    for fault in (one for one in known if word in one["name"] + one["file"]):
        began = time.monotonic()
        with planted(fault):
            first = next((test for entry in fault["tests"] if (test := failing(shlex.split(entry)))), None)
        seconds = time.monotonic() - began
        caught = "yes" if first else "**no**"
        rows.append(f"| {fault['name']} | `{fault['file']}` | {caught} | {first or '-'} | {seconds:.0f} |")
        Path(table).write_text("\n".join(rows) + "\n", "utf-8")
        print(rows[-1], flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
