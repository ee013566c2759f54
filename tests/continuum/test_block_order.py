"""The order of blocks: any number of threads sorts as np.lexsort does."""

import numpy as np
import pytest

from dusttaichi.continuum import dust_state, particle_search


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("columns", [1, 7, 900])
def test_columns_are_sorted_as_by_lexsort(monkeypatch, columns, threads):
    """Also particles of one place, and columns longer than what is sorted together."""
    monkeypatch.setattr(particle_search, "SORTED_AT_ONCE", 64)
    rng = np.random.default_rng(1)
    column = rng.integers(0, columns, 1000)
    along = np.where(column % 2 == 1, -1.0, 1.0) * rng.integers(0, 5, 1000)
    order = particle_search._sort_columns(column, along, threads)
    assert np.array_equal(order, np.lexsort((along, column)))


@pytest.mark.parametrize("threads", [1, 3])
def test_rows_are_reordered_by_parts(monkeypatch, threads):
    monkeypatch.setattr(dust_state, "ROWS_AT_ONCE", 64)
    values = np.random.default_rng(2).random((1000, 5))
    rows, order = values.copy(), np.random.default_rng(3).permutation(1000)
    dust_state._reorder(rows.view("V40")[:, 0], order, threads)
    assert np.array_equal(rows, values[order])
