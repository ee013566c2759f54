"""`dust selftest`: correctness and speed of a backend on this machine."""
