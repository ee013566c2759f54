"""Entries of the lists of contacts of the grains: a contact, and which of its bodies a grain is.

An entry is the number of a row of lanes, of which a block has two, times the lanes of a row, plus
the lane: the first row is for the first bodies of the contacts of a block, the second for the
second. -1 ends a list.
"""

import numpy as np

from dusttaichi.compute.engine import ti


@ti.func
def encode_entry(contact, is_second, width: ti.template()):
    """The entry of a contact in the list of its first body, or of its second (is_second 1)."""
    return (2 * (contact // width) + is_second) * width + contact % width


@ti.func
def contact_of(entry, width: ti.template()):
    """Number of the contact of an entry, which is not negative."""
    return entry // (2 * width) * width + entry % width


@ti.func
def is_of_second(entry, width: ti.template()):
    """1 in the list of the second body of a contact, 0 in that of the first."""
    return (entry // width) % 2


def decode_entries(entries, width):
    """(number of the contact, whether the list is that of its second body) of entries, arrays."""
    row, lane = np.divmod(entries, width)
    return (row >> 1) * width + lane, (row & 1).astype(bool)
