"""Records that tell the step that they are of, written and read back."""

import numpy as np
import synthetic

from dusttaichi.results.reading import open_tree

GRAINS = 50


def fill(writer, first, last, rows=7):
    """Series records first..last-1, and a snapshot with `rows` contacts at every tenth."""
    for step in range(first, last):
        writer.append("series", synthetic.series_record(step))
        if step % 10 == 0:
            for group, record in synthetic.snapshot_records(step, GRAINS, rows + step).items():
                writer.append(group, record)


def check(path, least=0, rows=7):
    """The file holds an unbroken sequence of records as `fill` writes them; their number."""
    with open_tree(path) as tree:
        count = tree.sizes["time"]
        steps = np.arange(count)
        np.testing.assert_array_equal(tree.step, steps)
        np.testing.assert_array_equal(tree.pressure, np.repeat(steps[:, None], 6, 1))
        frames = tree["snapshots"]
        np.testing.assert_array_equal(frames.step, steps[::10])
        np.testing.assert_array_equal(frames.position[:, -1, 0], steps[::10] + 0.1)
        np.testing.assert_array_equal(frames.contact_count, rows + steps[::10])
        owner = np.repeat(steps[::10], rows + steps[::10])
        np.testing.assert_array_equal(tree["contacts"].grain_j, owner)
        np.testing.assert_array_equal(tree["contacts"].pointer_i[:, 2], owner)
        np.testing.assert_array_equal(tree["wall_contacts"].foot[:, 0], np.repeat(steps[::10], 2))
    assert count >= least
    return count
