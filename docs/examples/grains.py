"""A sample of one's own from arrays: a ring of grains that fall on a floor."""

import numpy as np

import dusttaichi as dt

scene = dt.from_yaml("""
name: ring
material: silicate_s12
sample: {kind: chain, grains: 12}
boundary: {kind: box, omit: [x_min, x_max, y_min, y_max, top]}
stop: {time: 5 ns}
output: {series: {time: 1 ns}}
""")

angle = np.arange(12) * 2 * np.pi / 12
positions = 3e-6 * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
ring = dt.Sample.at_rest(positions)  # m
ring.velocities[:, 2] = -0.5  # m/s

with dt.simulate(scene, ring) as simulation:
    simulation.run()
    print(simulation.positions.shape, simulation.measure().wall_contact_count)
