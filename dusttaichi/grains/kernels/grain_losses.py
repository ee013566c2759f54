"""Losses of each grain by channel, summed over its contacts since the last time."""

from dusttaichi.compute.engine import ti
from dusttaichi.grains.kernels.store import FIRST_SPHERE, GRAINS


def make_add_grain_losses(fields, layout):
    """Kernel that adds the losses of the listed contacts since the last call to their grains.

    Half of it to each of two grains, all of it where the other body is a wall or the rigid sphere.
    To be called before a search replaces the lists. Every grain sums its own contacts in the order
    of its list.
    """
    W, channels = layout.width, len(layout.channels)
    first, contact, counts = layout.rows["recent"][0], fields["contact"], fields["counts"]
    entry_start, entry, grain_loss = fields["entry_start"], fields["entry"], fields["grain_loss"]

    @ti.kernel
    def add_grain_losses():
        for g in range(counts[GRAINS]):
            for e in range(entry_start[g], entry_start[g + 1]):
                if entry[e] >= 0:  # else the end of the list
                    block, lane = entry[e] // W // 2, entry[e] % W
                    share = ti.select(block < counts[FIRST_SPHERE], 0.5, 1.0)
                    for n in ti.static(range(channels)):
                        lost = ti.cast(contact[block, first + n, lane], ti.f64)
                        grain_loss[g, n] = grain_loss[g, n] + share * lost
        for g in range(counts[GRAINS]):
            for e in range(entry_start[g], entry_start[g + 1]):
                # once for each contact: by its first body, which has the even row
                if entry[e] >= 0 and entry[e] // W % 2 == 0:
                    for n in ti.static(range(channels)):
                        contact[entry[e] // W // 2, first + n, entry[e] % W] = 0.0

    return add_grain_losses
