"""Exclusive prefix sums, in three loops: over chunks, over their sums, over the chunks again."""

import taichi as ti

from dusttaichi.grains.kernels.store import CHUNK


@ti.data_oriented
class Scan:
    """Functions of the three loops; chunk_sum: a field with room for a number a chunk."""

    def __init__(self, chunk_sum):
        self.chunk_sum = chunk_sum

    @ti.func
    def chunks(self, n):
        """Chunks of n numbers."""
        return (n + CHUNK - 1) // CHUNK

    @ti.func
    def add(self, values: ti.template(), chunk, n):
        """The sum of a chunk of the first n values."""
        total = 0
        for k in range(chunk * CHUNK, ti.min((chunk + 1) * CHUNK, n)):
            total += values[k]
        self.chunk_sum[chunk] = total

    @ti.func
    def starts(self, chunks):
        """Where each chunk begins."""
        total = 0
        for chunk in range(chunks):
            here = self.chunk_sum[chunk]
            self.chunk_sum[chunk] = total
            total += here

    @ti.func
    def fill(self, values: ti.template(), starts: ti.template(), chunk, n):
        """Where each value of a chunk begins."""
        total = self.chunk_sum[chunk]
        for k in range(chunk * CHUNK, ti.min((chunk + 1) * CHUNK, n)):
            here = values[k]
            starts[k] = total
            total += here
