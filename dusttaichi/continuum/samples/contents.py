"""Quantities that particles of the continuum have in the columns of a file."""

from dataclasses import replace

from dusttaichi.samples.formats.contents import Contents

_IN_SPACE = Contents(
    noun="particles",
    quantities=frozenset(
        "position velocity mass density filling_factor reference deviator role id".split()
    ),
    columns="x y z mass and optionally vx vy vz, density or phi, reference, and the deviator of "
    "the stress xx yy zz xy xz yz",
    vectors="x, y, z",
    example="x, y, z, mass",
    needs_mass=True,
    fills_zeros=True,
    history=frozenset({"damage", "temperature", "material"}),
)
CONTENTS = {
    2: replace(
        _IN_SPACE,
        columns="x z mass and optionally vx vz, density or phi, reference, and the deviator of the "
        "stress xx yy zz xz",
        vectors="x, z",
        example="x, z, mass",
        plane=True,
    ),
    3: _IN_SPACE,
}
"""Contents by the number of dimensions."""
