"""The tutorial's notebooks run, today as when they were stored, and give the same speeds."""

import json
import re
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest

from tests.notebooks import executed, notebooks, stored, tagged

MOST_BYTES = 1_000_000


@pytest.mark.parametrize("path", notebooks(), ids=lambda path: path.stem)
def test_a_notebook_gives_what_it_gave(path: Path, tmp_path: Path) -> None:
    """Executed anew, without an error. Speeds: to 0.1 %, as other machines round otherwise, or 0.01 mm/s."""
    now, before = executed(path, tmp_path), nbformat.read(path, as_version=4)
    assert tagged(now, "velocity") == pytest.approx(tagged(before, "velocity"), rel=1e-3, abs=1e-5)
    kinds = [[output["output_type"] for output in cell.get("outputs", [])] for cell in stored(now).cells]
    assert kinds == [[output["output_type"] for output in cell.get("outputs", [])] for cell in before.cells]
    # Progress is shown while the engine runs, and a line is left of it.
    assert re.search(r"(fig1b|fig3\S*): done", json.dumps(now.cells[1]))


def test_stored_notebooks_are_small_and_of_no_machine() -> None:
    for path in notebooks():
        text = path.read_text("utf-8")
        assert len(text) < MOST_BYTES
        words = re.sub(r"[A-Za-z0-9+/=\\n]{200,}", "", text)  # pictures
        assert not re.search(r"(?<![\w.)\]])/(tmp|home|root|work|usr|var)/", words)
        assert all(cell.get("execution_count") for cell in json.loads(text)["cells"] if cell["cell_type"] == "code")


def test_the_program_needs_no_notebook() -> None:
    """Neither the public names nor a report's tables import IPython; K3D, for scenes, does so itself."""
    names = "walkers, walkers.reports, walkers.postprocess.report.run, walkers.sweeps.report"
    told = "print('IPython' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", f"import sys, {names}; {told}"], capture_output=True, text=True, check=True
    )
    assert done.stdout == "False\n"
