"""Grains given one by one: lists and CSV files, and what is refused of them."""

import numpy as np
import pytest
from bodies import PLAIN, R, made

from dusttaichi.errors import DustError
from dusttaichi.scene import Scene

N = 5
RNG = np.random.default_rng(8)
STATE = {
    "position": np.arange(N)[:, None] * [2 * R, 0.1 * R, 0.0] + RNG.random((N, 3)) * 0.01 * R,
    "velocity": RNG.normal(size=(N, 3)),
    "spin": RNG.normal(size=(N, 3)) * 1e5,
}
NAMES = {"position": "xyz", "velocity": ("vx", "vy", "vz"), "spin": ("wx", "wy", "wz")}
UNITS = {"position": "m", "velocity": "m/s", "spin": "rad/s"}


def load(**keys):
    """The grains as they are in the block, or in its file."""
    keys |= {"file": str(keys["file"])} if "file" in keys else {}
    return made("explicit", touch_within=0, **keys)


def written(quantity):
    return [[f"{value!r} {UNITS[quantity]}" for value in row] for row in STATE[quantity].tolist()]


def assert_state(sample, rtol=0.0):
    for values, name in zip(
        (sample.positions, sample.velocities, sample.spins), STATE, strict=True
    ):
        assert values.dtype == np.float64
        np.testing.assert_allclose(values, STATE[name], rtol=rtol, atol=0)


def write_csv(path, header, rows):
    path.write_text("\n".join([header, *(",".join(map(str, row)) for row in rows)]) + "\n")
    return path


def test_positions_from_the_yaml():
    places = written("position")
    assert_state(load(positions=places, velocities=written("velocity"), spins=written("spin")))
    still = load(positions=places)
    assert not still.velocities.any() and not still.spins.any() and still.contacts is None
    assert len(load(positions=places[:1])) == 1
    with pytest.raises(DustError, match=r"sample\.positions: grains 0 and 1"):
        load(positions=[["0 m"] * 3, ["0.6 um", "0 m", "0 m"]])


def test_csv(tmp_path):
    columns = np.hstack(list(STATE.values())).tolist()
    names = [name for parts in NAMES.values() for name in parts]
    assert_state(load(file=write_csv(tmp_path / "a.csv", ",".join(names), columns)))
    reordered = [row[::-1] for row in columns]
    file = write_csv(tmp_path / "b.csv", "# grains\n" + " , ".join(names[::-1]), reordered)
    assert_state(load(file=file))
    only = write_csv(tmp_path / "c.csv", "x,y,z", STATE["position"].tolist())
    assert np.array_equal(load(file=only).positions, STATE["position"])


def test_csv_with_units(tmp_path):
    micro = np.hstack([STATE["position"] * 1e6, STATE["velocity"] * 100]).tolist()
    heading = write_csv(
        tmp_path / "a.csv", "x [um],y [um],z [um],vx [cm/s],vy [cm/s],vz [cm/s]", micro
    )
    option = write_csv(tmp_path / "b.csv", "x,y,z,vx [cm/s],vy [cm/s],vz [cm/s]", micro)
    for sample in (load(file=heading), load(file=option, units="um")):
        # Two products of rounded numbers.
        np.testing.assert_allclose(sample.positions, STATE["position"], rtol=1e-15)
        np.testing.assert_allclose(sample.velocities, STATE["velocity"], rtol=1e-15)


@pytest.mark.parametrize("name", ["absent.csv", "absent.nc", ""])
def test_missing_file_is_refused(tmp_path, name):
    with pytest.raises(DustError, match=r"sample\.file = .*there is no .*allowed"):
        load(file=tmp_path / name)


@pytest.mark.parametrize("content", [b"\xff\xfe\x00x", b"\x89HDF\r\n\x1a\n" + b"\0" * 50])
def test_unreadable_file_is_refused(tmp_path, content):
    (tmp_path / "a.nc").write_bytes(content)
    with pytest.raises(DustError, match=r"sample\.file = .*(it cannot be read|is damaged)"):
        load(file=tmp_path / "a.nc")


@pytest.mark.parametrize("check_files", [True, False])
def test_a_path_that_no_system_takes(tmp_path, check_files):
    data = PLAIN.given | {"sample": {"kind": "explicit", "file": "x" * 5000}}
    with pytest.raises(DustError, match="it cannot be a file: File name too long"):
        Scene.from_dict(data, tmp_path, check_files=check_files)
