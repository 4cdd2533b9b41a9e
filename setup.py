"""What pyproject.toml cannot say: a wheel carries the commit that it was built from, for the manifests of its runs."""

import os
import runpy
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

_PROVENANCE = runpy.run_path("walkers/runner/provenance.py")


class BuildWithCommit(build_py):
    """Build, and write the commit beside the packages; without git, as in a container, WALKERS_COMMIT names it."""

    def run(self) -> None:
        """Build."""
        super().run()
        if self.editable_mode:  # its runs ask git
            return
        place = Path(self.build_lib) / "walkers" / _PROVENANCE["COMMIT_NAME"]
        place.unlink(missing_ok=True)  # of an earlier build in the same folder
        if commit := os.environ.get("WALKERS_COMMIT") or _PROVENANCE["commit_of"](Path.cwd()):
            place.write_text(f"{commit}\n", encoding="utf-8")


setup(cmdclass={"build_py": BuildWithCommit})
