"""Snapshots written by `dust export` and read again as samples (hypothesis)."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
import snapshots
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from scenes import RADIUS, make_scene

from dusttaichi import analysis, samples
from dusttaichi.export import export

# alike on every machine
SUITE = settings(derandomize=True, deadline=None, max_examples=20, phases=[Phase.generate])
MICRO = 1e-6
RTOL = 1e-9  # of the digits of a file: twelve and more
ATOL = 1e-18  # m: the eighth decimal of an Angstrom


@st.composite
def frames(draw):
    """A snapshot with radii, a box (6,) [m], its periodic axes, and tilt [m]."""
    digits = draw(st.integers(1, 12))
    n = draw(st.integers(1, 4))
    number = st.floats(-1.0, 1.0, allow_subnormal=False)

    def vectors():
        rows = draw(st.lists(st.tuples(number, number, number), min_size=n, max_size=n))
        return np.round(np.array(rows), digits)

    sizes = st.floats(0.3, 0.9)
    radius = np.round(draw(st.lists(sizes, min_size=n, max_size=n)), max(digits, 2)) * MICRO
    # two micrometres apart along x, so that no sample is refused for its overlaps
    apart = np.arange(n)[:, None] * [2.5, 0.0, 0.0]
    position = (apart + 0.3 * vectors()) * MICRO
    low = np.round(np.array([-1.5, -2.0, -3.0]) + 0.5 * vectors()[0], digits) * MICRO
    edges = np.round(np.array([14.0, 5.0, 6.0]) + vectors()[0], digits) * MICRO
    box = np.stack([low, low + edges], axis=1).ravel()
    axes = draw(st.sampled_from(["x y z", "x y", "x", "", "x y z"]))
    tilt = draw(st.integers(-49, 49)) * 0.01 * edges[0] if axes == "x y z" else 0.0
    frame = {"position": position, "velocity": vectors(), "spin": 1e5 * vectors(), "tilt": tilt}
    return frame, radius, box, axes


def compare(sample, case, to):
    """Check a sample against the snapshot that it was written from."""
    frame, radius, box, axes = case
    np.testing.assert_allclose(sample.positions, frame["position"], rtol=RTOL, atol=ATOL)
    own = np.full(len(radius), RADIUS) if sample.radii is None else sample.radii
    np.testing.assert_allclose(own, radius, rtol=RTOL, atol=ATOL)
    # eight decimals of m/s and rad/s in extended XYZ
    np.testing.assert_allclose(sample.velocities, frame["velocity"], rtol=RTOL, atol=1e-8)
    np.testing.assert_allclose(sample.spins, frame["spin"], rtol=RTOL, atol=1e-8)
    np.testing.assert_allclose(sample.info["room"], box, rtol=RTOL, atol=ATOL)
    assert sample.info.get("tilt", 0.0) == pytest.approx(frame["tilt"], rel=1e-7, abs=ATOL)
    if to != "lammps-data":  # which does not say along which axes it is periodic
        edges = sample.info.get("cell", {}).get("period", [None] * 3)
        assert [edge is not None for edge in edges] == [axis in axes for axis in "xyz"]


@SUITE
@given(frames())
def test_an_export_comes_back_through_its_reader(case):
    frame, radius, box, axes = case
    boundary = {"kind": "periodic"} if axes == "x y z" else {"kind": "box", "size": "fit"}
    with tempfile.TemporaryDirectory() as folder:
        result = snapshots.write(
            Path(folder) / "result.nc", [frame], radius, box=box, periodic=axes
        )
        with analysis.open_run(result) as run:
            paths = {to: export(run, to)[0] for to in ("extxyz", "lammps", "lammps-data")}
        for to, path in paths.items():
            block = {"kind": "explicit", "file": str(path), "keep": ["box"]}
            compare(samples.make(make_scene(sample=block, boundary=boundary)), case, to)
