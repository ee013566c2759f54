"""Surfaces that grains touch as they touch a wall, one a file.

A surface has the functions `distance(x, s)` of a point from it, `normal(x, s)` there, into the
room, and `bend(x, s)`: the angle by which the normal turns over a length of the way `across(v)` of
a point, which leaves out the directions in which the surface is straight. s: its numbers. Points
are vectors of kernels, or arrays (3, n). Contacts take the surface for its tangent plane: their
constants are those of a flat wall, and their displacements follow the normal as it turns.
"""
