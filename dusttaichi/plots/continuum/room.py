"""What figures of the continuum share: to which of its runs they apply."""


def intrudes(run):
    """A bead falls on dust, and snapshots show it."""
    return run.snapshots is not None and run.intrudes
