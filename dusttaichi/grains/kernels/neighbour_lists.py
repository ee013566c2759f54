"""The kernels of a search: all lists at once, for a launch takes Python as long as many steps."""

from dusttaichi.compute.engine import ti
from dusttaichi.grains.kernels.gather import Walls
from dusttaichi.grains.kernels.relist import make_relist
from dusttaichi.grains.kernels.search import make_find
from dusttaichi.grains.kernels.wall_search import make_wall_relist
from dusttaichi.particles.cells import Cells


def make_neighbour_lists(fields, scratch, layout, *, walls, write_constants):
    """Kernels `list_neighbours(box)` and `list_entries()`.

    The first lists pairs, contacts with walls, and, in scenes without a sphere, the contacts of
    every grain; the second these where the sphere's come before, else it is None. Where
    counts[OVERFLOW] is set meanwhile, the lists are void. walls: true if there are any.
    write_constants: `make_write_constants` of kernels.polydisperse, or None of equal grains.
    """
    cells = Cells(scratch["grid"], 3, periodic=layout.periodic, tilted=layout.tilted)
    find = make_find(fields, scratch, layout, cells)
    relist, write_entries = make_relist(fields, scratch, layout, write_constants)
    relist_walls = make_wall_relist(fields, scratch, layout, write_constants) if walls else None

    @ti.kernel
    def list_neighbours(box: Walls):
        grid = cells.grid()
        find(grid)
        relist(grid)
        if ti.static(walls):
            relist_walls(box)
        if ti.static(not layout.sphere):
            write_entries()

    @ti.kernel
    def list_entries():
        write_entries()

    return list_neighbours, list_entries if layout.sphere else None
