"""Fit of the number of the asperities to a sticking speed by simulations (PD08 section 2.2).

Grains collide with a flat wall of their own material, along its normal and without damping. One
simulation contains many, far from each other and each with its own speed, and brackets the speed at
which they begin to bounce. The fit is a study of the engine, with a request for each simulation.
"""

from dataclasses import dataclass
from math import isclose

import numpy as np
import scipy

from dusttaichi.errors import DustError
from dusttaichi.grains.contacts import wall_contact_state
from dusttaichi.physics.contact import asperities
from dusttaichi.physics.contact.constants import grain_mass, wall_constants
from dusttaichi.samples import Sample
from dusttaichi.scene import Scene, quantities
from dusttaichi.studies.requests import Request, key_of

POPPE = {0.6e-6: (1.2, 0.1), 0.25e-6: (1.9, 0.4)}
"""Sticking speed of silica on silica by radius [m], and its error [m/s] (Poppe et al. 2000)."""
THROWN = 400  # grains of a simulation
SPREAD = 0.03  # of the expected speed, to either side
STEP = 0.02e-9  # s: a five-hundredth of a period
END = 60e-9  # s: some five periods
CLOSE = 2e-4  # relative deviation from the given speed at which the fit ends
TRIES = 8
TASK = f"{__name__}:simulate"


def _scene(material, radius, volume):
    changed = material if radius is None else {"base": material, "radius": f"{radius:.17g} m"}
    off = dict.fromkeys(("rolling", "sliding", "twisting"), "off")
    return Scene.from_dict(
        {
            "name": "sticking",
            "material": changed,
            "interaction": {**off, "damping": "none", "asperities": {"volume": f"{volume:.17g} m"}},
            "sample": {"kind": "explicit", "positions": [["0 m", "0 m", "0 m"]]},
            "boundary": {"kind": "box", "omit": ["x_min", "x_max", "y_min", "y_max", "top"]},
            "stop": {"steps": 1},
            "numerics": {"time_step": f"{STEP:.17g} s", "threads": 1},
        }
    )


def sticking_speed_balance(material, volume, radius=None):
    """Speed [m/s] at which the kinetic energy is E_asp plus the energy to leave: no simulation.

    material: name of one. volume: deformed per area [m]. radius [m]: other than the material's.
    """
    scene = _scene(material, radius, volume)
    contact, mass = wall_constants(scene.material, scene.interaction), grain_mass(scene.material)

    def surplus(speed):
        energy = 0.5 * mass * speed**2
        lost = contact.crush_energy * asperities.area(energy, contact.crush_force)
        return energy - lost - contact.barrier

    return scipy.optimize.brentq(surplus, 0.0, 1e3, xtol=1e-9)


def sticking_speed(material, volume, radius=None):
    """Largest speed [m/s] at which a grain sticks to a wall, and half the bracket, by simulation.

    Parameters as of `sticking_speed_balance`. Raises DustError if all grains stick or all bounce.
    """
    from dusttaichi.grains.build import build  # with the compiler, which the parent needs not

    scene = _scene(material, radius, volume)
    r, expected = scene.material.radius, sticking_speed_balance(material, volume, radius)
    speeds = np.linspace(1.0 - SPREAD, 1.0 + SPREAD, THROWN) * expected
    delta0 = wall_constants(scene.material, scene.interaction).delta0
    x = np.zeros((THROWN + 1, 3))
    x[:, 0] = 10.0 * r * np.arange(THROWN + 1)
    # the last one rests on the wall; the others just touch it in the first step
    x[:-1, 2] = delta0 + speeds * STEP * (1.0 - 1e-6)
    v = np.zeros_like(x)
    v[:-1, 2] = -speeds
    sim = build(scene, Sample(x, v, np.zeros_like(x)))
    sim.advance(round(END / STEP))
    sticks = np.isin(np.arange(THROWN), wall_contact_state(sim)["grain"])
    last = int(np.argmin(sticks))  # the first that bounces
    if sticks.all() or last == 0 or sticks[last:].any():
        raise DustError(
            f"No sticking speed between {speeds[0]:.4g} and {speeds[-1]:.4g} m/s at a volume of "
            f"{quantities.format(volume, 'length', digits=4)}: grains stick or bounce at all of "
            "them."
        )
    return 0.5 * (speeds[last - 1] + speeds[last]), 0.5 * (speeds[last] - speeds[last - 1])


def simulate(parent, **arguments):
    """Task of a worker process: the `sticking_speed` of its arguments, and half the bracket."""
    speed, sigma = sticking_speed(**arguments)
    return {"speed": speed, "sigma": sigma}


