"""The kernel of a search: all lists in one launch, which takes Python as long as many steps."""

from dusttaichi.compute.engine import ti
from dusttaichi.grains.kernels.gather import Walls
from dusttaichi.grains.kernels.grain_cells import make_find
from dusttaichi.grains.kernels.relist import make_body_relist, make_relist
from dusttaichi.grains.kernels.sphere_motion import SphereLists
from dusttaichi.grains.kernels.wall_search import WallLists, make_fold
from dusttaichi.particles.cells import Cells


def make_neighbour_lists(fields, scratch, layout, *, walls, write_constants):
    """Kernel `list_neighbours(box)`: pairs, contacts with walls and sphere, those of every grain.

    Where it sets counts[OVERFLOW], the lists are not valid. walls: true if there are any.
    write_constants: `make_write_constants` of kernels.polydisperse, or None of equal grains.
    """
    cells = Cells(scratch["grid"], 3, periodic=layout.periodic, tilted=layout.tilted)
    find = make_find(fields, scratch, layout, cells)
    list_types = [WallLists] * walls + [SphereLists] * layout.sphere
    list_builders = [Lists(fields, scratch, layout, write_constants) for Lists in list_types]
    relist, write_entries = make_relist(fields, scratch, layout, write_constants, list_builders)
    fold = make_fold(fields) if walls else None
    relist_others = [make_body_relist(fields, scratch, layout, lists) for lists in list_builders]

    @ti.kernel
    def list_neighbours(box: Walls):
        grid = cells.grid()
        find(grid)
        relist(grid)
        if ti.static(walls):
            fold()
        for relist_other in ti.static(relist_others):
            relist_other(box, grid)
        write_entries()

    return list_neighbours
