"""Runs in which two bodies collide: what is conserved, what the table says, what is drawn."""

import matplotlib
import numpy as np
import pytest
import snapshots
from scenes import FAR, Probe, make_scene

from dusttaichi import analysis, plots, samples

R = 0.6e-6
SCENE = snapshots.SCENE + "sample: {kind: collision}\nboundary: {kind: open}\n"


def links(*ranges):
    return [[k, k + 1] for first, last in ranges for k in range(first, last - 1)]


def write_collision(path, final_velocities, pairs, speed=2.0, velocity=(-0.25, 0.25), past=0.0):
    """Bodies of 6 and 4 grains on a line that meet at 2 m/s; links and velocities afterwards. past:
    how far the second has flown through the first by then."""
    x = np.zeros((10, 3))
    x[:, 0] = np.arange(10) * 2 * R
    x[::2, 1] = 0.3 * R
    v = np.zeros((10, 3))
    v[:, 0] = [0.8] * 6 + [-1.2] * 4
    later = v.copy()
    later[:, 0] = [velocity[0]] * 6 + [velocity[1]] * 4
    behind = (np.arange(10) >= 6)[:, None]
    frames = [
        {"position": x + behind * [R, 0, 0], "velocity": v, "pairs": pairs},
        {"position": x, "velocity": v, "pairs": pairs},
        {"position": x - behind * [past, 0, 0], "velocity": later, "pairs": final_velocities},
    ]
    attrs = {"sample": f"{{kind: collision, target_grains: 6, speed: {speed}}}", "grains": 10}
    return analysis.open_run(
        snapshots.write(path / "result.nc", frames, R, scene=SCENE, attrs=attrs)
    )


BOTH = links((0, 6), (6, 10))


@pytest.mark.parametrize(
    "final_velocities, outcome, fragments, growth",
    [
        (links((0, 10)), "sticking", 1, 1.0),
        (BOTH, "bouncing", 2, 0.0),
        (links((0, 5), (6, 10)), "erosion", 3, -0.25),
        (links((0, 5), (5, 9)), "erosion", 3, -0.25),
        (links((0, 9)), "growth", 2, 0.75),
        (links((1, 5), (5, 9)), "erosion", 4, -0.5),
        (links((0, 2), (2, 4), (4, 6)), "fragmentation", 7, -1.0),
        (links((0, 8), (8, 10)), "mass transfer", 2, 0.5),
    ],
)
def test_outcome(tmp_path, final_velocities, outcome, fragments, growth):
    with write_collision(tmp_path, final_velocities, BOTH) as run:
        assert run.collides
        numbers = analysis.summarise(run)
        rows = {row[0]: row[1] for row in analysis.tabulate(numbers)}
    assert (numbers["outcome"], numbers["fragments"]) == (outcome, fragments)
    assert numbers["growth_efficiency"] == pytest.approx(growth)
    # 0.5 of 2 m/s along the line of centres, as far as a zigzag of grains has one
    expected = {"sticking": 0.0, "growth": 0.0, "bouncing": pytest.approx(0.25, rel=1e-3)}
    assert numbers["restitution"] == expected.get(outcome)
    assert rows["outcome"].startswith(outcome) and "growth efficiency" in rows
    # the frame before the last has both bodies whole
    assert ("note" in rows) == (
        len(links((0, 6), (6, 10))) != len(final_velocities) or outcome != "bouncing"
    )


@pytest.mark.parametrize(
    "past, outcome, text",
    [
        (0.0, "not met yet", "the bodies have not met yet"),
        (40 * R, "passed by", "the bodies passed each other without touching"),
    ],
)
def test_bodies_that_have_not_met_have_no_restitution(tmp_path, past, outcome, text):
    with write_collision(tmp_path, BOTH, BOTH, velocity=(0.8, -1.2), past=past) as run:
        numbers = analysis.summarise(run)
        rows = {row[0]: row[1] for row in analysis.tabulate(numbers)}
    assert numbers["outcome"] == outcome
    assert rows["outcome"].startswith(text)
    # neither a restitution of -1 nor a growth efficiency of 0 is a number of a collision
    assert numbers["restitution"] is None and numbers["growth_efficiency"] is None


def test_grains_at_rest_are_no_collision(tmp_path):
    still = snapshots.write(tmp_path / "a.nc", [{"position": np.eye(3) * 1e-5}] * 2, R)
    with analysis.open_run(still) as run:
        numbers = analysis.summarise(run)
        assert not run.collides and numbers["outcome"] is None
        assert "outcome" not in {row[0] for row in analysis.tabulate(numbers)}


def test_figures(tmp_path):
    with write_collision(tmp_path, links((0, 5), (6, 10)), BOTH) as run:
        paths = plots.save_figures(run, tmp_path / "figures")
        assert {path.name for path in paths} == {"ledger.png", "collision.png", "fragments.png"}
        bar = plots.grains(run, color="body", dpi=60).axes[-1]
        assert [label.get_text() for label in bar.get_yticklabels()] == ["target", "projectile"]
        figure = plots.collision(run)
        assert [text.get_text() for text in figure.texts] == ["0 ns", "1 ns", "2 ns"]
    image = matplotlib.image.imread(tmp_path / "figures/collision.png")[..., :3]
    blue, yellow = image[..., 2] - image[..., 0] > 0.2, image[..., 0] - image[..., 2] > 0.2
    # the bodies are 6 and 4 grains that barely hide each other
    assert blue.sum() / yellow.sum() == pytest.approx(1.5, rel=0.1)


@pytest.mark.long  # smaller bodies: test_free_cluster_keeps_its_momenta
def test_momentum_and_angular_momentum():
    """Two aggregates of 200 grains break up at 5 m/s: both are kept to rounding.

    1e-12 of the sum of the grains' own shares: 400 grains and 8000 steps of 1e-16 each, at random.
    """
    body = {"kind": "pca", "grains": 200}
    scene = make_scene(
        sample={
            "kind": "collision",
            "target": {**body, "seed": 1},
            "speed": "5 m/s",
            "projectile": {**body, "seed": 2},
            "impact_parameter": 0.3,
            "gap": "50 nm",
        },
    )
    far = make_scene(damping="viscoelastic", dt="0.25 ns", boundary=FAR)
    probe = Probe(far, samples.make(scene))
    start, velocities_before = probe.momenta(), (probe.v, probe.w)
    probe.advance(8000)
    end, velocities_after = probe.momenta(), (probe.v, probe.w)
    for n in (0, 1):
        assert np.abs(end[n] - start[n]).max() < 1e-12 * end[n + 2]
        assert (
            np.abs(velocities_after[n] - velocities_before[n]).sum()
            > 0.2 * np.abs(velocities_after[n]).sum()
        )  # of each
    last_energies = probe.sim.ledger.measure_energies()
    assert last_energies["contacts"] < 350  # of 398
    assert np.all(last_energies["loss"] > 0)  # every kind of contact force has been at work
