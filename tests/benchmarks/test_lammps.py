"""The comparison with LAMMPS: same grains, same contact at rest, a timing, plain errors."""

from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks import lammps
from dusttaichi.errors import DustError
from dusttaichi.physics.contact import constants
from dusttaichi.samples.formats import lammps as program

pytest.importorskip("lammps", reason="pip has no LAMMPS for Windows")

SILICATE = SimpleNamespace(
    radius=0.6e-6,
    density=2650.0,
    surface_energy=0.02,
    young_modulus=54e9,
    poisson_ratio=0.17,
    critical_rolling=2e-9,
)
TIME_STEP = 0.3e-9
R = constants.reduced_radius(SILICATE.radius, SILICATE.radius)
A0 = constants.equilibrium_contact_radius(
    SILICATE.surface_energy, R, constants.reduced_modulus(SILICATE)
)
DELTA0 = constants.equilibrium_overlap(A0, R)
AT_REST = 2 * SILICATE.radius - DELTA0


def cluster(grains: int, seed: int = 1) -> np.ndarray:
    """Grains that hang on one another at AT_REST, and on no others: (grains, 3) [m], a tree."""
    rng = np.random.default_rng(seed)
    positions = np.zeros((1, 3))
    while len(positions) < grains:
        way = rng.normal(size=3)
        partner = rng.integers(len(positions))
        position = positions[partner] + AT_REST * way / np.linalg.norm(way)
        apart = np.linalg.norm(positions - position, axis=1)
        apart[partner] = np.inf
        if apart.min() > 1.01 * 2 * SILICATE.radius:
            positions = np.vstack([positions, position])
    return positions


def run(positions, steps, box=None, time_step_s=TIME_STEP, **options):
    """Positions [m] at the end."""
    how = {"steps": steps, "time_step_s": time_step_s, **options}
    return lammps.run_lammps(positions, SILICATE, {}, box, **how)[1]


def test_numbers_given_to_lammps():
    assert lammps.contact_style(SILICATE, {}, 1e-9) == (
        "jkr 54000000 1 0.17 20 damping velocity tangential mindlin 50441361.9168 0 0.3 "
        "rolling sds 753.982236862 0 0.0133333333333 twisting marshall"
    )
    words = lammps.contact_style(SILICATE, {"rolling": 8, "sliding": 2.5}, 1e-9).split()
    assert float(words[9]) == pytest.approx(2.5 * 50441361.9168)
    assert float(words[14]) == pytest.approx(8 * 753.982236862)
    assert float(words[16]) == pytest.approx(8 * 0.0133333333333)  # xi_crit stays


@pytest.mark.parametrize("overlap", [0.3, 1.0, 2.0])
def test_pair_rests_where_ours_does(overlap):
    """Damped to rest (90 ns, forty decay times), a pair of LAMMPS is 2 r - delta0 apart."""
    pair = np.array([[0.0, 0.0, 0.0], [2 * SILICATE.radius - overlap * DELTA0, 0.0, 0.0]])
    final = run(pair, 300, kappa=1e-6)
    left = 2 * SILICATE.radius - np.linalg.norm(final[1] - final[0])
    assert left / DELTA0 == pytest.approx(1.0, abs=1e-9)  # rounding of positions is 1e-12


def test_pair_oscillates_as_ours():
    """Half a small oscillation, 5.39 ns, turns a push around: mass and stiffness are right."""
    k_n = constants.normal_stiffness(
        SILICATE.surface_energy, R, constants.reduced_modulus(SILICATE)
    )
    half = np.pi * np.sqrt(constants.grain_mass(SILICATE) / (2 * k_n))
    push = 1e-3 * DELTA0
    pair = np.array([[0.0, 0.0, 0.0], [AT_REST + push, 0.0, 0.0]])
    # 1000 + 100 of warm-up; second order in dt and in the push, hence 1e-3 to be generous
    final = run(pair, 1000, time_step_s=half / 1100, kappa=0.0)
    assert np.linalg.norm(final[1] - final[0]) - AT_REST == pytest.approx(-push, rel=1e-3)


def test_cluster_stays_bonded_and_is_timed():
    positions = cluster(200)
    options = {"steps": 200, "time_step_s": TIME_STEP}
    seconds, contacts = lammps.time_lammps(positions, SILICATE, {}, None, **options)
    assert contacts == 199 and seconds > 0
    assert lammps.lammps_version() != "unknown"
    final = run(positions, 200)
    assert np.abs(final - positions).max() < 1e-3 * DELTA0  # at rest it stays where it was


def test_processes_give_the_same_motion():
    positions = cluster(50)
    speeds = np.random.default_rng(2).normal(scale=0.01, size=positions.shape)
    first, two = (run(positions, 20, threads=n, velocities_m_s=speeds) for n in (1, 2))
    # sums in another order; positions in um round at 1e-15, hardly grown in 22 steps
    np.testing.assert_allclose(first, two, rtol=0, atol=1e-6 * DELTA0)


def test_velocities_are_passed_on():
    drift = np.full((5, 3), [0.01, -0.02, 0.03])
    positions = cluster(5)
    final = run(positions, 100, velocities_m_s=drift)
    moved = drift * 110 * TIME_STEP  # the warm-up is a tenth
    np.testing.assert_allclose(final - positions, moved, rtol=0, atol=1e-3 * DELTA0)


def test_walls_hold_the_grains():
    """A grain that flies at a floor bounces or sticks; without the floor it would be below."""
    positions = np.array([[0.0, 0.0, SILICATE.radius], [3e-6, 0.0, SILICATE.radius + 5e-9]])
    falling = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    box = [6e-6, 6e-6, 6e-6]
    final = run(positions, 100, box, velocities_m_s=falling)
    free = run(positions, 100, velocities_m_s=falling)
    assert final[1, 2] > SILICATE.radius - 10e-9
    assert free[1, 2] < SILICATE.radius - 20e-9


def test_error_of_lammps_is_passed_on():
    with pytest.raises(DustError, match="LAMMPS: ERROR"):
        run(cluster(3), 10, kappa=-1.0)


def test_without_lammps(monkeypatch):
    monkeypatch.setattr(program, "find_spec", lambda name: None)
    monkeypatch.setattr(program.shutil, "which", lambda name: None)
    with pytest.raises(DustError, match=r"this comparison.*pip install 'dusttaichi\[bench\]'"):
        lammps.lammps_version()


def test_without_mpi_library(monkeypatch, tmp_path):
    broken = tmp_path / "lmp"
    broken.write_text(
        "#!/bin/sh\necho 'lmp: error while loading shared libraries: libmpi.so.12' >&2\nexit 127\n"
    )
    broken.chmod(0o755)
    monkeypatch.setattr(program, "lammps_program", lambda *purpose: str(broken))
    with pytest.raises(DustError, match="pip install mpich"):
        lammps.lammps_version()
