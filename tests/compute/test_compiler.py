"""The choice of the compiler by DUST_COMPILER, and what the other one computes."""

import importlib.util
import os
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr

from dusttaichi import compiler
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
FOREIGN = """
import quadrants as ti
"""


@pytest.mark.parametrize(
    "given, name", [(None, "taichi"), ("", "taichi"), (" Quadrants", "quadrants")]
)
def test_taichi_unless_the_shell_names_another(given, name, monkeypatch):
    monkeypatch.delenv(compiler.VARIABLE, raising=False)
    if given is not None:
        monkeypatch.setenv(compiler.VARIABLE, given)
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
    command = [sys.executable, "-m", "dusttaichi", *arguments]
    own = {**os.environ, compiler.VARIABLE: name}
    return subprocess.run(command, cwd=folder, env=own, capture_output=True, text=True)


@pytest.mark.skipif(importlib.util.find_spec("quadrants") is None, reason="there is no Quadrants")
def test_quadrants_computes_the_same(tmp_path):
    """From the same source, up to rounding, which is in another order where LLVM is another."""
    (tmp_path / "other.yaml").write_text(SCENE)
    found = {}
    for name in compiler.PREFIX:
        done = dust(tmp_path, "run", "other.yaml", "--output", name, "--no-figures", name=name)
        assert done.returncode == 0, done.stderr
        with xr.open_dataset(tmp_path / name / "result.nc") as series:
            assert f"{name}_version" in series.attrs
            found[name] = series.load()
    one, other = found.values()
    assert one.sizes == other.sizes
    for variable in ("filling_factor", "kinetic_rotation", "loss", "contact_count"):
        a, b = one[variable].values, other[variable].values
        # 2000 steps in mixed precision, each of which rounds at 6e-8
        np.testing.assert_allclose(a, b, rtol=1e-4, atol=1e-6 * np.abs(a).max(), err_msg=variable)
    done = dust(tmp_path, "run", "other.yaml", "--output", "taichi", "--resume", name="quadrants")
    assert done.returncode == 2 and "here Quadrants" in done.stdout + done.stderr


def test_an_extension_for_another_compiler(tmp_path, monkeypatch):
    """Its functions would not be known to the compiler of all others."""
    monkeypatch.setenv(compiler.VARIABLE, "taichi")
    monkeypatch.setitem(sys.modules, "quadrants", type(sys)("quadrants"))
    (tmp_path / "law.py").write_text(FOREIGN)
    (tmp_path / "own.yaml").write_text(f"extensions: [law.py]\n{SCENE}")
    with pytest.raises(DustError, match="imports quadrants, while taichi.*`from dust"):
        load(tmp_path / "own.yaml")
