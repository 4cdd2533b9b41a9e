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
    """Draw the paper's figures with our results, and write a table of its facts.

    Missing runs are made first.

    Parameters
    ----------
    to
        Folder to write the figures to.
    only
        Draw only the figure with this name, or comparison. Repeatable.
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
    for parameters, (agree, number) in drawn.counts.items():
        print(f"{agree} of {number} facts agree: {parameters}")
    return 1 if drawn.failures or drawn.left_out else 0


if __name__ == "__main__":
    main(app=app)
