"""The choice of the compiler by DUST_COMPILER, and what the other one computes."""

import importlib.util
import os
import sys

import numpy as np
import pytest
import xarray as xr
from program import python

from dusttaichi.compute import compiler
from dusttaichi.errors import DustError
from dusttaichi.scene import load

SCENE = """
name: other
material: silicate_s12
interaction: {rolling: {modifier: 8}, damping: viscoelastic}
sample: {kind: rbd, grains: 60, seed: 1}
boundary: {kind: box, wall_speed: 5 m/s}
stop: {steps: 2000}
output: {series: {steps: 500}}
"""
UNLIKE = """
name: unlike
material: silicate_s12
materials: {ice: ice_t19}
interaction: {rolling: {modifier: 8}, sliding: {}, twisting: {}, damping: viscous}
sample:
  {kind: rbd, grains: 60, sizes: {kind: list, radii: [0.5 um, 1 um]}, shares: {default: 1, ice: 1}}
boundary: {kind: periodic, strain_rate: -1e6 s^-1}
stop: {steps: 1000}
output: {series: {steps: 250}}
"""
CONTINUUM = """
name: continuum
method: continuum
dimension: 2
material: dust_g09
sample: {kind: block, size: [0.8 mm, 2 mm]}
boundary: {kind: faces, bottom: rigid, top: rigid, periodic: [x], wall_speed: 0.1 m/s}
numerics: {spacing: 200 um}
stop: {time: 2 ms}
output: {series: {time: 0.5 ms}}
"""
# what a run has, and how far results may be apart: 2000 steps in mixed precision, each of which
# rounds at 6e-8; some hundred steps in double precision
SCENES = {
    "equal grains": (SCENE, 1e-4, ("filling_factor", "kinetic_rotation", "loss", "contact_count")),
    "unlike grains": (UNLIKE, 1e-4, ("stress", "kinetic_rotation", "loss")),
    "continuum": (CONTINUUM, 1e-9, ("filling_factor_mean", "pressure", "loss")),
}
FOREIGN = """
import quadrants as ti
"""


@pytest.mark.parametrize(
    "value, name", [(None, "taichi"), ("", "taichi"), (" Quadrants", "quadrants")]
)
def test_taichi_unless_the_shell_names_another(value, name, monkeypatch):
    monkeypatch.delenv(compiler.VARIABLE, raising=False)
    if value is not None:
        monkeypatch.setenv(compiler.VARIABLE, value)
    assert compiler.name() == name
    assert compiler.variable("ARCH") == compiler.PREFIX[name] + "ARCH"


def test_what_cannot_be_chosen(monkeypatch):
    monkeypatch.setenv(compiler.VARIABLE, "julia")
    with pytest.raises(DustError, match="DUST_COMPILER=julia: no such.*allowed: taichi, quadrants"):
        compiler.name()
    monkeypatch.setenv(compiler.VARIABLE, "quadrants")

    def missing(name):
        raise compiler.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(compiler.metadata, "version", missing)
    with pytest.raises(DustError, match=r"pip install 'dusttaichi\[quadrants\]'"):
        compiler.label()


def dust(folder, *arguments, name):
    """Output of `dust` with that compiler in a process of its own."""
    environment = {**os.environ, compiler.VARIABLE: name}
    return python("-m", "dusttaichi", *arguments, cwd=folder, env=environment)


@pytest.mark.skipif(importlib.util.find_spec("quadrants") is None, reason="there is no Quadrants")
@pytest.mark.long
@pytest.mark.parametrize("scene", SCENES)
def test_quadrants_computes_the_same(scene, tmp_path):
    """From the same source, up to rounding, which is in another order where LLVM is another."""
    text, apart, variables = SCENES[scene]
    (tmp_path / "other.yaml").write_text(text)
    results = {}
    for name in compiler.PREFIX:
        process = dust(tmp_path, "run", "other.yaml", "--output", name, "--no-figures", name=name)
        assert process.returncode == 0, process.stderr
        with xr.open_dataset(tmp_path / name / "result.nc") as series:
            assert f"{name}_version" in series.attrs
            results[name] = series.load()
    first, second = results.values()
    assert first.sizes == second.sizes
    for variable in variables:
        a, b = first[variable].values, second[variable].values
        assert np.nanmax(np.abs(a)) > 0
        atol = 0.01 * apart * np.nanmax(np.abs(a))
        np.testing.assert_allclose(a, b, rtol=apart, atol=atol, err_msg=variable)
    if scene != "equal grains":
        return
    process = dust(
        tmp_path, "run", "other.yaml", "--output", "taichi", "--resume", name="quadrants"
    )
    assert process.returncode == 2 and "here Quadrants" in process.stdout + process.stderr


def test_an_extension_for_another_compiler(tmp_path, monkeypatch):
    """Its functions would not be known to the compiler of all others."""
    monkeypatch.setenv(compiler.VARIABLE, "taichi")
    monkeypatch.setitem(sys.modules, "quadrants", type(sys)("quadrants"))
    (tmp_path / "law.py").write_text(FOREIGN)
    (tmp_path / "own.yaml").write_text(f"extensions: [law.py]\n{SCENE}")
    with pytest.raises(DustError, match="imports quadrants, while taichi.*`from dust"):
        load(tmp_path / "own.yaml")
