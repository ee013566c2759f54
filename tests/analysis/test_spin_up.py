"""Spin-up: a chain breaks where mechanics says; numbers and figure of it.

`long`: a chain that is spun up and holds is in domain/test_push.
"""

import numpy as np
import pytest
import reference as ref
from program import invoked
from scenes import RADIUS, bundled, extensions_forgotten, make_scene

from dusttaichi import analysis, plots
from dusttaichi.errors import DustError
from dusttaichi.run import execute

pytestmark = pytest.mark.long
MASS, _ = ref.mass_and_inertia()
PAIR = ref.numbers()
# of the critical rate: steps so small at the end that the chain, which swings about its new
# length, does not break before
RATES = [0.5, 0.7, 0.8, 0.86, 0.9, 0.92, 0.94, 0.96, 0.98, 1.0, 1.02]
STEPS = 4000
OWN = "reissl2024/spin_up.py"


@pytest.fixture(scope="module")
def own():
    with bundled(OWN) as module:
        yield module


@pytest.fixture(scope="module")
def spun(own, tmp_path_factory):
    """A chain of four grains that is spun up, and the rate [rad/s] at which its middle contact
    pulls with F_c: m omega^2 (d/2 + 3d/2), d the distance of two grains."""
    d = 2 * RADIUS - PAIR.delta0
    critical = np.sqrt(PAIR.F_c / (MASS * 2.0 * d))
    stages = [{"name": "rest", "stop": {"steps": 1}}]
    for number, step in enumerate(np.diff([0.0, *RATES])):
        spin = ["0 rad/s", "0 rad/s", f"{step * critical:.17g} rad/s"]
        drive = {"push": [{"grains": "all", "spin": spin}]}
        stages.append({"name": f"s{number}", "drive": drive, "stop": {"steps": STEPS}})
    scene = make_scene(
        sample={"kind": "chain", "grains": 4, "axis": "x"}, stages=stages, stop=None,
        damping="viscoelastic", output={"series": {"steps": 400}}, extensions=[OWN],
    )  # fmt: skip
    folder = tmp_path_factory.mktemp("spun") / "chain"
    execute(scene, folder)
    with analysis.open_run(folder) as run:
        yield run, critical


def test_a_chain_breaks_where_its_middle_pulls_with_the_largest_force(own, spun):
    run, critical = spun
    found = own.spin_up(run)
    assert own.is_spun(run) and found.broken is not None and found.share[found.broken] == 0.5
    # the step before the critical one, or that which swings beyond it
    assert 0.95 * critical < found.rate[found.top] < 1.01 * critical
    given = found.given[: found.broken] / critical
    nearest = np.abs(given[:, None] - [0.0, *RATES]).min(axis=1)
    # the moment of inertia is that of the chain already stretched by half of the critical rate
    assert nearest.max() < 1e-3 and given[-1] >= 0.96
    assert np.all(found.rate[: found.broken] <= 1.001 * found.given[: found.broken])


def test_numbers_and_figure(own, spun):
    run, critical = spun
    numbers, failed = own.SPIN_UP.of(run)
    assert not failed and numbers["spin_broken"] and numbers["spin_rate"] < 1.01 * critical
    # rho R^2 omega^2 / 4 = M omega^2 / (16 pi R / 3), and R^2 = 5/3 of the mean square distance
    square = 5.0 / 3.0 * 1.25 * (2 * RADIUS - PAIR.delta0) ** 2
    stress = 3 * 4 * MASS / (16 * np.pi * np.sqrt(square)) * numbers["spin_rate"] ** 2
    assert numbers["spin_stress"] == pytest.approx(stress, rel=1e-3)
    upper, lower = plots.figures_of(run)["spin_up"].axes
    assert "rad/s" in upper.get_ylabel() and "largest fragment" in lower.get_ylabel()


def test_a_later_process_shows_them(spun, tmp_path):
    """The result names the bundled file by its content, and no option is needed."""
    run, _ = spun
    largest = f"{analysis.summary(run)['spin_rate']:.3g}"
    for words in (["compare", run.path], ["plot", run.path, "-o", tmp_path]):
        with extensions_forgotten():
            done = invoked(*words)
            assert done.exit_code == 0 and "--extension" not in done.output
            assert largest in done.stdout or (tmp_path / "spin_up.png").exists()


def test_what_is_no_aggregate_is_refused(own, spun, monkeypatch):
    run, _ = spun
    monkeypatch.setattr(own, "frame_count", lambda run: 1)
    monkeypatch.setattr(own, "read_frame", lambda run, n: last)
    last = analysis.read_frame(run, -1)
    with pytest.raises(DustError, match="must be one piece"):
        own.spin_up(run)
