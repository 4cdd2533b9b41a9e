"""The commands: the public functions of the modules of `GROUPS`, in the order of ``walkers --help``.

``check`` and ``paper`` have commands of their own. A module is imported when one of its commands is called: for
``walkers --help`` its text is read instead.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

GROUPS = {"run": "Run", "look": "Look at results", "keep": "Keep and share", "check": "Check and calibrate"}
"""The modules, with their headings in the help."""
SECTIONS = {
    "check": "Check the engine, the contact model, one case, or files. Exit status 1 if something differs.",
    "paper": "Compare with the published results: figures and numbers.",
}
"""Commands with commands of their own, in the module ``check``."""
_FUNCTION = re.compile(r'\n\ndef ([a-z]\w*)\(.*?"""(.+?)\n', re.DOTALL)
"""A public function without a decorator, and the first line of its docstring."""


class Command(NamedTuple):
    """A command: its name, its heading in the help, where it is, and its summary."""

    name: str
    heading: str
    place: str
    summary: str


def commands() -> Iterator[Command]:
    """All commands, in the order of the help."""
    for module, heading in GROUPS.items():
        place = f"{__name__}.{module}"
        if module == "check":
            yield from (Command(name, heading, f"{place}:{name}", text) for name, text in SECTIONS.items())
        text = Path(__file__).with_name(f"{module}.py").read_text("utf-8")
        for name, summary in _FUNCTION.findall(text):
            yield Command(name.strip("_"), heading, f"{place}:{name}", summary)
