"""The same numbers on every processor: elementary functions, bridge tables, and what notices."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy._core._multiarray_umath import __cpu_dispatch__  # type: ignore[attr-defined]
from scipy.special import hyp2f1

from tests.conftest import brief_pile, open_run
from walkers import run as run_case
from walkers.arrays import FloatArray
from walkers.inputs.reading import load_case, shipped
from walkers.physics import portable
from walkers.physics.laplace import _branch, _Family
from walkers.physics.reynolds import _logarithmic_slope
from walkers.runner.binary import find_engine
from walkers.runner.manifest import read_manifest
from walkers.runner.run_directory import case_of
from walkers.runs.comparison import ComparedRun, compare_runs
from walkers.runs.making import BridgeTablesDiffer
from walkers.templates.deck import BRIDGES_NAME, bridge_tables_digest, render_deck

# --- elementary functions ---------------------------------------------------------------------


def assert_same_to_two_last_places(values: FloatArray, expected: FloatArray) -> None:
    """Values differ from NumPy's by at most two units in the last place."""
    units = np.spacing(np.abs(expected))
    assert np.max(np.abs(values - expected) / units) <= 2.0


def test_sine_and_cosine_agree_with_numpy() -> None:
    angles = np.random.default_rng(1).uniform(-1.5, 1.5, 20_000)
    sines, cosines = portable.sine_and_cosine(angles)
    assert_same_to_two_last_places(sines, np.sin(angles))
    assert_same_to_two_last_places(cosines, np.cos(angles))


def test_angles_of_many_turns_are_reduced() -> None:
    angles = np.random.default_rng(2).uniform(-1e5, 1e5, 20_000)
    sines, cosines = portable.sine_and_cosine(angles)
    np.testing.assert_allclose(sines, np.sin(angles), rtol=0.0, atol=3e-16)
    np.testing.assert_allclose(cosines, np.cos(angles), rtol=0.0, atol=3e-16)


def test_logarithms_agree_with_numpy() -> None:
    numbers = 10.0 ** np.random.default_rng(3).uniform(-15.0, 15.0, 20_000)
    assert_same_to_two_last_places(portable.logarithm(numbers), np.log(numbers))
    assert_same_to_two_last_places(portable.logarithm_of_one_plus(numbers), np.log1p(numbers))


def test_exponentials_agree_with_numpy() -> None:
    numbers = np.random.default_rng(4).uniform(-300.0, 300.0, 20_000)
    assert_same_to_two_last_places(portable.exponential(numbers), np.exp(numbers))


def test_powers_agree_with_numpy() -> None:
    """They are exponentials of logarithms, and so have larger errors than either."""
    bases = 10.0 ** np.random.default_rng(4).uniform(-12.0, 12.0, 20_000)
    np.testing.assert_allclose(portable.power(bases, -0.53), bases**-0.53, rtol=5e-15)


def test_a_power_of_zero_is_zero() -> None:
    assert portable.power(0.0, 0.5) == 0.0


@pytest.mark.parametrize("number", [1e-13, 8.0, 2.7e11])
def test_cube_roots(number: float) -> None:
    assert portable.cube_root(number) ** 3 == pytest.approx(number, rel=1e-15)


def test_linear_systems_need_pivots() -> None:
    """The first element of the matrix is zero."""
    matrix = np.array([[0.0, 2.0, 1.0], [1.0, 0.0, 0.0], [3.0, 0.0, 4.0]])
    expected = np.array([5.0, -1.0, 2.0])
    right_side = matrix @ expected
    (solution,) = portable.solve_linear(matrix[None], right_side[None])
    assert solution == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize("degree", range(10))
def test_quadrature_integrates_polynomials_exactly(degree: int) -> None:
    """Five nodes are exact up to the degree 2 · 5 - 1; from -1 to 1 odd powers cancel."""
    nodes, weights = portable.gauss_legendre(5)
    integral = (weights * nodes**degree).sum()
    expected = 0.0 if degree % 2 else 2.0 / (degree + 1.0)
    assert integral == pytest.approx(expected, abs=1e-15)


# --- bridges ----------------------------------------------------------------------------------


def test_the_slope_of_the_pressure_is_that_of_the_hypergeometric_function() -> None:
    """L = 1 - a b y F(a + 1, b + 1; 3; -y)/F(a, b; 2; -y), with a b = 3/2.

    Also across y = 1, where the series changes.
    """
    a = 2.0 - np.sqrt(2.5)
    b = 2.0 + np.sqrt(2.5)
    y = 10.0 ** np.linspace(-6.0, 6.0, 2001)
    expected = 1.0 - a * b * y * hyp2f1(a + 1.0, b + 1.0, 3.0, -y) / hyp2f1(a, b, 2.0, -y)
    np.testing.assert_allclose(_logarithmic_slope(y), expected, rtol=0.0, atol=3e-15)


@pytest.mark.parametrize("curvatures", [(1.0, 0.0), (0.9, 0.5)], ids=["plane", "spheres"])
def test_derivatives_of_a_bridge_are_those_of_its_residuals(
    curvatures: tuple[float, float],
) -> None:
    """Against central differences, for all bridges from contact to rupture.

    Their pressure is positive, zero and negative.
    """
    family = _Family(curvatures, (0.3, 0.6))
    _, bridges, *_ = _branch(family)
    _, jacobian = family.misfit(bridges)
    for column in range(5):
        step = np.zeros(5)
        step[column] = 1e-6
        above, _ = family.misfit(bridges + step)
        below, _ = family.misfit(bridges - step)
        slopes = (above - below) / 2e-6
        np.testing.assert_allclose(jacobian[:, :, column], slopes, rtol=1e-7, atol=1e-8)


