"""Notebooks in a JupyterLab, driven by Debian's Chromium: an example of the gallery, and the values of cells."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from base64 import b64decode
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

import walkers
from tests.conftest import wait_for
from tests.test_report import browser, walked_run  # noqa: F401
from walkers.api import Pictures
from walkers.files import read_json

EXAMPLE = Path(__file__).parents[1] / "docs" / "examples" / "01_first_walk.py"
CELLS = {
    "import walkers\ncase = walkers.load_case('fig1b')\ncase": "chromium-coated glass",
    "run = walkers.run('pile-ci')\nrun": "clusters freed",
    "run.table('bed')": "brazil_nut",
    "sweep = walkers.sweep({'case': 'fig1b', 'axes': {'drive.frequency': ['70 Hz', '80 Hz']}})\nsweep": "finished",
    "run.plot()": "<img>",
    "sweep.figure()": "<img>",
    "run.view(height=300)": "<canvas>",
}
"""Cells, and what they show: a word of a table, or an element that is drawn."""


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, str]]:
    """The folder of a JupyterLab, and its address."""
    folder = tmp_path_factory.mktemp("laboratory")
    options = [
        "--allow-root",
        "--no-browser",
        "--port=0",
        "--IdentityProvider.token=",
        "--LabApp.news_url=None",
    ]
    places = {f"JUPYTER_{name}_DIR": str(folder / name) for name in ("CONFIG", "DATA", "RUNTIME")}
    command = [sys.executable, "-m", "jupyterlab", *options, f"--ServerApp.root_dir={folder}"]
    with (folder / "log").open("w") as log:
        server = subprocess.Popen(
            command, cwd=folder, env=os.environ | places, stdout=log, stderr=log
        )
    record = wait_for(lambda: next(folder.glob("RUNTIME/jpserver-*.json"), None))
    yield folder, wait_for(lambda: record.read_text().endswith("}") and read_json(record)["url"])
    server.terminate()
    server.wait()


def run_all(page: Page, address: str, notebook: Path) -> set[str]:
    """Open a notebook and run its cells, none of which may fail; the progress bars on the way."""
    cells = sum(cell["cell_type"] == "code" for cell in read_json(notebook)["cells"])
    page.goto(f"{address}doc/tree/{notebook.name}")
    page.wait_for_selector(".jp-CodeCell")
    prompts = page.locator(".jp-CodeCell .jp-InputPrompt")
    wait_for(lambda: prompts.count() == cells)  # the menu runs the cells that exist
    page.get_by_role("menuitem", name="Run", exact=True).click()
    page.get_by_text("Run All Cells", exact=True).click()
    bars = set[str]()

    def ended() -> bool:
        bars.update(re.findall("━[━─]+", page.locator(".jp-Notebook").inner_text()))
        numbers = [text.strip("[]: ") for text in prompts.all_text_contents()]
        return all(number.isdigit() for number in numbers)

    wait_for(ended)
    assert page.locator("[data-mime-type='application/vnd.jupyter.error']").count() == 0
    return bars


def test_the_value_of_a_cell_contains_its_pictures(walked_run: Path, tmp_path: Path) -> None:  # noqa: F811
    pictures = walkers.load(walked_run).plot(tmp_path)
    contents = re.findall('src="data:image/png;base64,([^"]+)"', pictures._repr_html_())
    assert [b64decode(content) for content in contents] == [path.read_bytes() for path in pictures]
    assert len(pictures) == 2


def test_pictures_of_a_cell_have_the_format_of_their_file(tmp_path: Path) -> None:
    """A browser shows no SVG that is called a PNG."""
    pictures = Pictures(tmp_path / name for name in ("a.png", "b.svg"))
    for path in pictures:
        path.write_bytes(b"")
    assert re.findall("data:([^;]+);", pictures._repr_html_()) == ["image/png", "image/svg+xml"]


@pytest.mark.slow
def test_notebooks_run_in_jupyterlab_and_show_tables_figures_and_beads(
    laboratory: tuple[Path, str],
    browser: Browser,  # noqa: F811
) -> None:
    import nbformat
    from sphinx_gallery.notebook import python_to_jupyter_cli

    folder, address = laboratory
    (folder / EXAMPLE.name).write_text(EXAMPLE.read_text("utf-8"), "utf-8")
    python_to_jupyter_cli([str(folder / EXAMPLE.name)])
    cells = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(text) for text in CELLS])
    cells.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3"}
    nbformat.write(cells, folder / "cells.ipynb")

    page = browser.new_page(
        viewport={"width": 1000, "height": 6000}
    )  # cells out of sight are not drawn
    run_all(page, address, folder / f"{EXAMPLE.stem}.ipynb")
    assert page.locator(".jp-OutputArea img").count() == 1
    assert len(run_all(page, address, folder / "cells.ipynb")) > 1
    for cell, shown in zip(page.locator(".jp-CodeCell").all(), CELLS.values(), strict=True):
        output = cell.locator(".jp-OutputArea")
        if shown.startswith("<"):
            output.locator(shown.strip("<>")).first.wait_for()
        else:
            assert shown in output.inner_text()
