"""Results that another program has changed: sentences from every command, no traceback."""

import netCDF4
import pytest
import synthetic
from program import invoke

from dusttaichi.analysis import open_run
from dusttaichi.analysis.foreign import explain_foreign_errors
from dusttaichi.errors import DustError

ESCAPE = "\x1b]0;evil\x07\x1b[31mred"


def forge_result(path, change):
    """A result that another program has changed."""
    synthetic.plates_run(path)
    with netCDF4.Dataset(path, "a") as file:
        file.delncattr("digest")
        change(file)
    return path


def with_attribute(name, value):
    return lambda file: file.setncattr(name, value)


def without(name):
    return lambda file: file.renameVariable(name, "something_else")


CHANGES = {
    "a list as the scene": with_attribute("scene_resolved", "[1, 2]"),
    "no YAML as the scene": with_attribute("scene_resolved", "a: ["),
    "text for a number": with_attribute("grains", "many"),
    "numbers for a number": with_attribute("grains", [1, 2]),
    "number for a text": with_attribute("title", 3.0),
    "no grains": lambda file: file.delncattr("grains"),
    "mathtext": with_attribute("title", r"$\frac{$ $x"),
    "escapes": with_attribute("title", ESCAPE),
    "no loss": without("loss"),
    "no time": without("time"),
    "no pressure": without("pressure"),
    "no positions of walls": without("wall_force"),
}
DRAWN_AS_WELL = ("no grains", "escapes", "no positions of walls")
COMMANDS = (["plot"], ["compare"], ["export", "--to", "extxyz"], ["render"], ["report"])


# of those whose figures are drawn the default run has the half
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.long if name in DRAWN_AS_WELL else ())
        for name in CHANGES
    ],
)
def test_every_command_says_it_in_a_sentence(tmp_path, name):
    path = forge_result(tmp_path / "result.nc", CHANGES[name])
    for command, *options in COMMANDS:
        output = [] if command == "compare" else ["-o", tmp_path / f"{command}.png"]
        result = invoke(command, path, *options, *output)
        assert result.exception is None or isinstance(result.exception, (DustError, SystemExit)), (
            command,
            result.exception,
        )
        assert "\x1b" not in result.output + str(result.exception)


def test_a_mistake_of_ours_stays_one(tmp_path):
    """Of a result as it was written, what goes wrong is not its fault."""
    synthetic.plates_run(tmp_path / "result.nc")
    with pytest.raises(KeyError), explain_foreign_errors([tmp_path]):
        raise KeyError("pressure")
    path = forge_result(tmp_path / "other.nc", CHANGES["escapes"])
    with (
        pytest.raises(DustError, match="It has no attribute digest"),
        explain_foreign_errors([path]),
    ):
        raise KeyError("pressure")
    assert open_run(path).name == "]0;evil[31mred"


def test_an_error_of_hdf5_without_a_number(tmp_path):
    path = tmp_path / "result.nc"
    path.write_bytes(b"")
    with pytest.raises(DustError, match="Damaged .*HDF error.*result.nc"):
        with explain_foreign_errors([path]):
            raise OSError("NetCDF: HDF error")
