"""The same numbers on every processor: elementary functions, bridge tables, and what notices others."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy._core._multiarray_umath import __cpu_dispatch__  # type: ignore[attr-defined]
from scipy.special import hyp2f1

from tests.conftest import brief_pile, call, open_run
from walkers.inputs.reading import load_case, shipped
from walkers.physics import portable
from walkers.physics.laplace import _branch, _Family
from walkers.physics.reynolds import _logarithmic_slope
from walkers.runner.binary import find_engine
from walkers.runner.manifest import read_manifest
from walkers.runner.run_directory import case_of
from walkers.runs.comparison import Side, compare_runs
from walkers.runs.making import BridgeTablesDiffer
from walkers.templates.deck import BRIDGES_NAME, bridge_tables_digest, render_deck

_LAST_PLACES = 2
"""Largest difference from NumPy's functions, in units in the last place."""


def _last_places(found: np.ndarray, expected: np.ndarray) -> float:
    return float(np.max(np.abs(found - expected) / np.spacing(np.abs(expected))))


def test_sine_and_cosine_agree_with_numpy() -> None:
    angles = np.random.default_rng(1).uniform(-1.5, 1.5, 20_000)
    sines, cosines = portable.sine_and_cosine(angles)
    assert _last_places(sines, np.sin(angles)) <= _LAST_PLACES
    assert _last_places(cosines, np.cos(angles)) <= _LAST_PLACES


def test_angles_of_many_turns_are_reduced() -> None:
    angles = np.random.default_rng(2).uniform(-1e5, 1e5, 20_000)
    sines, cosines = portable.sine_and_cosine(angles)
    np.testing.assert_allclose(sines, np.sin(angles), rtol=0.0, atol=3e-16)
    np.testing.assert_allclose(cosines, np.cos(angles), rtol=0.0, atol=3e-16)


def test_logarithms_agree_with_numpy() -> None:
    numbers = 10.0 ** np.random.default_rng(3).uniform(-15.0, 15.0, 20_000)
    assert _last_places(portable.logarithm(numbers), np.log(numbers)) <= _LAST_PLACES
    assert _last_places(portable.logarithm_of_one_plus(numbers), np.log1p(numbers)) <= _LAST_PLACES


def test_exponentials_and_powers_agree_with_numpy() -> None:
    numbers = np.random.default_rng(4).uniform(-300.0, 300.0, 20_000)
    assert _last_places(portable.exponential(numbers), np.exp(numbers)) <= _LAST_PLACES
    bases = 10.0 ** (numbers / 25.0)
    np.testing.assert_allclose(portable.power(bases, -0.53), bases**-0.53, rtol=5e-15)
    assert portable.power(0.0, 0.5) == 0.0


@pytest.mark.parametrize("number", [1e-13, 8.0, 2.7e11])
def test_cube_roots(number: float) -> None:
    assert portable.cube_root(number) ** 3 == pytest.approx(number, rel=1e-15)


def test_linear_systems_need_pivots() -> None:
    matrix = np.array([[0.0, 2.0, 1.0], [1.0, 0.0, 0.0], [3.0, 0.0, 4.0]])
    solution = np.array([5.0, -1.0, 2.0])
    assert portable.solve_linear(matrix[None], (matrix @ solution)[None])[0] == pytest.approx(
        solution, rel=1e-15
    )


def test_quadrature_integrates_polynomials_exactly() -> None:
    nodes, weights = portable.gauss_legendre(5)
    for degree in range(10):  # exact up to twice the number of nodes minus one
        exact = 2.0 / (degree + 1.0) if degree % 2 == 0 else 0.0
        assert (weights * nodes**degree).sum() == pytest.approx(exact, abs=1e-15)


def test_the_slope_of_the_pressure_is_that_of_the_hypergeometric_function() -> None:
    """L = 1 - a b y F(a + 1, b + 1; 3; -y)/F(a, b; 2; -y) with a b = 3/2, across the change of series at y = 1."""
    a, b = 2.0 - np.sqrt(2.5), 2.0 + np.sqrt(2.5)
    y = 10.0 ** np.linspace(-6.0, 6.0, 2001)
    expected = 1.0 - a * b * y * hyp2f1(a + 1.0, b + 1.0, 3.0, -y) / hyp2f1(a, b, 2.0, -y)
    np.testing.assert_allclose(_logarithmic_slope(y), expected, rtol=0.0, atol=3e-15)


@pytest.mark.parametrize("curvatures", [(1.0, 0.0), (0.9, 0.5)], ids=["plane", "spheres"])
def test_derivatives_of_a_bridge_are_those_of_its_residuals(
    curvatures: tuple[float, float],
) -> None:
    """Against central differences, for all bridges from contact to rupture (no, convex and concave pressure)."""
    family = _Family(curvatures, (0.3, 0.6))
    bridges = _branch(family)[1]
    _, jacobian = family.misfit(bridges)
    for column in range(5):
        step = np.zeros(5)
        step[column] = 1e-6
        slopes = (family.misfit(bridges + step)[0] - family.misfit(bridges - step)[0]) / 2e-6
        np.testing.assert_allclose(jacobian[:, :, column], slopes, rtol=1e-7, atol=1e-8)


