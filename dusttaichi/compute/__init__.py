"""Taichi for every method: its start, memory, workers and launches, sums and scans."""
