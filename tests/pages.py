"""What the tests of the page share: made-up results, and the browser."""

import os
import shutil

import netCDF4
import numpy as np
import snapshots

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
BROWSER = os.environ.get("DUST_BROWSER") or next(filter(None, map(shutil.which, NAMES)), None)
# no sandbox, since tests may be run by root; WebGL in software
ARGUMENTS = ["--no-sandbox", "--disable-background-networking", "--disable-component-update"]
ARGUMENTS += ["--disable-quic", "--no-first-run", "--disable-sync", "--use-gl=angle"]
ARGUMENTS += ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
RADIUS = 0.6e-6
SCENE = """name: made
material:
  name: silicate_s12
  radius: 0.6 um
  density: 2650 kg/m^3
  surface_energy: 20 mJ/m^2
  young_modulus: 54 GPa
  poisson_ratio: 0.17
  critical_rolling: 2 nm
"""


def result_at(path, count):
    """A result that runs on, with so many snapshots of two grains."""
    frames = [{"position": np.array([[0, 0, 0], [0, 0, 2 + n]]) * RADIUS} for n in range(count)]
    next_path = path.with_name("next.nc")
    next_path.unlink(missing_ok=True)
    snapshots.write(next_path, frames, RADIUS, scene=SCENE)
    with netCDF4.Dataset(next_path, "a") as file:
        file.status = "running"
        file.delncattr("digest")
    next_path.replace(path)
