"""Losses of each grain by channel, summed over its contacts since the last time."""

from dusttaichi.compute.engine import ti
from dusttaichi.grains.kernels.list_entries import contact_of, is_of_second
from dusttaichi.grains.kernels.store import FIRST_SPHERE, GRAINS


def make_add_grain_losses(fields, layout):
    """Kernel that adds the losses of the listed contacts since the last call to their grains.

    Half of it to each of two grains, all of it where the other body is a wall or the rigid sphere.
    To be called before a search replaces the lists. Every grain sums its own contacts in the order
    of its list.
    """
    width, channels = layout.width, len(layout.channels)
    first, contact, counts = layout.rows["recent"][0], fields["contact"], fields["counts"]
    entry_start, entry, grain_loss = fields["entry_start"], fields["entry"], fields["grain_loss"]

    @ti.func
    def add(g, c, fraction):
        for n in ti.static(range(channels)):
            lost = ti.cast(contact[c // width, first + n, c % width], ti.f64)
            grain_loss[g, n] = grain_loss[g, n] + fraction * lost

    @ti.func
    def clear(c):
        for n in ti.static(range(channels)):
            contact[c // width, first + n, c % width] = 0.0

    @ti.kernel
    def add_grain_losses():
        for grain in range(counts[GRAINS]):
            for at in range(entry_start[grain], entry_start[grain + 1] - 1):
                number = contact_of(entry[at], width)
                is_outside = number >= counts[FIRST_SPHERE] * width
                add(grain, number, ti.select(is_outside, 1.0, 0.5))
        for grain in range(counts[GRAINS]):
            for at in range(entry_start[grain], entry_start[grain + 1] - 1):
                if is_of_second(entry[at], width) == 0:  # once for each contact
                    clear(contact_of(entry[at], width))

    return add_grain_losses