@dataclass(frozen=True)
class Fit:
    """Fitted volume [m] deformed per area, its sticking speed [m/s], and half the bracket."""

    volume: float
    speed: float
    sigma: float


class AsperityFit:
    """Study of the volume for which a grain of `material` (a name) sticks up to `speed` [m/s].

    Followed by the sticking speeds of the grains of POPPE. The constructor and `points` raise
    DustError where grains without asperities stick at the speed, or the fit does not converge.
    """

    scene = directory = file = None  # nothing is written
    timed = False

    def __init__(self, material="silica_pd08", speed=POPPE[0.6e-6][0]):
        self.material, self.speed = material, speed
        self._first = _volume_balance(material, speed)

    def points(self, results_by_label):
        """The next simulation of the fit, after it those of POPPE."""
        for failed in (result for result in results_by_label.values() if not result.ok):
            raise DustError(failed.text)
        fit, request = self._fit(results_by_label)
        return [request] if fit is None else self._measured(fit)

    def result(self, results_by_label):
        """The numbers of the fit, SI, once all points are found, as plain data."""
        fit, _ = self._fit(results_by_label)
        grains = [
            results_by_label[point.label].measured
            | {"radius": radius, "poppe": POPPE[radius][0], "poppe_error": POPPE[radius][1]}
            | {"balance": sticking_speed_balance(self.material, fit.volume, radius)}
            for radius, point in zip(POPPE, self._measured(fit), strict=True)
        ]
        numbers = {"material": self.material, "asperity_volume": fit.volume}
        numbers |= {"speed": fit.speed, "sigma": fit.sigma}
        return numbers | {"speed_without_asperities": _bare(self.material), "grains": grains}

    def _fit(self, results_by_label):
        """(Fit, None), or (None, the simulation that it waits for)."""
        volume = self._first
        for _ in range(TRIES):
            point = self._request(volume)
            if point.label not in results_by_label:
                return None, point
            speed, sigma = (
                results_by_label[point.label].measured[name] for name in ("speed", "sigma")
            )
            if abs(speed / self.speed - 1.0) < CLOSE:
                return Fit(volume, speed, sigma), None
            # E_asp grows as v^(4/5) (eqs 8 and 9 far above F_c), the energy of the grain as v^2
            volume *= (self.speed / speed) ** 1.2
        raise DustError(
            f"The fit to {self.speed:.4g} m/s has not converged; the last speed is {speed:.6g}."
        )

    def _measured(self, fit):
        """Requests for the grains of POPPE; that of the material itself is known from the fit."""
        fitted_radius = _scene(self.material, None, fit.volume).material.radius
        radii = (None if isclose(radius, fitted_radius) else radius for radius in POPPE)
        return [self._request(fit.volume, radius) for radius in radii]

    def _request(self, volume, radius=None):
        arguments = {"material": self.material, "volume": volume, "radius": radius}
        return Request(key_of(TASK, arguments), TASK, arguments)


def lines(numbers):
    """Lines of text on the numbers of `AsperityFit.result`."""
    volume = quantities.format(numbers["asperity_volume"], "length", digits=4)
    yield (
        f"asperity_volume of {numbers['material']}: {volume} (sticking speed on a wall "
        f"{numbers['speed']:.4f} +- {numbers['sigma']:.4f} m/s; "
        f"without asperities {numbers['speed_without_asperities']:.3f} m/s)"
    )
    for grain in numbers["grains"]:
        radius = quantities.format(grain["radius"], "length")
        yield (
            f"radius {radius}: sticks up to {grain['speed']:.4f} m/s (energy balance "
            f"{grain['balance']:.4f}); Poppe et al. 2000: {grain['poppe']} +- "
            f"{grain['poppe_error']} m/s"
        )


def _bare(material):
    scene = _scene(material, None, 1e-15)
    contact = wall_constants(scene.material, scene.interaction)
    return float(np.sqrt(2.0 * contact.barrier / grain_mass(scene.material)))


def _volume_balance(material, speed):
    """Volume [m] at which the energies balance at `speed`."""
    scene = _scene(material, None, 1.0)
    contact = wall_constants(scene.material, scene.interaction)
    energy = 0.5 * grain_mass(scene.material) * speed**2
    if energy <= contact.barrier:
        raise DustError(
            f"speed = {speed:.4g} m/s: grains stick up to {_bare(material):.3g} m/s without "
            "asperities; use a higher speed"
        )
    per_volume = contact.crush_energy * asperities.area(energy, contact.crush_force)
    return (energy - contact.barrier) / per_volume
