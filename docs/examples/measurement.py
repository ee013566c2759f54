"""A measurement of one's own: how far the grains of a collision are spread, every 2 ns.

What the function returns is in a group of its own in result.nc, with its times. The run is bitwise
that of `dust run`.
"""

import numpy as np

import dusttaichi as dt

scene = dt.from_yaml("""
name: two_clusters
material: silicate_s12
sample:
  kind: collision
  target: {kind: bcca, grains: 8, seed: 1}
  projectile: {kind: bcca, grains: 8, seed: 2}
  speed: 2 m/s
  gap: 2 nm
boundary: {kind: open}
stop: {time: 20 ns}
output: {series: {time: 2 ns}}
""")


def spread(simulation):
    """Radius of gyration [m], and the fastest grain [m/s]."""
    x = simulation.positions
    return {
        "gyration": np.sqrt(np.mean(np.sum((x - x.mean(axis=0)) ** 2, axis=1))),
        "fastest": np.linalg.norm(simulation.velocities, axis=1).max(),
    }


simulation = dt.simulate(scene)
simulation.every("2 ns", spread, units={"gyration": "m", "fastest": "m/s"})
simulation.advance("10 ns")
print(
    simulation.time, simulation.measure().coordination_number, len(simulation.contacts["overlap"])
)
simulation.run()
with dt.open_run(simulation.flush()) as result:
    print(result.series.time.size, "records")
records = simulation.records("spread")
print(records["record_time"], records["gyration"])
