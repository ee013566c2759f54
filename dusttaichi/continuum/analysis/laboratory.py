"""Laboratory results of beads that fall on dust (Güttler et al. 2009)."""

import numpy as np

# G09 Table 2: diameter [mm], mass [mg], speed [m/s], depth [mm], stopping time [ms]
DROPS = np.array([
    (2.73, 25.7, 0.89, 3.16, 5.92), (2.94, 32.0, 0.85, 3.08, 5.93), (2.77, 26.4, 0.73, 2.70, 6.09),
    (2.94, 32.0, 0.17, 0.70, 6.18), (2.94, 32.0, 0.16, 0.75, 7.13), (2.94, 32.0, 0.20, 0.80, 5.92),
    (2.94, 32.0, 0.32, 1.31, 6.47), (2.77, 27.6, 0.50, 2.03, 6.38), (2.77, 26.4, 0.37, 1.33, 5.71),
    (0.99, 1.5, 0.67, 1.06, 3.09), (0.99, 1.5, 0.76, 1.15, 2.94), (0.99, 1.5, 0.79, 1.47, 3.12),
    (0.85, 1.0, 0.19, 0.32, 2.46), (0.85, 1.0, 0.35, 0.83, 3.28), (0.85, 1.0, 0.36, 0.72, 3.11),
])  # fmt: skip
COMPACTED = (0.8, 1.2)  # volume of compacted dust in volumes of the bead (G09 section 3.4.2)
MOST_FREQUENT = 0.23  # filling factor below the bead (G09 Fig 11)
LEAST_COMPARED = 0.22  # filling factor from which the cumulated volume is a benchmark (Fig 15)


def sphere_mass(diameter, density):
    """Mass of a sphere [kg]."""
    return np.pi / 6.0 * diameter**3 * density


def depth(mass, speed):
    """Depth [m] after which a bead stops (G09 eq 12): 3.86e-2 m^0.23 v^0.89, SI."""
    return 3.86e-2 * mass**0.23 * speed**0.89


def stopping_time(mass, speed):
    """Time [s] after which a bead stops (G09 eq 13): 6.77e-2 m^0.23 v^0.01, SI."""
    return 6.77e-2 * mass**0.23 * speed**0.01


def drops():
    """Drops of G09 Table 2 in SI: dict of arrays (15,).

    They are diameter, mass, speed, depth, time, and momentum m v / A [kg/(m s)].
    """
    diameter, mass, speed, reached, time = (DROPS * [1e-3, 1e-6, 1.0, 1e-3, 1e-3]).T
    momentum = mass * speed / (np.pi / 4.0 * diameter**2)
    return {
        "diameter": diameter,
        "mass": mass,
        "speed": speed,
        "depth": reached,
        "time": time,
        "momentum": momentum,
    }
