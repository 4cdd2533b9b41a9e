"""The program ``walkers``. Exit status: 0 done, 1 a run failed, 2 bad input, 130 interrupted, 143 terminated."""

from __future__ import annotations

import signal
import sys
import warnings
from types import FrameType
from typing import Any, NoReturn, TextIO

import typer

from walkers.commands import (
    audit,
    calibrate,
    climb,
    deck,
    figures,
    ingredients,
    plot,
    render,
    result,
    run,
    show,
    status,
    sweep,
    table,
    theory,
    vtk,
)

app = typer.Typer(
    name="walkers",
    help="Wet granular walkers, simulated with LIGGGHTS.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
for command in (
    show,
    deck,
    run,
    result,
    plot,
    vtk,
    render,
    theory,
    sweep,
    status,
    table,
    climb,
    figures,
    ingredients,
    calibrate,
    audit,
):
    app.command(name=command.__name__.rsplit(".", 1)[-1])(command.command)


INTERRUPTED = 130


class _Terminated(BaseException):
    """SIGTERM, as an exception so that engines are stopped on the way out."""


def _on_sigterm(_number: int, _frame: FrameType | None) -> NoReturn:
    raise _Terminated


def main(arguments: list[str] | None = None) -> NoReturn:
    """Run the program and exit."""
    signal.signal(signal.SIGTERM, _on_sigterm)
    warnings.showwarning = _show_warning
    sys.exit(_status(arguments))


def _show_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    del category, filename, lineno, file, line
    print(f"walkers: warning: {message}", file=sys.stderr)


def _status(arguments: list[str] | None) -> int:
    from inputs.errors import InputError, WalkersError

    try:
        outcome: Any = app(arguments, standalone_mode=False)
    except (WalkersError, KeyboardInterrupt, typer.Abort, _Terminated) as stop:
        statuses = ((InputError, 2), (WalkersError, 1), (_Terminated, 143), (BaseException, INTERRUPTED))
        status = next(status for kind, status in statuses if isinstance(stop, kind))
        return _tell(str(stop) or {143: "terminated", INTERRUPTED: "interrupted"}[status], status)
    except BrokenPipeError:  # the reader of our output has had enough
        sys.stderr.close()
        return 0
    except OSError as error:  # a path that was given cannot be read or written
        return _tell(f"{error.filename}: {error.strerror}" if error.filename else str(error), 2)
    except Exception as error:
        # Typer's usage errors know how to show themselves and which status they are.
        if not hasattr(error, "show") or not hasattr(error, "exit_code"):
            raise
        error.show()
        return int(error.exit_code)
    if outcome == INTERRUPTED:  # typer turns Ctrl-C into a status
        return _tell("interrupted", INTERRUPTED)
    return outcome if isinstance(outcome, int) else 0


def _tell(message: str, status: int) -> int:
    print(f"walkers: {message}", file=sys.stderr)
    return status


if __name__ == "__main__":
    main()
