"""Taichi and the machine for every method: start, memory, workers, sums, processes."""
