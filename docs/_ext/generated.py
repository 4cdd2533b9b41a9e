"""Pages of the reference in reference/generated: commands, keys, columns, library, shipped cases.

They are tracked, so that they can be read without a build, which writes them too. After a change of what they show:

    python -m docs._ext.generated
"""

from __future__ import annotations

import inspect
import json
import re
import types
from collections.abc import Iterator, Mapping, Sequence
from math import hypot
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from pydantic import BeforeValidator
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined
from typer.main import get_command
from walkers.inputs.catalogue import COMMANDS, NOT_KNOWN, catalogue
from walkers.physics.units import ABSENT, ACCELERATION, AUTO, AUTO_FAR, TEMPERATURE, Kind, quantity_text

from walkers.inputs.library import Known
from walkers.inputs.numerical import measured
from walkers.inputs.resolving import SUPPLIED
from walkers.inputs.schema import CaseFile, fields_of
from walkers.inputs.toml import read_toml
from walkers.main import _program
from walkers.postprocess.analysis import analyses
from walkers.postprocess.tables import described
from walkers.sweeps.table import STATE, derived_columns, result_columns

if TYPE_CHECKING:
    from sphinx.application import Sphinx
    from sphinx.config import Config

MEANINGS = Path(__file__).with_name("meanings.toml")
FOLDER = Path(__file__).parents[1] / "reference" / "generated"

_BOUNDS = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}
_AT_REST = 1e-6  # m/s
_PAGE = re.compile(r"docs/(\S+?\.md)")


def _table(heads: Sequence[str], rows: Iterator[Sequence[str]]) -> str:
    """A table of Markdown."""
    cells = ([cell.replace("|", "\\|").replace("\n", " ") for cell in row] for row in rows)
    lines = [heads, ["---"] * len(heads), *cells]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def _described(columns: Mapping[str, tuple[str, str]]) -> str:
    return _table(["column", "unit", "meaning"], ((f"`{key}`", unit, text) for key, (unit, text) in columns.items()))


# --- keys of a case file ----------------------------------------------------------------------------------------------


def _parts(hint: Any) -> Iterator[Any]:
    """A type hint and all that is in it, what annotates it included."""
    yield hint
    for part in get_args(hint):
        yield from _parts(part)


def _tables_in(hint: Any) -> list[type]:
    return [part for part in _parts(hint) if inspect.isclass(part) and fields_of(part)]


def _expected(hint: Any) -> str:
    """What a key expects, in the words of the message that a wrong value gets."""
    if get_origin(hint) is Annotated:
        inner, *notes = get_args(hint)
        bounds = " and ".join(
            f"{sign} {getattr(one, name):g}"
            for note in notes
            for one in (note.metadata if isinstance(note, FieldInfo) else [note])
            for name, sign in _BOUNDS.items()
            if isinstance(getattr(one, name, None), (int, float))
        )
        expected = next(
            (_refusal(note) for note in notes if isinstance(note, (BeforeValidator, Kind)) and note != AUTO), None
        )
        expected = expected or _expected(inner)
        expected += ', or `"auto"`' if AUTO in notes or AUTO_FAR in notes else ""
        return f"{expected}; {bounds}" if bounds else expected
    if get_origin(hint) is Literal:
        return "one of " + ", ".join(f'`"{one}"`' for one in get_args(hint))
    if get_origin(hint) in (Union, types.UnionType):
        return " or ".join(_expected(one) for one in get_args(hint) if one is not types.NoneType)
    if get_origin(hint) in (list, tuple):
        parts = list(dict.fromkeys(_expected(one) for one in get_args(hint) if one is not ...))
        return f"a list, each {' or '.join(parts)}"
    if get_origin(hint) is dict:
        return "a table"
    words = {str: "text", bool: "true or false", int: "a whole number", float: "a plain number without a unit"}
    return words.get(hint, getattr(hint, "__name__", str(hint)))


def _refusal(validator: BeforeValidator | Kind) -> str | None:
    if isinstance(validator, Kind):
        low, high = (_in_unit(end, validator) for end in (validator.smallest, validator.largest))
        words = validator.expectation.removeprefix("expected ")
        if validator.unit == "rad" and validator.largest > 10.0:  # any angle
            return words
        either = "" if validator.sign or validator.unit == TEMPERATURE.unit else " in absolute value"
        return f"{words}; {low.split()[0]} to {high}{either}"
    try:
        validator.func(object())  # type: ignore[call-arg]
    except ValueError as error:
        return str(error).removeprefix("expected ")
    return None


