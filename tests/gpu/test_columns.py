"""Layout of the contacts in the memory of a device."""

from scenes import make_scene

from dusttaichi.compute.backend import start_taichi
from dusttaichi.compute.engine import ti
from dusttaichi.grains.kernels.declare import GrainVariable, place


def test_a_number_of_neighbouring_contacts_is_side_by_side():
    """Threads of a device read it together; on a CPU the numbers of a block are side by side."""
    moving = [GrainVariable(name, "", "", ("f64", 3), (8,)) for name in ("x", "v", "w")]
    contact = GrainVariable("contact", "", "", ("f64", 0), (8, 5, 1))
    for by_columns, expected in ((True, 8), (False, 40)):
        start_taichi(make_scene(), 1)
        field = place([*moving, contact], by_columns)["contact"]

        @ti.kernel
        def apart(field: ti.template()) -> ti.u64:
            return ti.get_addr(field, [1, 0, 0]) - ti.get_addr(field, [0, 0, 0])

        assert apart(field) == expected
