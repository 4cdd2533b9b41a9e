"""What pyproject.toml cannot say: sdists and wheels carry their commit, for the manifests of runs."""

import os
import runpy
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

_PROVENANCE = runpy.run_path("walkers/runner/provenance.py")


def _write_commit(root: Path) -> None:
    """Write it beside the packages; without git `WALKERS_COMMIT` names it, or the sdist that is unpacked here."""
    ours, place = Path("walkers", _PROVENANCE["COMMIT_NAME"]), root / "walkers" / _PROVENANCE["COMMIT_NAME"]
    commit = os.environ.get("WALKERS_COMMIT") or _PROVENANCE["commit_of"](Path.cwd())
    if not commit and ours.is_file():
        commit = ours.read_text("utf-8").strip()
    place.unlink(missing_ok=True)  # of an earlier build in the same folder
    if commit:
        place.write_text(f"{commit}\n", encoding="utf-8")


class BuildWithCommit(build_py):
    """A wheel; an editable install asks git."""

    def run(self) -> None:
        """Build."""
        super().run()
        if not self.editable_mode:
            _write_commit(Path(self.build_lib))


class SourceWithCommit(sdist):
    """A source distribution."""

    def make_release_tree(self, base_dir: str, files: list[str]) -> None:
        """Lay out what is packed."""
        super().make_release_tree(base_dir, files)
        _write_commit(Path(base_dir))


setup(cmdclass={"build_py": BuildWithCommit, "sdist": SourceWithCommit})
