"""Conditions of the figures of the continuum: to which runs they apply."""


def intrudes(run):
    """A bead falls on dust, and snapshots show it."""
    return run.snapshots is not None and run.intrudes
