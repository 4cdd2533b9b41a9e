"""``python -m studies.literature`` prints published numbers with those of the engines and laws."""

from __future__ import annotations

import warnings
from typing import Annotated

from cyclopts import Parameter

from walkers import DEFAULT_OUT
from walkers.commands.options import JsonOption, OutOption, print_as, tell
from walkers.main import main, new_app

app = new_app("python -m studies.literature")


@app.default
def literature(
    *only: Annotated[str, Parameter(name="CHECK")],
    out: OutOption = DEFAULT_OUT,
    as_json: JsonOption = False,
) -> int:
    """Compare engine and bridge laws with published benchmarks, exact solutions and a second
    engine.

    Parameters
    ----------
    only
        benchmarks, bridges, crosscheck or experiments; default: all.
    """
    from studies.literature.checks import LITERATURE
    from walkers.inputs.bridge_laws import ExecutedLawWarning
    from walkers.second_engine.lines import as_dict, failures, lines_text, run_checks

    # The experiments have bridge laws of their own, which need not be announced.
    warnings.simplefilter("ignore", ExecutedLawWarning)
    lines = run_checks(LITERATURE, out, only, tell)
    print_as(as_json, lambda: as_dict(lines), lambda: lines_text(lines))
    return 1 if failures(lines) else 0


if __name__ == "__main__":
    main(app=app)
