"""Checkpoints: the same bits, and one that is whole at any moment."""

import numpy as np
import pytest

from dusttaichi.errors import DustError
from dusttaichi.run import checkpoint

ARRAYS = {
    "position": np.array([[0.1, np.pi, -0.0], [np.nan, np.inf, 5e-324]]),
    "flags": np.array([True, False]),
    "empty": np.zeros((0, 3), dtype=np.int32),
    "step": np.int64(2**60 + 1),
    "transposed": np.arange(6, dtype=np.float32).reshape(2, 3).T,
}
META = {"counts": {"series": np.int64(3)}, "dt": 0.1 + 0.2, "scene": "name: ä\n"}


def test_checkpoint_keeps_the_bits(tmp_path):
    path = tmp_path / "checkpoint"
    checkpoint.save(path, ARRAYS, META)
    state = checkpoint.load(path)
    assert list(state.arrays) == list(ARRAYS) and state.note is None
    for name, array in ARRAYS.items():
        read = state.arrays[name]
        assert read.dtype == array.dtype and read.shape == array.shape
        assert read.tobytes() == array.tobytes() and read.flags.writeable
    assert state.meta == {"counts": {"series": 3}, "dt": 0.1 + 0.2, "scene": "name: ä\n"}


@pytest.mark.parametrize("damage", ["flip", "cut", "empty", "gone"])
def test_damaged_checkpoint_falls_back(tmp_path, damage):
    path = tmp_path / "checkpoint"
    for step in (1, 2):
        checkpoint.save(path, ARRAYS | {"step": np.int64(step)}, META)
    raw = bytearray(path.read_bytes())
    raw[len(raw) // 2] ^= 1
    path.write_bytes({"flip": raw, "cut": raw[:-40], "empty": b"", "gone": b""}[damage])
    if damage == "gone":
        path.unlink()
    state = checkpoint.load(path)
    assert state.arrays["step"] == 1 and "checkpoint.previous" in state.note
    (tmp_path / "checkpoint.previous").write_bytes(b"")
    with pytest.raises(DustError, match="No valid checkpoint|no checkpoint"):
        checkpoint.load(path)
    checkpoint.discard(path)
    with pytest.raises(DustError, match="no checkpoint"):
        checkpoint.load(path)


def test_checkpoint_between_its_renames(tmp_path):
    path = tmp_path / "checkpoint"
    for step in (1, 2):
        checkpoint.save(path, {"step": np.int64(step)}, {})
    path.rename(tmp_path / "checkpoint.tmp")
    assert checkpoint.load(path).arrays["step"] == 2


def test_checkpoint_that_cannot_be_written(tmp_path):
    with pytest.raises(DustError, match="does not exist"):
        checkpoint.save(tmp_path / "nowhere" / "checkpoint", ARRAYS, META)
    with pytest.raises(TypeError, match="meta data"):
        checkpoint.save(tmp_path / "checkpoint", {}, {"x": object()})
