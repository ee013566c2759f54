"""A material of the continuum from grain runs (`dust fit continuum`).

Observations of grain runs (`observations`) are compared with a material point under the same strain
(`model`), in one fit of all numbers of the material (`fitting`). The result is a block of YAML with
the source of each number (`writing`).
"""
