"""Work of NumPy shared out to threads."""

import numpy as np
import pytest

from dusttaichi.compute.host_threads import cut_rows, share_out


@pytest.mark.parametrize("threads", [1, 3])
def test_every_item_is_done_once(threads):
    done = np.zeros(10, int)

    def count(part):
        done[part] += 1

    slices = cut_rows(10, 4)
    assert [part.stop - part.start for part in slices] == [4, 4, 2]
    share_out(count, slices, threads)
    assert (done == 1).all()


@pytest.mark.parametrize("threads", [1, 2])
def test_what_a_call_raises_is_raised(threads):
    with pytest.raises(ZeroDivisionError):
        share_out(lambda item: 1 // item, [1, 0, 2], threads)
