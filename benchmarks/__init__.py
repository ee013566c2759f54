"""Benchmarks for the developers of dusttaichi, from a clone: `python -m benchmarks --help`.

Every configuration runs in a worker process of its own, on stored samples (sample.py). The
benchmarks are not a part of the installed package; users measure a machine by `dust bench`.
"""
