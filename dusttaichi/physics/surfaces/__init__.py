"""Surfaces that grains touch as they touch a wall, one a file (registered in `scene.surfaces`).

A surface is plain Python, which kernels compile and NumPy evaluates: arithmetic, `abs` and `**`
alone. x: three components of a point, numbers or arrays; s: the numbers of the surface by name. It
has

- ``NUMBERS``: name -> Number, its constants, and ``numbers(block)``: their values in SI;
- ``distance(x, s)`` of a point, positive on the side of the grains, which the search and the
  overlaps are computed from;
- ``normal(x, s)``: the three components of the unit normal there, towards the grains.

It may have ``curvatures(s)``: the two principal curvatures [1/m], positive where the surface bends
around the grains; without it the constants of its contacts are those of a flat wall. A number
`centre` is the point that the surface turns about.
"""