_DIGESTS = """
import json, sys
from walkers import load_case
from walkers.templates.bridge_tables import BridgeTable
from walkers.templates.deck import bridge_tables_digest

def all_bits(table):
    return f"{table.curve.rupture.hex()} {table.gaps.tobytes().hex()} {table.rows.tobytes().hex()}"

BridgeTable.text = all_bits  # tables have twelve digits, which would hide most differences
print(json.dumps({name: bridge_tables_digest(load_case(name)) for name in sys.argv[1:]}))
"""


def _digests_of_bits(names: Sequence[str], environment: Mapping[str, str]) -> dict[str, str]:
    """Digests of all bits of the bridge tables of shipped cases, made by a process with this environment."""
    command = [sys.executable, "-W", "ignore", "-c", _DIGESTS, *names]
    made = subprocess.run(
        command, env=os.environ | environment, capture_output=True, text=True, check=False
    )
    assert made.returncode == 0, made.stderr
    digests: dict[str, str] = json.loads(made.stdout)
    return digests


_WIDEST_VECTORS = [name for name in __cpu_dispatch__ if "512" in name or name == "X86_V4"]


@pytest.mark.parametrize(
    ("features", "names"),
    [(__cpu_dispatch__, shipped("case")), (_WIDEST_VECTORS, ["fig1b", "fig4b"])],
    ids=["all vector instructions", "AVX-512"],
)
def test_bridge_tables_do_not_depend_on_the_processor(
    features: list[str], names: list[str], tmp_path: Path
) -> None:
    """Tables that are made without a cache in a process in which these vector instructions are switched off."""
    switched_off = {
        "NPY_DISABLE_CPU_FEATURES": " ".join(features),
        "OPENBLAS_CORETYPE": "Nehalem",
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-AVX2_Usable,-FMA,-FMA_Usable,-AVX512F,-AVX512F_Usable",
        "XDG_CACHE_HOME": str(tmp_path),
    }
    assert _digests_of_bits(names, switched_off) == _digests_of_bits(names, {})


def test_the_processor_would_matter_without_portable_functions() -> None:
    """The switches of the test above reach NumPy: its own powers have other bits without them, on most processors."""
    script = (
        "import numpy as np; print(np.power(np.linspace(0.1, 9.0, 10_000), 1.7).tobytes().hex())"
    )
    bits = set()
    for features in ("", " ".join(__cpu_dispatch__)):
        environment = os.environ | {"NPY_DISABLE_CPU_FEATURES": features}
        command = [sys.executable, "-W", "ignore", "-c", script]
        bits.add(
            subprocess.run(
                command, env=environment, capture_output=True, text=True, check=True
            ).stdout
        )
    if len(bits) == 1:
        pytest.skip("this processor has one version of the power function")


def test_the_manifest_has_the_digest_of_the_bridge_tables(pile_run: Path) -> None:
    segment = next(pile_run.glob("segments/0000"))
    case = case_of(pile_run)
    assert read_manifest(pile_run)["bridge_tables"] == bridge_tables_digest(case)
    assert render_deck(case).files[BRIDGES_NAME] == (segment / BRIDGES_NAME).read_text("utf-8")


def test_a_comparison_names_the_run_with_other_bridge_tables(in_folder: Path) -> None:
    call("run", "fig1b", "--set", "run.cycles=4", check=True)
    (run,) = Path("runs").glob("fig1b-*[0-9a-f]")
    case = load_case("fig1b", {"run.cycles": 4})
    sides = [Side("mine", case, run), Side("yours", case, run)]
    assert "bridge tables" not in compare_runs(*sides).text
    manifest = read_manifest(run) | {"bridge_tables": "0" * 64}
    (run / "manifest.json").write_text(json.dumps(manifest))
    text = compare_runs(*sides).text
    assert "mine: its bridge tables are not those of this program" in text


def test_a_run_does_not_continue_with_other_bridge_tables(tmp_path: Path) -> None:
    """The second segment is refused, and the first one is kept."""
    case = brief_pile(duration="0.04 s", segment="0.02 s")
    with open_run(case, find_engine(), tmp_path) as opened:
        opened.make()
    (first,) = tmp_path.glob("*.incomplete/segments/0000")
    others = sorted(first.parent.iterdir())[1:]
    for segment in others:
        for file in segment.iterdir():
            file.unlink()
        segment.rmdir()
    tables = first / BRIDGES_NAME
    tables.write_text(tables.read_text("utf-8").replace("1", "2", 1), encoding="utf-8")
    refusal = pytest.raises(BridgeTablesDiffer, match=r"segments/0000/bridges.txt has other forces")
    with refusal, open_run(case, find_engine(), tmp_path) as opened:
        opened.make()
    assert (first / "beads.bin").is_file()
    assert not list(first.parent.glob("0001*"))
