"""Damping of the normal motion: F = -kappa u n_c on grain 1, u = (v1 - v2).n_c (S12 eq 7).

A law says kappa at a = a0, and `coefficient(s, p)` at the contact radius of now, a = a0 s^2.
"""
