"""The program ``walkers``. Exit status: 0 done, 1 a run failed, 2 bad input, 130 interrupted, 143 or 129 terminated."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
import textwrap
import warnings
from collections.abc import Mapping
from contextlib import suppress
from datetime import UTC, datetime
from itertools import groupby
from tempfile import TemporaryDirectory
from types import FrameType
from typing import TYPE_CHECKING, Any, NoReturn

from walkers.commands import ALL_COMMANDS
from walkers.errors import InputError, WalkersError, shortened
from walkers.text import printable

if TYPE_CHECKING:
    from cyclopts import App
    from cyclopts.help import HelpPanel

_SUMMARY = "Wet granular walkers, simulated with LIGGGHTS."
_OPTIONS = {
    "--help, -h": "Display this message and exit.",
    "--version": "Show the versions of the package (with its commit, if known) and of the engine, and exit.",
    "--install-completion": "Install the completion of commands, options, cases, runs and sweeps for your shell.",
}
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


def main(arguments: list[str] | None = None, app: App | None = None) -> NoReturn:
    """Run the program, or another app of `new_app`, with the arguments of the command line, and exit."""
    _prepare_streams()
    os.environ["MPLBACKEND"] = (
        "agg"  # the program opens no windows, and matplotlib refuses unknown names
    )
    signal.signal(signal.SIGTERM, _on_signal)
    if signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:  # nohup
        signal.signal(signal.SIGHUP, _on_signal)
    warnings.showwarning = lambda message, *_, **__: print(
        f"walkers: warning: {message}", file=sys.stderr
    )
    sys.exit(_status(sys.argv[1:] if arguments is None else arguments, app))


def _prepare_streams() -> None:
    """Make output possible where it was closed, and where its encoding lacks letters such as Γ and ²."""
    for descriptor in (0, 1, 2):
        try:
            os.fstat(descriptor)
        except OSError:  # otherwise the next file to be opened, such as a lock, would be the output
            os.open(os.devnull, os.O_RDWR)  # which takes the lowest free number
    if sys.stdout is None:
        sys.stdout = open(1, "w", encoding="utf-8")  # noqa: SIM115
    if sys.stderr is None:
        sys.stderr = open(2, "w", encoding="utf-8")  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and stream.errors == "strict":
            stream.reconfigure(errors="backslashreplace")


def _status(tokens: list[str], app: App | None = None) -> int:
    """Run the program, or another app, and return its exit status. Unexpected errors are raised."""
    try:
        outcome = None
        if app is None and tokens in ([], ["--help"], ["-h"]):
            print_help()
        else:
            app = app or program()
            outcome = app(tokens)
        sys.stdout.flush()
    except (Exception, KeyboardInterrupt, SystemExit, _Terminated) as stop:
        return _report_stop(stop, tokens, app or program())
    return outcome if isinstance(outcome, int) else 0


def print_help() -> None:
    """Print the commands and options of the program. Without cyclopts and rich this takes a tenth of the time."""
    print(f"Usage: walkers COMMAND [OPTIONS]\n\n{_SUMMARY}")
    for heading, group in groupby(ALL_COMMANDS, lambda command: command.heading):
        _print_panel(heading, {command.name: command.summary for command in group})
    _print_panel("Options", _OPTIONS)


def _print_panel(title: str, meanings: Mapping[str, str]) -> None:
    """Print names and their meanings in two columns below a heading."""
    if not meanings:
        return
    left = min(_LEFT, max(map(len, meanings)))
    print(f"\n{title}:")
    for name, meaning in meanings.items():
        first, *more = textwrap.wrap(meaning, _WIDE - left - 4) or [""]
        lines = (
            [f"  {name:{left}}  {first}"]
            if len(name) <= left
            else [f"  {name}", f"{'':{left + 4}}{first}"]
        )
        print("\n".join([*lines, *(f"{'':{left + 4}}{line}" for line in more)]))


class _PlainHelp:
    """Help of a command in plain text."""

    def __call__(self, _console: object, _options: object, panel: HelpPanel) -> None:
        meanings = {}
        for entry in panel.entries:
            default = f" [default: {entry.default}]" * (entry.default not in (None, "False"))
            meanings[", ".join(entry.display_labels_with_metavar)] = (
                _plain(entry.description) + default
            )
        _print_panel(str(panel.title), meanings)

    def render_usage(self, _console: object, _options: object, usage: Any) -> None:
        print(f"Usage: {_plain(usage)}")

    def render_description(self, _console: object, _options: object, description: Any) -> None:
        print(f"\n{textwrap.fill(_plain(description), _WIDE)}")


def _plain(text: Any) -> str:
    return str(getattr(text, "primary_renderable", text)).strip()


def program() -> App:
    """The program. A command is imported when it is called."""
    app = new_app("walkers", _SUMMARY)
    for command in ALL_COMMANDS:
        app.command(command.place, name=command.name, help=command.summary)
    app.command(print_version, name="--version")
    app.register_install_completion_command(help=_OPTIONS["--install-completion"])
    return app


def new_app(name: str, summary: str | None = None) -> App:
    """An app with help in plain text, which leaves the messages about errors to `main`.

    Parameters
    ----------
    name
        How the app is called, such as ``walkers``; messages and help name it so.
    summary
        The first line of its help; default: that of its default command.
    """
    from cyclopts import App, Parameter

    formatter: Any = _PlainHelp()  # its unused arguments have names of their own
    return App(
        name,
        summary,
        version_flags=(),
        default_parameter=Parameter(negative=()),
        result_action="return_value",
        print_error=False,
        exit_on_error=False,
        suppress_keyboard_interrupt=False,
        help_formatter=formatter,
        help_format="plaintext",
        group_parameters="Options",
    )


def print_version() -> None:
    """Show the versions of the package (with its commit, if known) and of the engine, and exit."""
    from walkers.runner.binary import find_engine, version_in
    from walkers.runner.failures import EngineMissing
    from walkers.runner.provenance import PROJECT, software

    ours = software()
    package = f"{PROJECT} {ours['granular_walkers']}" + (
        f" (commit {ours['commit']})" if ours["commit"] else ""
    )
    print(package)
    try:
        path = find_engine().path
    except EngineMissing as missing:
        print(missing)
        return
    version, command = None, [str(path), "-log", "none", "-in", "/dev/null"]
    with (
        TemporaryDirectory() as folder,
        suppress(OSError, subprocess.TimeoutExpired),
    ):  # it writes files there
        how: dict[str, Any] = {
            "cwd": folder,
            "stdin": subprocess.DEVNULL,
            "timeout": _ENGINE_SECONDS,
        }
        version = version_in(
            subprocess.run(command, capture_output=True, check=False, **how).stdout
        )
    print(f"{version or 'an engine that does not name its version'}, {path}")


def _report_stop(stop: BaseException, tokens: list[str], app: App) -> int:
    from cyclopts import CycloptsError, MissingArgumentError, UnusedCliTokensError

    if isinstance(stop, SystemExit):
        return stop.code if isinstance(stop.code, int) else 0
    if isinstance(stop, InputError):
        stop = stop.renamed(
            lambda source: source if source in tokens else _options_of(source, tokens, app)
        )
    if isinstance(stop, _Terminated):
        return _tell(str(stop), stop.status)
    statuses = {InputError: 2, WalkersError: 1, KeyboardInterrupt: _INTERRUPTED}
    if status := next((status for kind, status in statuses.items() if isinstance(stop, kind)), 0):
        return _tell(str(stop) or "interrupted", status)
    # The reader of the output, such as head, has closed it; this is not a failure.
    if isinstance(stop if isinstance(stop, OSError) else stop.__context__, BrokenPipeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # the end of the interpreter flushes it again
        return 0
    if message := _message_of_system(stop):
        return _tell(message, 2)
    if not isinstance(stop, CycloptsError):
        raise stop
    unused = stop.unused_tokens if isinstance(stop, UnusedCliTokensError) else None
    message = f"Unexpected: {' '.join(unused)}." if unused else str(stop)
    if (
        isinstance(stop, MissingArgumentError)
        and stop.argument
        and (choices := stop.argument.get_choices())
    ):
        message += f" Choose from: {', '.join(choices)}."
    help_command = " ".join([*app.name, *(stop.command_chain or ()), "--help"])
    return _tell(f"{shortened(printable(message), _LONGEST_MESSAGE)} See: {help_command}", 2)


def _message_of_system(stop: BaseException) -> str:
    """Message about a path that cannot be read or written, or about an impossible clock; empty for other errors."""
    if isinstance(stop, OSError):
        return f"{stop.filename}: {stop.strerror}" if stop.filename else str(stop)
    if isinstance(stop, OverflowError) and _clock_is_wrong():
        return f"the clock of this machine is wrong ({stop})"
    return ""


def _clock_is_wrong() -> bool:
    """Whether the time of this machine is no date, as after the failure of its battery."""
    try:
        datetime.now(UTC)
    except (OverflowError, ValueError, OSError):
        return True
    return False


def _options_of(names: str, tokens: list[str], app: App) -> str:
    """The options of the command for arguments of a function of the package, such as ``begin, end``."""
    _, apps, _ = app.parse_commands(tokens)
    arguments = apps[-1].assemble_argument_collection()
    options = {argument.name[2:]: argument.name for argument in arguments}
    options |= {argument.field_info.name: argument.name for argument in arguments}
    return ", ".join(options.get(name, name) for name in names.split(", "))


def _tell(message: str, status: int) -> int:
    print(f"walkers: {message}", file=sys.stderr)
    return status


if __name__ == "__main__":
    main()
