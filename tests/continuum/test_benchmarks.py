"""The benchmarks of docs/benchmarks.py: their closed forms, and their runs (long).

pytest -n0 -m long tests/continuum/test_benchmarks.py runs all of them at both resolutions.
"""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from continuum.test_shock import jump

from dusttaichi.physics.continuum import elasticity, strength
from dusttaichi.physics.continuum.numbers import MaterialNumbers
from dusttaichi.scene.continuum_material import ContinuumMaterial

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def benchmarks():
    found = importlib.util.spec_from_file_location("benchmarks", DOCS / "benchmarks.py")
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    return module


def test_the_waves_ahead_of_a_piston_obey_the_jump_conditions(benchmarks):
    """In stiff dust: an elastic precursor at the longitudinal speed of sound, and a front as the
    jump conditions over one wave have it."""
    m = MaterialNumbers.of(ContinuumMaterial.model_validate("dust_g09"))
    flux, stress, density = benchmarks.riemann(m, 2.0)
    assert (np.diff(flux) < 0.0).all()  # the fastest first
    sound = elasticity.sound_speed(m.rho_i, m.rho_i, m)
    assert flux[0] / m.rho_i == pytest.approx(sound, rel=1e-3)
    speed, pressure, behind = jump(2.0, m)
    # states are apart by a thousandth of the density; Sigma + 2 Y/3 holds once the dust has yielded
    assert stress[-1] == pytest.approx(pressure, rel=0.01)
    assert density[-1] == pytest.approx(behind, rel=0.005)
    assert stress[-1] == pytest.approx(strength.confined(density[-1] / m.rho_s, m), rel=1e-3)
    # momentum: the stress of the piston is what all waves together carry
    moved = np.sum(np.diff(np.append(0.0, stress)) / flux)
    assert moved == pytest.approx(2.0, rel=2e-3)


# shares of what is expected, coarse and fine: waves are smeared over some spacings, so that the
# plateau between precursor and front has the largest error
NEAR = {
    "planar_compaction": (0.2, 0.12),
    "rotating_block": (1e-3, 1e-3),
}


@pytest.mark.long
@pytest.mark.parametrize("resolution", [0, 1])
@pytest.mark.parametrize("name", NEAR)
def test_a_benchmark_has_its_closed_form(benchmarks, name, resolution, tmp_path):
    """docs/benchmarks.md tells how near each number is; the ledger is open by less than 1 %."""
    rows, _, open_by = benchmarks.carried_out(name, resolution, tmp_path)
    for row in rows:
        near = NEAR[name][resolution] * (abs(row.expected) or 1.0)
        assert abs(row.found - row.expected) < near, row
    assert open_by < 0.01
