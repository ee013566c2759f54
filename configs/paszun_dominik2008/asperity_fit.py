"""Volume of asperities from a measured sticking speed on a wall, by simulations (PD08 section 2.2).

Each run throws many grains at a flat wall of their own material, along its normal, without damping
and far from each other, each at its own speed: the sticking speed is that at which they begin to
bounce. The volume of the scene's material is fitted to the first of POPPE; a last run has the other
grains.
"""

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.studies.user_study import UserStudy

# sticking speed of silica on silica [m/s] by radius [m], with errors of 0.1 and 0.4 (Poppe 2000)
POPPE = {0.6e-6: 1.2, 0.25e-6: 1.9}
(RADIUS, SPEED), (SMALL, _) = POPPE.items()
THROWN = 400  # grains of a run
WIDE, NARROW = 0.3, 0.03  # of the expected speed, to either side, in the first run and later ones
GAP = 5e-9  # m: more than the range of a contact
END = "65 ns"  # some five periods
CLOSE = 2e-4  # relative deviation from SPEED at which the fit ends
TRIES = 8
SCENE = {
    "interaction.damping": "none",
    "interaction.rolling": "off",
    "interaction.sliding": "off",
    "interaction.twisting": "off",
    "boundary": {"kind": "box", "omit": ["x_min", "x_max", "y_min", "y_max", "top"]},
    "numerics.time_step": "5 ps",  # 10 ps does not resolve how asperities flatten
    "stop": {"time": END},
    "output": {"snapshots": {"time": END}, "series": {"time": END}},
}


class Study(UserStudy):
    """Runs until the volume gives SPEED; sticking speeds are in m/s, volumes and radii in m."""

    def stages(self):
        volume, spread = self.scene.material.asperity_volume, WIDE
        for _ in range(TRIES):
            speed = yield from self.throw(volume, RADIUS, SPEED, spread)
            if spread == NARROW and abs(speed / SPEED - 1.0) < CLOSE:
                # PD08: the speed falls with the radius to the power of 5/6
                expected = SPEED * (RADIUS / SMALL) ** (5 / 6)
                yield from self.throw(volume, SMALL, expected, NARROW)
                return
            spread = NARROW if abs(speed / SPEED - 1.0) < 0.1 else WIDE
            # the energy of asperities grows as v^(4/5) (eqs 8 and 9), that of a grain as v^2
            volume *= (SPEED / speed) ** 1.2
        raise DustError(f"the fit to {SPEED:g} m/s has not converged; the last is {speed:.6g} m/s")

    def throw(self, volume, radius, expected, spread):
        """Stage of one run; returns its sticking speed [m/s]."""
        speeds = expected * np.linspace(1.0 - spread, 1.0 + spread, THROWN)
        x, v = np.zeros((2, THROWN + 1, 3))
        x[:, 0] = 10.0 * radius * np.arange(THROWN + 1)
        x[:-1, 2] = GAP  # above the last one, which rests on the wall
        v[:-1, 2] = -speeds
        sample = {"kind": "explicit", "positions": write(x, "m"), "velocities": write(v, "m/s")}
        changes = SCENE | {"sample": sample, "material.radius": f"{radius} m"}
        changes["interaction.asperities"] = {"volume": f"{volume:.17g} m"}
        label = f"volume_{volume * 1e9:.6g}_nm_radius_{radius * 1e6:g}_um_from_{speeds[0]:.3f}_m_s"
        yield [self.point(label, changes)]
        result = self.results[label]
        if not result.ok:
            raise DustError(result.text)
        if np.isnan(result.measured["sticking_speed"]):
            ends = f"{speeds[0]:.3g} and {speeds[-1]:.3g} m/s"
            raise DustError(f"grains of {label} all stick or all bounce between {ends}")
        return result.measured["sticking_speed"]

    def measure(self, run):
        speeds = -run.snapshots.velocity[0, :-1, 2].values
        touching = run.contacts(-1, "wall_contacts").grain.values
        sticks = np.isin(np.arange(len(speeds)), touching)
        bounced = int(np.argmin(sticks))  # the first that bounces
        speed = np.nan
        if bounced and not sticks.all() and not sticks[bounced:].any():
            speed = float(speeds[bounced - 1] + speeds[bounced]) / 2
        return {"sticking_speed": speed}

    def dataset(self, results):
        scenes = [result.point.scene for result in results.values()]
        volumes = [scene.interaction.asperities.volume for scene in scenes]
        radii = [scene.material.radius for scene in scenes]
        columns = {"volume": ("point", volumes), "radius": ("point", radii)}
        return super().dataset(results).assign(columns)


def write(vectors, unit):
    """Vectors as in a YAML file."""
    return [[f"{number:.17g} {unit}" for number in vector] for vector in vectors]
