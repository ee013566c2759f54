"""Benchmarks for the developers of dusttaichi, from a clone: `python -m benchmarks --help`.

Every configuration runs in a worker process of its own, on samples that are made once and kept
(sample.py). Nothing here is part of the package that users install; how fast a machine is, they
learn from `dust bench`.
"""
