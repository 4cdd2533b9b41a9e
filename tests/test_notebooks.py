"""Notebooks: the values of cells, also in a JupyterLab that Debian's Chromium drives."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from base64 import b64decode
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

import walkers
from tests.conftest import wait_for
from tests.test_report import browser, walked_run  # noqa: F401
from walkers.api import Pictures
from walkers.files import read_json

EXAMPLE = Path(__file__).parents[1] / "docs" / "examples" / "01_first_walk.py"
SWEEP = """\
axes = {'drive.frequency': ['70 Hz', '80 Hz']}
sweep = walkers.sweep({'case': 'fig1b', 'axes': axes})
sweep
"""
TEXTS = {
    "import walkers\ncase = walkers.load_case('fig1b')\ncase": "chromium-coated glass",
    "run = walkers.run('pile-ci')\nrun": "clusters freed",
    "run.table('bed')": "brazil_nut",
    SWEEP: "finished",
}
"""Cells whose value is a table, and a text in it."""
ELEMENTS = {"run.plot()": "img", "sweep.figure()": "img", "run.view(height=300)": "canvas"}
"""Cells whose value is drawn, and the element of the page."""


@dataclass(frozen=True)
class Laboratory:
    """A JupyterLab: the folder with its notebooks, and its address."""

    folder: Path
    address: str


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Laboratory]:
    """A JupyterLab that runs during the tests of the module."""
    pytest.importorskip("jupyterlab", reason="`make test-slow` installs JupyterLab")
    folder = tmp_path_factory.mktemp("laboratory")
    command = [
        sys.executable,
        "-m",
        "jupyterlab",
        "--allow-root",
        "--no-browser",
        "--port=0",
        "--IdentityProvider.token=",
        "--LabApp.news_url=None",
        f"--ServerApp.root_dir={folder}",
    ]
    environment = os.environ | {
        "JUPYTER_CONFIG_DIR": str(folder / "config"),
        "JUPYTER_DATA_DIR": str(folder / "data"),
        "JUPYTER_RUNTIME_DIR": str(folder / "runtime"),
    }
    with (folder / "log").open("w") as log:
        server = subprocess.Popen(command, cwd=folder, env=environment, stdout=log, stderr=log)

    def address() -> str | None:
        """The address, as soon as the server has written its record completely."""
        for record in folder.glob("runtime/jpserver-*.json"):
            if record.read_text().endswith("}"):
                return str(read_json(record)["url"])
        return None

    yield Laboratory(folder, wait_for(address))
    server.terminate()
    server.wait()


def run_all_cells(page: Page, laboratory: Laboratory, notebook: str) -> set[str]:
    """Open a notebook and run its cells, none of which may fail.

    Returns the progress bars that were shown on the way.
    """
    contents = read_json(laboratory.folder / notebook)
    cell_types = [cell["cell_type"] for cell in contents["cells"]]
    page.goto(f"{laboratory.address}doc/tree/{notebook}")
    page.wait_for_selector(".jp-CodeCell")
    prompts = page.locator(".jp-CodeCell .jp-InputPrompt")
    # The menu runs the cells that exist.
    wait_for(lambda: prompts.count() == cell_types.count("code"))
    page.get_by_role("menuitem", name="Run", exact=True).click()
    page.get_by_text("Run All Cells", exact=True).click()
    bars = set[str]()

    def ended() -> bool:
        """Whether each cell has a number; running ones have a star."""
        bars.update(re.findall("━[━╸]*", page.locator(".jp-Notebook").inner_text()))
        return all(prompt.strip("[]: ").isdigit() for prompt in prompts.all_text_contents())

    wait_for(ended)
    assert page.locator("[data-mime-type='application/vnd.jupyter.error']").count() == 0
    return bars


def test_the_value_of_a_cell_contains_its_pictures(
    walked_run: Path,  # noqa: F811
    tmp_path: Path,
) -> None:
    """A run of walkers has two."""
    pictures = walkers.load(walked_run).plot(tmp_path)
    contents = re.findall('src="data:image/png;base64,([^"]+)"', pictures._repr_html_())
    assert len(pictures) == 2
    for content, path in zip(contents, pictures, strict=True):
        assert b64decode(content) == path.read_bytes()


def test_pictures_of_a_cell_have_the_format_of_their_file(tmp_path: Path) -> None:
    """A browser shows no SVG that is called a PNG."""
    pictures = Pictures([tmp_path / "a.png", tmp_path / "b.svg"])
    for path in pictures:
        path.write_bytes(b"")
    assert re.findall("data:([^;]+);", pictures._repr_html_()) == ["image/png", "image/svg+xml"]


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:  # noqa: F811
    """A page that is high enough for all cells: those out of sight are not drawn."""
    page = browser.new_page(viewport={"width": 1000, "height": 6000})
    yield page
    page.close()


@pytest.mark.slow
def test_an_example_of_the_gallery_runs_in_jupyterlab(laboratory: Laboratory, page: Page) -> None:
    from sphinx_gallery.notebook import python_to_jupyter_cli

    script = laboratory.folder / EXAMPLE.name
    script.write_text(EXAMPLE.read_text("utf-8"), "utf-8")
    python_to_jupyter_cli([str(script)])
    run_all_cells(page, laboratory, f"{EXAMPLE.stem}.ipynb")
    assert page.locator(".jp-OutputArea img").count() == 1


@pytest.mark.slow
def test_notebooks_show_tables_figures_beads_and_progress(
    laboratory: Laboratory, page: Page
) -> None:
    import nbformat

    cells = []
    for text in [*TEXTS, *ELEMENTS]:
        cells.append(nbformat.v4.new_code_cell(text))
    notebook = nbformat.v4.new_notebook(cells=cells)
    notebook.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3"}
    nbformat.write(notebook, laboratory.folder / "cells.ipynb")

    bars = run_all_cells(page, laboratory, "cells.ipynb")
    assert len(bars) > 1
    code_cells = page.locator(".jp-CodeCell")
    for number, text in enumerate(TEXTS.values()):
        assert text in code_cells.nth(number).locator(".jp-OutputArea").inner_text()
    for number, element in enumerate(ELEMENTS.values(), start=len(TEXTS)):
        output = code_cells.nth(number).locator(".jp-OutputArea")
        output.locator(element).first.wait_for()
