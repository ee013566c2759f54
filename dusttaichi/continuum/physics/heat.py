"""Heat of a particle, of which the host and kernels form sums, and its temperature."""


def heat(work, elastic, stored, warmed, recent):
    """Heat of a particle since the start [J]: what is not stored of the work of its stresses.

    work: of its stresses [J]; elastic, stored: its elastic energy, now and at the start; warmed:
    dissipated by viscosity and grid noise; recent: the same in the half step up to the present.
    """
    return work - elastic + (stored + warmed) + recent


def temperature(start, energy, capacity):
    """Temperature [K] of a particle that began with `start`; energy: its heat; capacity: [J/K]."""
    return start + energy / capacity
