"""The program ``walkers``. Exit status: 0 done, 1 a run failed, 2 bad input, 130 interrupted, 143 or 129 terminated."""

from __future__ import annotations

import inspect
import os
import signal
import subprocess
import sys
import textwrap
import warnings
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from types import FrameType
from typing import TYPE_CHECKING, Any, NoReturn

import walkers.inputs
from walkers.commands import SECTIONS, commands
from walkers.errors import InputError, WalkersError, refused, shortened

if TYPE_CHECKING:
    from cyclopts import App
    from cyclopts.argument import Argument

_SUMMARY = "Wet granular walkers, simulated with LIGGGHTS."
_HELP = ("-h", "--help")
_HELP_ROW = ("-h, --help", "Show this message and exit.")
_OPTIONS = {
    "--library PATH": "Your own library file, before the command; default: library.toml beside the case.",
    "--version": "Show the versions and exit.",
    "--install-completion": "Install the completion of commands, options, cases, runs and sweeps for your shell.",
    **dict([_HELP_ROW]),
}
_VALUES = {"bool": "", "float": "NUMBER", "int": "INTEGER", "Path": "PATH", "str": "TEXT"}
"""For types of options, what the help calls their values."""
_LEFT, _WIDE = 24, 80
"""Largest width of the first column of the help, and width of the help."""
_LONGEST_MESSAGE = 1000
_INTERRUPTED = 130
_ENGINE_SECONDS = 10.0
"""Longest time, s, for the engine to print its version."""


class _Terminated(BaseException):
    """SIGTERM, or SIGHUP of a terminal that is closed, as an exception: engines are stopped on the way out."""

    def __init__(self, number: int) -> None:
        self.status = 128 + number
        super().__init__("terminated" if number == signal.SIGTERM else "the terminal was closed")


def _on_signal(number: int, _frame: FrameType | None) -> NoReturn:
    raise _Terminated(number)


def main(arguments: list[str] | None = None) -> NoReturn:
    """Run the program and exit."""
    signal.signal(signal.SIGTERM, _on_signal)
    if signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:  # nohup
        signal.signal(signal.SIGHUP, _on_signal)
    warnings.showwarning = lambda message, *_, **__: print(f"walkers: warning: {message}", file=sys.stderr)
    sys.exit(_status(sys.argv[1:] if arguments is None else arguments))


def _status(tokens: list[str]) -> int:
    """Run the program and return its exit status. Unexpected errors are raised."""
    words = tokens
    if words and words[0].startswith("--library="):
        words = [*words[0].split("=", 1), *words[1:]]
    try:
        if words[:1] == ["--library"]:
            if len(words) < 3:
                raise refused("--library", "expected a library file, and a command after it")
            walkers.inputs.chosen_library, words = Path(words[1]), words[2:]
        if not words or words[0] in _HELP:
            outcome: Any = print(overview())
        elif words[0] == "--version":
            outcome = print(describe_version())
        else:
            outcome = _call(words)
        sys.stdout.flush()
    except (Exception, KeyboardInterrupt, SystemExit, _Terminated) as stop:
        return _report_stop(stop, words)
    finally:
        walkers.inputs.chosen_library = None  # whoever calls `main` goes on in the same process
    return outcome if isinstance(outcome, int) else 0


def overview() -> str:
    """The help of the program: its commands below their headings."""
    rows: dict[str, list[tuple[str, str]]] = {"Options": list(_OPTIONS.items())}
    for command in commands():
        rows.setdefault(command.heading, []).append((command.name, command.summary))
    parts = ["Usage: walkers [OPTIONS] COMMAND [ARGS]...", _SUMMARY, *(_table(*item) for item in rows.items())]
    return "\n\n".join(parts)


def _table(heading: str, rows: Iterable[tuple[str, str]]) -> str:
    """Names and their meanings in two columns."""
    rows = list(rows)
    left = min(_LEFT, max(len(name) for name, _ in rows))
    lines = [f"{heading}:"]
    for name, text in rows:
        first, *more = textwrap.wrap(text, _WIDE - left - 4) or [""]
        lines += [f"  {name:{left}}  {first}"] if len(name) <= left else [f"  {name}", f"{'':{left + 4}}{first}"]
        lines += [f"{'':{left + 4}}{line}" for line in more]
    return "\n".join(lines)


def program() -> App:
    """The program. A command is imported when it is called."""
    from cyclopts import App, Parameter

    quiet: dict[str, Any] = {"print_error": False, "exit_on_error": False, "suppress_keyboard_interrupt": False}
    flags: dict[str, Any] = {"help_flags": (), "version_flags": ()}
    usual = Parameter(negative=())
    app = App("walkers", _SUMMARY, default_parameter=usual, result_action="return_value", **quiet, **flags)
    for command in commands():
        app.command(command.place, name=command.name, **({} if command.name in SECTIONS else flags))
    app.register_install_completion_command()
    return app


def _call(tokens: list[str]) -> Any:
    """What the command returns that the words name; with ``--help`` its help is printed."""
    app = program()
    names, apps, words = app.parse_commands(tokens)
    if names and (not {*words}.isdisjoint(_HELP) or (not words and names[-1] in SECTIONS)):
        return print(help_of(names, apps))
    return app(tokens)


