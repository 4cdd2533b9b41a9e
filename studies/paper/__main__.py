"""``python -m studies.paper`` makes the figures of the paper and the comparison with it."""

from __future__ import annotations

from pathlib import Path

from studies.paper.make import FORMATS, make_figures
from walkers import DEFAULT_OUT
from walkers.commands.options import (
    EngineOption,
    FormatsOption,
    JobsOption,
    OutOption,
    print_lines,
    tell,
)
from walkers.main import main, new_app
from walkers.sweeps.scheduler import SweepOptions

app = new_app("python -m studies.paper")


@app.default
def paper(  # noqa: PLR0913
    *,
    out: OutOption = DEFAULT_OUT,
    to: Path = Path("figures"),
    only: list[str] | None = None,
    formats: FormatsOption = None,
    jobs: JobsOption = None,
    engine: EngineOption = None,
) -> int:
    """Draw the paper's figures with our results, and compare the results with the paper's facts.

    Missing runs are made first. The comparison is a table of facts that the paper states, with our
    results beside them. The exit status is 1 if a run failed or a figure is left out.

    Parameters
    ----------
    to
        Folder to write the figures to.
    only
        Name of a figure, or the word comparison for the table: only this is made. Repeatable.
    """
    drawn = make_figures(
        out,
        to,
        SweepOptions(jobs),
        only=only or (),
        formats=formats or FORMATS,
        engine=engine,
        progress=True,
    )
    for sweep, failures in drawn.failures.items():
        for failure in failures:
            tell(f"{sweep}: point {failure.point}, {failure.run}: {failure.message}")
    for figure, reason in drawn.left_out.items():
        tell(f"{figure} is left out: {reason}")
    print_lines(drawn.files)
    for parameter_set, (agree, number) in drawn.counts.items():
        print(f"{agree} of {number} facts agree: {parameter_set}")
    return 1 if drawn.failures or drawn.left_out else 0


if __name__ == "__main__":
    main(app=app)