def _in_unit(value: float, kind: Kind) -> str:
    """A value in the unit of its kind's example, four digits; accelerations, of which gravity is one, in m/s²."""
    number, unit = (value, kind.unit) if kind.unit == ACCELERATION.unit else quantity_text(value, kind).split()
    return f"{float(f'{float(number):.4g}'):g} {unit}"


def _default(field: FieldInfo, hint: Any) -> str:
    """The default in the units of the messages, where a value has a unit."""
    if field.default is PydanticUndefined:
        return "required" if field.is_required() else ""
    if field.default is None or fields_of(type(field.default)) or field.default in ABSENT:
        return ""
    kind = next((one for one in _parts(hint) if isinstance(one, Kind)), None)
    if isinstance(field.default, float) and kind:
        return f"`{_in_unit(field.default, kind)}`"
    return f"`{json.dumps(field.default)}`" if field.default != {} else ""


def _meanings() -> dict[str, str]:
    """What each key means, by its dotted name; clusters have the keys of dimers."""
    contents = read_toml(MEANINGS)
    found = {key: text for key, text in contents.items() if isinstance(text, str)}
    for table, entries in contents.items():
        if isinstance(entries, dict):
            found |= {f"{table}.{key}": text for key, text in entries.items()}
    return found


def _tables_of_keys() -> Iterator[tuple[str, dict[str, tuple[Any, FieldInfo]]]]:
    """The tables of a case file: heading and keys, each with its type hint and field."""

    def tables(model: type, name: str) -> Iterator[tuple[str, dict[str, tuple[Any, FieldInfo]]]]:
        hints = get_type_hints(model, include_extras=True)
        fields = {key: (hints[name], field) for key, (name, field) in fields_of(model).items()}
        yield name, {key: (hint, field) for key, (hint, field) in fields.items() if not _tables_in(hint)}
        for key, (hint, _) in fields.items():
            for inner in _tables_in(hint)[:1]:
                path = f"{name.strip('[]')}.{key}".strip(".")
                yield from tables(inner, f"[[{path}]]" if list in map(get_origin, _parts(hint)) else f"[{path}]")

    return tables(CaseFile, "")


def key_rows() -> dict[str, list[tuple[str, str, str, str]]]:
    """The keys of a case file by table: key, meaning, what it expects, default. `KeyError` if one has no meaning."""
    meanings, found = _meanings(), {}
    for name, fields in _tables_of_keys():
        bare = name.strip("[]")
        rows = []
        for key, (hint, field) in fields.items():
            path = f"{bare}.{key}".strip(".").replace("clusters.", "dimers.").replace("drive.harmonics.", "drive.")
            default = "from the library" if f"{bare}.{key}" in SUPPLIED else _default(field, hint)
            rows.append((f"`{key}`", meanings[path], _expected(hint), default))
        found[name] = rows
    return found


def _keys() -> str:
    """Keys of case files and columns of tables, read off the declarations that the program itself uses."""
    text = ["# Keys and columns\n\n## Keys of a case file\n\n`walkers show CASE` prints every value.\n"]
    listed = key_rows()
    for name, rows in listed.items():
        if name == "[[clusters]]":
            text.append("\n### [[clusters]]\n\nThe keys of `[dimers]`.\n")
        elif rows:
            text.append(
                f"\n### {name or 'Top level'}\n\n{_table(['key', 'meaning', 'expects', 'default'], iter(rows))}"
            )
    return "".join(text) + _columns()


def _columns() -> str:
    """Columns of the tables of a run and of a sweep, from where they are declared."""
    text = (
        "\n## Columns of the tables of a run\n\nThe parquet files contain the units and meanings too. A name with `*`"
    )
    text += " stands for one column per bead or contact: `rotation_1`, `rotation_2`, …\n\n"
    tables = {name: described(table) for one in analyses() for name, table in one.tables.items()}
    text += "".join(f"### {name}\n\n{_described(columns)}\n" for name, columns in tables.items())
    text += "## Columns of the table of a sweep\n\nThe first columns are the keys that vary.\n\n"
    for one in analyses():
        columns = {**one.derived, **one.columns}
        text += f"### Analysis {one.name}\n\n{_described(columns)}\n" if columns else ""
    names = [one.name for one in analyses()]
    known = {key for one in analyses() for key in one.derived} | set(result_columns(names))
    common = {key: column for key, column in derived_columns(names).items() if key not in known}
    return text + f"### All sweeps\n\n{_described({**common, **STATE})}"


