"""Taichi for every method: how it is started, read and laid out in memory; workers, scans."""
