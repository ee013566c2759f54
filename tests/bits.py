"""Result files compared to the last bit."""

import numpy as np
import xarray as xr


def tree(path):
    """All numbers of a result file by name, without the wall clock."""
    with xr.open_datatree(path, engine="netcdf4") as opened:
        return numbers(opened)


def numbers(opened):
    """Those of an open one."""
    return {
        f"{group.path}/{name}": values.to_numpy()
        for group in opened.subtree
        for name, values in group.to_dataset().variables.items()
        if name != "wall_clock"
    }


def assert_same_bits(a, b):
    """Of two result files, or of what `tree` says of them."""
    a, b = (found if isinstance(found, dict) else tree(found) for found in (a, b))
    assert a.keys() == b.keys()
    for name in a:
        np.testing.assert_array_equal(a[name], b[name], err_msg=name)


def difference(a, b):
    """In what the two differ, or None."""
    try:
        assert_same_bits(a, b)
    except (AssertionError, OSError) as error:
        return str(error)
    return None