def _library() -> str:
    """The library of materials and liquids with its sources, as ``walkers library`` has it."""
    text = "# Library\n\nThe library of the program. A case can override each number. `walkers library` prints it.\n"
    text += "\nSources of liquids give the temperature. Densities and moduli of a grade differ by several per cent.\n"
    found = catalogue(of_others=False)
    for kind in ("materials", "liquids", "surface pairs"):
        text += f"\n## {kind.capitalize()}\n"
        for one in (one for one in found if one.kind == kind):
            text += f"\n### {one.name}\n\n{one.text}\n\n{_sourced(one.numbers)}"
    guesses = [(one.name, one.numbers["default"]) for one in found if one.kind == "not measured"]
    rows = ((f"`{name}`", str(known.written), _range(known)) for name, known in guesses)
    return f"{text}\n## Not measured\n\n{NOT_KNOWN}\n\n{_table(['', 'default', 'range'], rows)}"


def _sourced(numbers: Mapping[str, Known]) -> str:
    linked = {key: _PAGE.sub(r"[docs/\1](../../\1)", known.source) for key, known in numbers.items()}
    rows = ((f"`{key}`", str(known.written), _range(known), linked[key]) for key, known in numbers.items())
    return _table(["", "value", "range", "source"], rows)


def _range(known: Known) -> str:
    return f"{known.range[0]} to {known.range[1]}" if known.range else ""


def _shipped() -> str:
    """Shipped cases and sweeps with their titles."""
    text = "# Shipped cases, sweeps and calibrations\n\nEvery command accepts these names instead of a file.\n"
    for kind, command in COMMANDS.items():
        names = [(one.name, one.text) for one in catalogue(of_others=False) if one.kind == kind]
        rows = [(f"`walkers {command} {name}`", title, _numerical_error(name)) for name, title in names]
        columns = 3 if kind == "cases" else 2
        heads = ["", "title", "numerical error"][:columns]
        text += f"\n## {kind.capitalize()}\n\n{_table(heads, (row[:columns] for row in rows))}"
    return text


def _numerical_error(case: str) -> str:
    """The numerical error of the velocity of a shipped case, as a share of it; nothing if it was not measured."""
    if (one := measured().get(case)) is None:
        return ""
    share = hypot(one["half_step"], one["stiffer"]) / abs(one["velocity"])
    return f"{100.0 * share:.2g} %" if abs(one["velocity"]) > _AT_REST else "below 0.001 mm/s"


_COMMANDS = """# Commands

The output of `walkers --help` and of `walkers COMMAND --help`. `walkers --install-completion` installs the
completion of commands, options, cases, sweeps and runs for your shell.

| exit status | meaning |
| --- | --- |
| 0 | done |
| 1 | a run or a check failed |
| 2 | bad input |
| 130 | interrupted with Ctrl-C |
| 143 | terminated |
| 129 | the terminal was closed |

"""


def _commands() -> str:
    """Help texts as a terminal of 80 columns shows them."""
    program = get_command(_program())
    context = program.make_context("walkers", [], resilient_parsing=True, terminal_width=80)
    text = f"{_COMMANDS}```text\n$ walkers --help\n{program.get_help(context)}\n```\n"
    for name, command in program.commands.items():
        inner = type(context)(command, context, name, terminal_width=80)  # a context for completion would offer cases
        text += f"\n## walkers {name}\n\n```text\n$ walkers {name} --help\n{command.get_help(inner)}\n```\n"
    return text


PAGES = {"commands": _commands, "tables": _keys, "library": _library, "shipped": _shipped}


def _write(_app: Sphinx | None = None, _config: Config | None = None) -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name, page in PAGES.items():
        path, text = FOLDER / f"{name}.md", page()
        if not path.exists() or path.read_text("utf-8") != text:  # else Sphinx would read it again
            path.write_text(text, "utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    """Write the pages before Sphinx looks for files."""
    app.connect("config-inited", _write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


if __name__ == "__main__":
    _write()