# --- other processors -------------------------------------------------------------------------

DIGESTS_SCRIPT = """
import json, sys
from walkers import load_case
from walkers.templates.bridge_tables import BridgeTable
from walkers.templates.deck import bridge_tables_digest

def all_bits(table):
    return f"{table.curve.rupture.hex()} {table.gaps.tobytes().hex()} {table.rows.tobytes().hex()}"

BridgeTable.text = all_bits  # tables have twelve digits, which would hide most differences
print(json.dumps({name: bridge_tables_digest(load_case(name)) for name in sys.argv[1:]}))
"""
"""Prints digests of all bits of the bridge tables of cases."""
POWERS_SCRIPT = """
import numpy as np
print(np.power(np.linspace(0.1, 9.0, 10_000), 1.7).tobytes().hex())
"""
"""Prints the bits of powers by NumPy."""
WIDEST_VECTORS = [name for name in __cpu_dispatch__ if "512" in name or name == "X86_V4"]
"""NumPy's names of the vector instructions of 512 bits."""


def output_of(script: str, *arguments: str, environment: Mapping[str, str]) -> str:
    """What a script of Python prints in a process with further variables of the environment."""
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", script, *arguments],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def digests_without(features: Sequence[str], names: Sequence[str], cache: Path) -> dict[str, str]:
    """Digests of tables of cases, made with an empty cache and without vector instructions."""
    switched_off = {
        "NPY_DISABLE_CPU_FEATURES": " ".join(features),
        "OPENBLAS_CORETYPE": "Nehalem",
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-AVX2_Usable,-FMA,-FMA_Usable,"
        "-AVX512F,-AVX512F_Usable",
        "XDG_CACHE_HOME": str(cache),
    }
    digests: dict[str, str] = json.loads(
        output_of(DIGESTS_SCRIPT, *names, environment=switched_off)
    )
    return digests


@pytest.fixture(scope="module")
def digests_of_walkers() -> dict[str, str]:
    """Digests of tables of two cases with all that this processor has."""
    digests: dict[str, str] = json.loads(
        output_of(DIGESTS_SCRIPT, "fig1b", "fig4b", environment={})
    )
    return digests


@pytest.mark.parametrize(
    "features",
    [
        pytest.param(__cpu_dispatch__, id="all vector instructions"),
        pytest.param(WIDEST_VECTORS, id="AVX-512"),
    ],
)
def test_bridge_tables_do_not_depend_on_the_processor(
    features: list[str], digests_of_walkers: dict[str, str], tmp_path: Path
) -> None:
    assert digests_without(features, ["fig1b", "fig4b"], tmp_path) == digests_of_walkers


@pytest.mark.slow
def test_bridge_tables_of_all_shipped_cases_do_not_depend_on_the_processor(tmp_path: Path) -> None:
    names = [*shipped("case")]
    expected = json.loads(output_of(DIGESTS_SCRIPT, *names, environment={}))
    assert digests_without(__cpu_dispatch__, names, tmp_path) == expected


def test_the_processor_would_matter_without_portable_functions() -> None:
    """The switches of the test above reach NumPy.

    On most processors its own powers have other bits without vector instructions.
    """
    switched_off = {"NPY_DISABLE_CPU_FEATURES": " ".join(__cpu_dispatch__)}
    bits_here = output_of(POWERS_SCRIPT, environment={"NPY_DISABLE_CPU_FEATURES": ""})
    bits_elsewhere = output_of(POWERS_SCRIPT, environment=switched_off)
    if bits_elsewhere == bits_here:
        pytest.skip("this processor has one version of the power function")


# --- what notices other tables ----------------------------------------------------------------


def test_the_manifest_has_the_digest_of_the_bridge_tables(pile_run: Path) -> None:
    expected = bridge_tables_digest(case_of(pile_run))
    assert read_manifest(pile_run)["bridge_tables"] == expected


def test_the_bridge_tables_of_a_run_are_those_that_its_case_has(pile_run: Path) -> None:
    expected = render_deck(case_of(pile_run)).files[BRIDGES_NAME]
    assert (pile_run / "segments" / "0000" / BRIDGES_NAME).read_text("utf-8") == expected


def test_a_comparison_names_the_run_with_other_bridge_tables(tmp_path: Path) -> None:
    case = load_case("fig1b", {"run.cycles": 4})
    run = run_case(case, tmp_path).directory
    mine = ComparedRun("mine", case, run)
    yours = ComparedRun("yours", case, run)
    assert "bridge tables" not in compare_runs(mine, yours).text
    manifest = read_manifest(run) | {"bridge_tables": "0" * 64}
    (run / "manifest.json").write_text(json.dumps(manifest))
    text = compare_runs(mine, yours).text
    assert "mine: its bridge tables are not those of this program" in text


def test_a_run_does_not_continue_with_other_bridge_tables(tmp_path: Path) -> None:
    """The second segment is refused, and the first one is kept."""
    case = brief_pile(duration="0.04 s", segment="0.02 s")
    with open_run(case, find_engine(), tmp_path) as opened:
        opened.make()
    (first,) = tmp_path.glob("*.incomplete/segments/0000")
    _, *later_segments = sorted(first.parent.iterdir())
    for segment in later_segments:
        shutil.rmtree(segment)
    tables = first / BRIDGES_NAME
    tables.write_text(tables.read_text("utf-8").replace("1", "2", 1), encoding="utf-8")
    with (
        pytest.raises(BridgeTablesDiffer, match=r"segments/0000/bridges\.txt has other forces"),
        open_run(case, find_engine(), tmp_path) as opened,
    ):
        opened.make()
    assert (first / "beads.bin").is_file()
    assert not list(first.parent.glob("0001*"))
