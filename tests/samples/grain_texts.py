"""Texts of grains as programs write them, and their samples."""

import numpy as np
import pytest
from scenes import make_scene

from dusttaichi import samples
from dusttaichi.errors import DustError

PAIR = [[0, 0, 0], [1.2, 0, 0]]  # um
IN_BOX = [[1, 5, 5], [2.2, 5, 5]]
STEP = "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n2\n"
MICRO = f"ITEM: UNITS\nmicro\n{STEP}"
BOX = "ITEM: BOX BOUNDS pp pp pp\n0 10\n0 10\n0 10\n"
HEAD = (
    "a title, units = micro\n\n2 atoms\n1 atom types\n\n"
    "0 10 xlo xhi\n0 10 ylo yhi\n0 10 zlo zhi\n\n"
)


def lines(*rows, head=""):
    return head + "".join(f"{row}\n" for row in rows)


def read(tmp_path, text, boundary=None, materials=None, **keys):
    path = tmp_path / "grains.txt"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    options = {"materials": materials} if materials else {}
    # as they are in the file: test_touching puts them into contact
    sample = {"kind": "explicit", "file": str(path), "touch_within": 0, **keys}
    return samples.make(make_scene(sample=sample, boundary=boundary, **options))


SPHERES = lines("2 1 1.2 2.65 2.2 5 5", "1 1 1.2 2.65 1 5 5", head=f"{HEAD}Atoms # sphere\n\n")


def dump(columns, *rows, bounds=BOX, head=MICRO):
    return lines(*rows, head=f"{head}{bounds}ITEM: ATOMS {columns}\n")


XYZ = "2\nmade by hand\nC 0 0 0\nC 0 0 1.2\n"


def check_motion(sample, positions, speeds, spins):
    """Positions [um], speeds along x and spins about z, in the order of the ids."""
    np.testing.assert_allclose(sample.positions, np.array(positions) * 1e-6, rtol=1e-12, atol=1e-20)
    np.testing.assert_allclose(sample.velocities[:, 0], speeds)
    np.testing.assert_allclose(sample.spins[:, 2], spins)


def expand_cases(refused):
    """(text, keys of the sample, message) of cases that may leave the keys out."""
    return [(text, *(keys or [{}]), message) for text, *keys, message in refused]


def check_refusal(tmp_path, text, keys, message):
    pattern = r"sample\.(file = '.*grains\.txt'|columns = |style = ).*"
    with pytest.raises(DustError, match=pattern + message):
        read(tmp_path, text, **{"units": "um"} | keys)
