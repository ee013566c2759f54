"""Order of the grains in memory: neighbours in space are near in memory, for caches and workers.

A worker computes a contiguous run of the grains and of their pairs (grains.step). Numbers that one
worker computes and another reads go from core to core, which takes as long as a hundred operations,
several hundred where the cores share no cache. So the runs of two, four, eight workers are halves
of the sample, halves of those and so on, each cut across its longest edge, and the grains at a cut
are together.
"""

import numpy as np

PART = 256  # grains that are not cut
MOST_CUTS = 7  # times that a sample is cut
NEAR_CUTS = 3  # of the first of them, the grains at a cut are together


def grain_order(positions, cell):
    """Indices of the grains (N,) in their order in memory. positions (N, 3).

    Part by part, within a part along a Morton curve, the grains at a cut last. cell: edge of the
    cells of that curve, two grains wide.
    """
    key = morton_key(positions, cell)
    groups, at_cut = bisect_grains(positions, 0.5 * cell)
    return np.concatenate([group[np.lexsort((key[group], at_cut[group]))] for group in groups])


def order_by_members(positions, radii, members):
    """`grain_order` of grains of these radii, one number or (N,); of each member by itself.

    members: grains of both bodies of each (grains.members), or None.
    """
    ends = np.cumsum([len(positions)] if members is None else np.sum(members, axis=1)).tolist()
    orders_of_members = []
    for first, end in zip([0, *ends[:-1]], ends, strict=True):
        cell = 4.0 * float(np.median(radii[first:end]) if np.ndim(radii) else radii)
        orders_of_members.append(first + grain_order(positions[first:end], cell))
    return np.concatenate(orders_of_members)


def bisect_grains(positions, reach):
    """Order of the grains by bisection, and the cuts that each grain is near.

    (indices of the grains, in parts; (N,) which of the first cuts each is within `reach` of, a bit
    each, that of the first cut the highest).
    """
    groups, at_cut = [np.arange(len(positions))], np.zeros(len(positions), np.int64)
    for n in range(MOST_CUTS):
        if len(groups[0]) < 2 * PART:
            break
        halves = []
        for group in groups:
            group_positions = positions[group]
            coordinate = group_positions[:, np.argmax(np.ptp(group_positions, axis=0))]
            rising, middle = np.argsort(coordinate, kind="stable"), len(group) // 2
            if n < NEAR_CUTS:
                cut = 0.5 * (coordinate[rising[middle - 1]] + coordinate[rising[middle]])
                at_cut[group] = 2 * at_cut[group] + (np.abs(coordinate - cut) < reach)
            halves += [group[rising[:middle]], group[rising[middle:]]]
        groups = halves
    return groups, at_cut


def morton_key(positions, cell):
    """Number (N,) of each grain's cell along a Morton curve."""
    c = np.floor((positions - positions.min(axis=0)) / cell).astype(np.int64)
    key = np.zeros(len(c), np.int64)
    for bit in range(min(20, int(c.max(initial=0)).bit_length())):
        for axis in range(3):
            key |= ((c[:, axis] >> bit) & 1) << (3 * bit + axis)
    return key


def rank_of(order):
    """Internal number of each grain of the sample."""
    rank = np.empty(len(order), int)
    rank[order] = np.arange(len(order))
    return rank
