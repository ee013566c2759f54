"""Bits do not depend on the number of threads."""

import os
from types import SimpleNamespace

import numpy as np
from scenes import FAR, Probe, box, make_scene, sample_of
from test_search import FREE, same_bits, state, stirred

from dusttaichi import samples
from dusttaichi.compute import backend, compiler
from dusttaichi.grains.measure import energies


def gas(threads):
    scene = make_scene(dt="0.1 ns", damping="viscoelastic", boundary=FAR, threads=threads)
    return Probe(scene, sample_of(*stirred()))


def pressed(threads):
    scene = make_scene(
        damping="viscoelastic",
        threads=threads,
        boundary=box(wall_speed=1.0, side_walls=1e-3),
        sample={"kind": "rbd", "grains": 420, "seed": 3},
    )
    return Probe(scene, samples.make(scene))


def numbers(probe):
    m = energies(probe.sim)
    return np.concatenate([np.atleast_1d(m[name]).astype(float) for name in sorted(m)])


def test_threads_change_no_bit():
    """More threads than cores as well: the first worker goes on alone if the others do not come."""
    expected = {}
    for threads in (1, 2, 3):
        for make in (gas, pressed):
            probe = make(threads)
            probe.advance(150)
            found = state(probe), numbers(probe)
            first = expected.setdefault(make, found)
            same_bits(first[0], found[0])
            assert np.array_equal(first[1], found[1])


def test_settings_of_taichi_in_the_shell_change_nothing(monkeypatch):
    seen = []
    monkeypatch.setattr(backend.ti, "init", lambda **how: seen.append(dict(os.environ)))
    monkeypatch.setattr(backend, "settings", SimpleNamespace)
    foreign = {compiler.variable("ARCH"): "vulkan", compiler.variable("DEBUG"): "1"}
    folder = compiler.variable(compiler.KERNEL_FOLDER)
    for name, value in foreign.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setenv(folder, "/here")
    backend.start_taichi(make_scene(**FREE), 1)
    assert not foreign.keys() & set(seen[0])
    assert seen[0][folder] == "/here" and foreign.items() <= os.environ.items()