def help_of(names: Sequence[str], apps: Sequence[App]) -> str:
    """The help of a command, from the signature and the docstring of its function."""
    app = apps[-1]
    inner = [(name, app[name].help.partition("\n")[0]) for name in app if name not in _HELP and name[0] != "-"]
    words = " COMMAND [ARGS]..." if inner else ""
    tables, usage, text = [_table("Commands", inner)] if inner else [], "", app.help
    if function := app.default_command:
        text = (inspect.getdoc(function) or "") if not inner else text
        with app.app_stack(apps):
            arguments = app.assemble_argument_collection(parse_docstring=True).filter_by(show=True)
        placed = [_described(argument) for argument in arguments if argument.field_info.is_positional]
        chosen = [_described(argument) for argument in arguments if not argument.field_info.is_positional]
        usage = "".join(f" {name}" for name, _ in placed)
        usage = f"{usage} |{words}" if inner else usage
        tables = [*([_table("Arguments", placed)] if placed else []), *tables, _table("Options", [*chosen, _HELP_ROW])]
    head = f"Usage: {' '.join(['walkers', *names])} [OPTIONS]{usage or words}"
    return "\n\n".join([head, textwrap.fill(text.partition("\n\nParameters\n")[0], _WIDE), *tables])


def _described(argument: Argument) -> tuple[str, str]:
    """Names and values of an argument or an option, and its meaning."""
    kind, default = str(argument.hint), argument.field_info.default
    values = argument.parameter.metavar or "|".join(argument.get_choices() or ())
    values = values or next((word for name, word in _VALUES.items() if name in kind), "")
    names = sorted({*argument.names} - {*argument.negatives}, key=len)
    text = argument.parameter.help or ""
    if default not in (None, False, (), argument.field_info.empty) and not hasattr(default, "__dataclass_fields__"):
        text += f" [default: {'x'.join(map(str, default)) if isinstance(default, tuple) else default}]" * bool(default)
    if argument.field_info.is_positional:
        many = argument.field_info.kind is argument.field_info.VAR_POSITIONAL
        return f"{names[0]}{'...' * many}" if argument.required or many else f"[{names[0]}]", text
    return f"{', '.join(names)} {values}".strip(), text


def describe_version() -> str:
    """Versions of the package (with its commit, if known) and of the engine, one per line."""
    from walkers.runner.binary import find_engine, version_in
    from walkers.runner.failures import EngineMissing
    from walkers.runner.provenance import PROJECT, software

    ours = software()
    package = f"{PROJECT} {ours['granular_walkers']}" + (f" (commit {ours['commit']})" if ours["commit"] else "")
    try:
        path = find_engine().path
    except EngineMissing as missing:
        return f"{package}\n{missing}"
    version, command = None, [str(path), "-log", "none", "-in", "/dev/null"]
    with TemporaryDirectory() as folder, suppress(OSError, subprocess.TimeoutExpired):  # it writes files there
        how: dict[str, Any] = {"cwd": folder, "stdin": subprocess.DEVNULL, "timeout": _ENGINE_SECONDS}
        version = version_in(subprocess.run(command, capture_output=True, check=False, **how).stdout)
    return f"{package}\n{version or 'an engine that does not name its version'}, {path}"


def _report_stop(stop: BaseException, tokens: list[str]) -> int:
    """Print why the program stopped, and return its exit status."""
    if isinstance(stop, SystemExit):
        return stop.code if isinstance(stop.code, int) else 0
    if isinstance(stop, InputError) and stop.source not in tokens:
        stop.args = (str(stop).replace(stop.source, _options_of(stop.source, tokens), 1),)
    if isinstance(stop, _Terminated):
        return _tell(str(stop), stop.status)
    statuses = {InputError: 2, WalkersError: 1, KeyboardInterrupt: _INTERRUPTED}
    if status := next((status for kind, status in statuses.items() if isinstance(stop, kind)), 0):
        return _tell(str(stop) or "interrupted", status)
    # The reader of the output, such as head, has closed it; this is not a failure.
    if isinstance(stop if isinstance(stop, OSError) else stop.__context__, BrokenPipeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # the end of the interpreter flushes it again
        return 0
    if isinstance(stop, OSError):  # a given path cannot be read or written
        return _tell(f"{stop.filename}: {stop.strerror}" if stop.filename else str(stop), 2)
    from cyclopts import CycloptsError, UnusedCliTokensError

    if not isinstance(stop, CycloptsError):
        raise stop
    from walkers.text import printable

    unused = stop.unused_tokens if isinstance(stop, UnusedCliTokensError) else None
    message = f"Unexpected: {' '.join(unused)}." if unused else str(stop)
    help_command = " ".join(["walkers", *(stop.command_chain or ()), "--help"])
    return _tell(f"{shortened(printable(message), _LONGEST_MESSAGE)} See: {help_command}", 2)


def _options_of(names: str, tokens: list[str]) -> str:
    """The options of the command for arguments of a function of the package, such as ``begin, end``."""
    _, apps, _ = program().parse_commands(tokens)
    arguments = apps[-1].assemble_argument_collection()
    options = {argument.name[2:]: argument.name for argument in arguments}
    options |= {argument.field_info.name: argument.name for argument in arguments}
    return ", ".join(options.get(name, name) for name in names.split(", "))


def _tell(message: str, status: int) -> int:
    print(f"walkers: {message}", file=sys.stderr)
    return status


if __name__ == "__main__":
    main()
