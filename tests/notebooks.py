"""The tutorial's notebooks: executed anew in a folder of their own, and stored without what is this machine's.

``python -m tests.notebooks`` executes them and stores what they show in docs/tutorial.
"""

from __future__ import annotations

import ast
import tempfile
from pathlib import Path
from typing import Any

import nbformat
from nbclient import NotebookClient

SECONDS = 300
"""That a cell may take, on a machine that is busy elsewhere."""


def notebooks() -> list[Path]:
    """The notebooks of the tutorial."""
    return sorted((Path(__file__).parents[1] / "docs" / "tutorial").glob("*.ipynb"))


def executed(path: Path, folder: Path, before: str = "") -> Any:
    """A notebook, executed in a folder after other code; the first error ends it."""
    notebook = nbformat.read(path, as_version=4)
    notebook.cells.insert(0, nbformat.v4.new_code_cell(before))
    how = {"timeout": SECONDS, "startup_timeout": SECONDS, "kernel_name": "python3"}
    # The state of widgets holds all of K3D.
    NotebookClient(notebook, resources={"metadata": {"path": str(folder)}}, store_widget_state=False, **how).execute()
    del notebook.cells[0]
    return notebook


def stored(notebook: Any) -> Any:
    """The same without times of execution, and without what was printed on standard error: warnings with paths."""
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
        if cell.cell_type == "code":
            cell.outputs = [one for one in cell.outputs if one.get("name") != "stderr"]
    notebook.metadata.pop("widgets", None)
    notebook.metadata["language_info"] = {"name": "python"}
    return notebook


def tagged(notebook: Any, tag: str) -> Any:
    """What the cell with a tag gave, as a Python value."""
    cell = next(cell for cell in notebook.cells if tag in cell.metadata.get("tags", []))
    text = next(one["data"]["text/plain"] for one in cell.outputs if one["output_type"] == "execute_result")
    return ast.literal_eval(text)


if __name__ == "__main__":
    for place in notebooks():
        with tempfile.TemporaryDirectory() as empty:
            nbformat.write(stored(executed(place, Path(empty))), place)
        print(place)
