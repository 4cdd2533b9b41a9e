"""Plant the faults of ``faults.toml`` one by one, and see whether the tests catch each.

    python tests/tools/plant_faults.py check
    python tests/tools/plant_faults.py TABLE.md [WORD]

``check`` names the faults whose text is no longer in the code exactly once, and those whose tests have gone. It plants
nothing. The other form checks first, then plants: TABLE.md gets a row for each fault, caught or not, and the first test
that failed. WORD chooses faults by their name or file. Each entry of a fault's ``tests`` is what pytest is given
(``tests/test_runner.py -k lost``), by itself, until one fails. A fault is taken back however its tests end, also after
Ctrl-C.
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
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
SECONDS = 600
"""Time limit of the tests of an entry."""


@contextmanager
def planted(fault: Mapping[str, Any]) -> Iterator[None]:
    """Have the fault in its file for a while."""
    path = ROOT / fault["file"]
    sound = path.read_text("utf-8")
    try:
        path.write_text(sound.replace(fault["old"], fault["new"]), "utf-8")
        yield
    finally:
        path.write_text(sound, "utf-8")


def failing(arguments: list[str]) -> str | None:
    """The first test that fails, None if all pass."""
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-x",
        "-p",
        "no:randomly",
        "-p",
        "no:cacheprovider",
        *arguments,
    ]
    # Of a set of parameters, processes have another order each. Bytecode of a fault could outlive it.
    environment = {**os.environ, "PYTHONHASHSEED": "0", "PYTHONDONTWRITEBYTECODE": "1"}
    how = {
        "cwd": ROOT,
        "env": environment,
        "stdout": subprocess.PIPE,
        "text": True,
        "start_new_session": True,
    }
    tests = subprocess.Popen(command, **how)
    try:
        output, _ = tests.communicate(timeout=SECONDS)
    except subprocess.TimeoutExpired:
        return f"time limit of {SECONDS} s"
    finally:
        if tests.poll() is None:
            os.killpg(
                tests.pid, signal.SIGKILL
            )  # engines and other children end with their parents
    found = re.search(r"^(?:FAILED|ERROR) (\S+)", output, re.MULTILINE)
    if tests.returncode and not found:
        raise SystemExit(
            f"pytest {shlex.join(arguments)}: status {tests.returncode}\n{output[-2000:]}"
        )
    return found[1] if found else None


def problems_of(faults: Sequence[Mapping[str, Any]]) -> list[str]:
    """What keeps faults from being planted, or their tests from being found: a line for each problem."""
    problems = []
    for fault in faults:
        name, path = fault["name"], ROOT / fault["file"]
        times = path.read_text("utf-8").count(fault["old"]) if path.is_file() else 0
        if times != 1:
            problems.append(f"{name}: the old text is {times} times in {fault['file']}, not once")
        if fault["old"] == fault["new"]:
            problems.append(f"{name}: the new text is the old one")
        for entry in fault["tests"]:
            problems += [f"{name}: {problem}" for problem in _problems_of_tests(entry)]
    names = Counter(fault["name"] for fault in faults)
    problems += [
        f"{name}: the name of {number} faults" for name, number in names.items() if number > 1
    ]
    return problems


def _problems_of_tests(entry: str) -> list[str]:
    """What is wrong with an entry of ``tests``: its file has gone, or a word after ``-k`` is not in the file."""
    file, *options = shlex.split(entry)
    path = ROOT / file
    if not path.is_file():
        return [f"there is no {file}"]
    text = path.read_text("utf-8")
    words = re.findall(r"\w+", " ".join(options).replace("-k", " "))
    gone = [word for word in words if word not in ("or", "and", "not") and word not in text]
    return [f"{file} has no {' '.join(gone)}"] if gone else []


def main(table: str, word: str = "") -> None:
    """Check the faults; unless ``table`` is ``check``, plant those that are asked for and write the table."""
    for number in (
        signal.SIGTERM,
        signal.SIGINT,
    ):  # which a shell has those ignore that it starts with "&"
        signal.signal(number, signal.default_int_handler)
    known = tomllib.loads(Path(__file__).with_name("faults.toml").read_text("utf-8"))["fault"]
    chosen = [fault for fault in known if word in fault["name"] + fault["file"]]
    if problems := problems_of(chosen):
        raise SystemExit("\n".join(problems))
    if table == "check":
        print(f"{len(chosen)} faults can be planted")
        return
    rows = ["| Fault | File | Caught | First failing test | s |", "| --- | --- | --- | --- | --- |"]
    for fault in chosen:
        began = time.monotonic()
        with planted(fault):
            first = next(
                (test for entry in fault["tests"] if (test := failing(shlex.split(entry)))), None
            )
        seconds = time.monotonic() - began
        caught = "yes" if first else "**no**"
        rows.append(
            f"| {fault['name']} | `{fault['file']}` | {caught} | {first or '-'} | {seconds:.0f} |"
        )
        Path(table).write_text("\n".join(rows) + "\n", "utf-8")
        print(rows[-1], flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("table", help="the table to write, or check")
    parser.add_argument(
        "word", nargs="?", default="", help="part of the names or files of the faults to plant"
    )
    given = parser.parse_args()
    main(given.table, given.word)
