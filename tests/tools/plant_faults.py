"""Plant the faults of ``faults.toml`` one by one, and see whether the tests catch each.

    python tests/tools/plant_faults.py check
    python tests/tools/plant_faults.py TABLE.md [WORD]

``check`` names the faults whose text is no longer in the code exactly once, and those whose tests
have gone. It plants nothing.

The other form checks first, then plants: TABLE.md gets a row for each fault, caught or not, and the
first test that failed. WORD chooses faults by their name or file. Each entry of a fault's ``tests``
is what pytest is given (``tests/test_runner.py -k lost``), by itself, until one fails. A fault is
taken back however its tests end, also after Ctrl-C.
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
WITHOUT_PLUGINS = ("-p", "no:randomly", "-p", "no:cacheprovider")
"""Options of pytest: the order of the file, and nothing that is left behind."""


@contextmanager
def planted(fault: Mapping[str, Any]) -> Iterator[None]:
    """Have a fault in its file for a while."""
    path = ROOT / fault["file"]
    sound = path.read_text("utf-8")
    try:
        path.write_text(sound.replace(fault["old"], fault["new"]), "utf-8")
        yield
    finally:
        path.write_text(sound, "utf-8")


def failing(arguments: list[str]) -> str | None:
    """The first test that fails of those that pytest is given; None if all pass."""
    command = [sys.executable, "-m", "pytest", "-q", "-x", *WITHOUT_PLUGINS, *arguments]
    # Processes with other hashes have the parameters of a set in another order, and bytecode of a
    # fault could outlive it.
    environment = {**os.environ, "PYTHONHASHSEED": "0", "PYTHONDONTWRITEBYTECODE": "1"}
    tests = subprocess.Popen(
        command,
        cwd=ROOT,
        env=environment,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        output, _ = tests.communicate(timeout=SECONDS)
    except subprocess.TimeoutExpired:
        return f"time limit of {SECONDS} s"
    finally:
        if tests.poll() is None:
            # Engines and other children of the tests end with them.
            os.killpg(tests.pid, signal.SIGKILL)
    if tests.returncode == 0:
        return None
    failure = re.search(r"^(?:FAILED|ERROR) (\S+)", output, re.MULTILINE)
    if failure is None:
        reason = f"status {tests.returncode}\n{output[-2000:]}"
        raise SystemExit(f"pytest {shlex.join(arguments)}: {reason}")
    return failure[1]


def first_failing_test(fault: Mapping[str, Any]) -> str | None:
    """The first test that fails while a fault is planted; None if its tests do not catch it."""
    with planted(fault):
        for entry in fault["tests"]:
            test = failing(shlex.split(entry))
            if test is not None:
                return test
    return None


def problems_of(faults: Sequence[Mapping[str, Any]]) -> list[str]:
    """What keeps faults from being planted, or their tests from being found.

    A line for each problem.
    """
    problems = []
    for fault in faults:
        for problem in (*_problems_of_text(fault), *_problems_of_tests(fault)):
            problems.append(f"{fault['name']}: {problem}")
    names = Counter(fault["name"] for fault in faults)
    for name, number in names.items():
        if number > 1:
            problems.append(f"{name}: the name of {number} faults")
    return problems


def _problems_of_text(fault: Mapping[str, Any]) -> Iterator[str]:
    """What is wrong with the text of a fault: it is not once in its file, or does not change."""
    path = ROOT / fault["file"]
    times = 0
    if path.is_file():
        times = path.read_text("utf-8").count(fault["old"])
    if times != 1:
        yield f"the old text is {times} times in {fault['file']}, not once"
    if fault["old"] == fault["new"]:
        yield "the new text is the old one"


def _problems_of_tests(fault: Mapping[str, Any]) -> Iterator[str]:
    """What is wrong with the tests of a fault: a file has gone, or a word after ``-k``."""
    for entry in fault["tests"]:
        file, *options = shlex.split(entry)
        path = ROOT / file
        if not path.is_file():
            yield f"there is no {file}"
            continue
        text = path.read_text("utf-8")
        for word in _words_of_names(options):
            if word not in text:
                yield f"{file} has no {word}"


def _words_of_names(options: Sequence[str]) -> list[str]:
    """The parts of names of tests in options such as ``-k "lost or found"``."""
    words = re.findall(r"\w+", " ".join(options).replace("-k", " "))
    return [word for word in words if word not in ("or", "and", "not")]


def read_faults(word: str) -> list[dict[str, Any]]:
    """The faults with a word in their name or file."""
    text = Path(__file__).with_name("faults.toml").read_text("utf-8")
    faults = []
    for fault in tomllib.loads(text)["fault"]:
        if word in fault["name"] + fault["file"]:
            faults.append(fault)
    return faults


def plant(faults: Sequence[Mapping[str, Any]], table: Path) -> None:
    """Plant faults and write the table, a row after each."""
    rows = ["| Fault | File | Caught | First failing test | s |", "| --- | --- | --- | --- | --- |"]
    for fault in faults:
        start = time.monotonic()
        test = first_failing_test(fault)
        seconds = time.monotonic() - start
        caught = "**no**" if test is None else "yes"
        row = f"| {fault['name']} | `{fault['file']}` | {caught} | {test or '-'} | {seconds:.0f} |"
        rows.append(row)
        table.write_text("\n".join(rows) + "\n", "utf-8")
        print(row, flush=True)


def main(table: str, word: str = "") -> None:
    """Check the faults that are asked for; unless ``table`` is ``check``, plant them."""
    # A shell has those ignore these signals that it starts with "&".
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, signal.default_int_handler)
    faults = read_faults(word)
    problems = problems_of(faults)
    if problems:
        raise SystemExit("\n".join(problems))
    if table == "check":
        print(f"{len(faults)} faults can be planted")
    else:
        plant(faults, Path(table))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("table", help="the table to write, or check")
    parser.add_argument(
        "word", nargs="?", default="", help="part of the names or files of the faults to plant"
    )
    options = parser.parse_args()
    main(options.table, options.word)
