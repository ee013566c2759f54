"""The scenes whose runs kills.py kills: each records much, and keeps a state every moment."""

import toy

GRAINS = """
name: grains
material: silicate_s12
interaction: {rolling: on}
sample: {kind: bcca, grains: 64, seed: 2}
boundary: {kind: open}
stop: {steps: 40000}
numerics: {threads: 1}
output: {series: {steps: 500}, snapshots: {steps: 2000}, checkpoint: 0.1 s}
"""
PLAIN = toy.plain(steps=4000, series=50, checkpoint="20 ms")
STAGES = PLAIN.replace(
    "stop: {steps: 4000}",
    """stages:
  - {name: swing, stop: {time: 15 us}}
  - {name: on, stop: {steps: 1250}, output: {series: {time: 1 us}}}
  - {name: rest, stop: {steps: 1250}}""",
)
CONTINUUM = """
name: continuum
method: continuum
dimension: 2
material: dust_g09
sample:
  kind: impact
  target: {kind: block, size: [2 mm, 1 mm]}
  projectile: {kind: rigid, shape: sphere, diameter: 0.6 mm, density: 2540 kg/m^3}
  speed: 0.65 m/s
gravity: 9.81 m/s^2
boundary:
  kind: faces
  bottom: {layer: 0.45 mm}
  x_min: {layer: 0.56 mm}
  x_max: {layer: 0.56 mm}
numerics: {spacing: 0.1 mm, threads: 1}
stop: {steps: 1000}
output: {series: {steps: 50}, snapshots: {steps: 250}, checkpoint: 0.1 s}
"""
# a rigid sphere, with all that a snapshot may hold, in single precision
SPHERE = """
name: sphere
material: silicate_s12
interaction: {rolling: {modifier: 8}, sliding: {modifier: 2.5}, damping: viscoelastic}
sample: {kind: rbd, grains: 60, seed: 3}
sphere: {radius: 3 um, gap: 10 nm, velocity: [0 m/s, 0 m/s, -1 m/s]}
gravity: {acceleration: [0 m/s^2, 0 m/s^2, -1000 m/s^2]}
boundary: {kind: box, omit: [top]}
stop: {steps: 12000}
numerics: {time_step: 0.3 ns, threads: 1, precision: f64}
output:
  series: {steps: 150}
  snapshots: {steps: 600}
  variables: [orientation, loss, grain_loss, sliding_force, rolling_moment, twisting_moment, -spin]
  precision: f32
  checkpoint: 0.1 s
"""
CAKE = """
name: cake
material: silicate_s12
interaction: {rolling: {modifier: 8}, sliding: {modifier: 2.5}, damping: viscoelastic}
sample: {kind: rbd, grains: 60, seed: 3}
boundary: {kind: BOUNDARY}
stop: {steps: 12000}
numerics: {time_step: 0.2 ns, threads: 1}
output: {series: {steps: 150}, snapshots: {steps: 600}, checkpoint: 0.1 s}
"""
# a cell that leans, two of whose axes are held under a stress
LEANING = CAKE.replace(
    "BOUNDARY",
    "periodic, stress: [-20 kPa, -20 kPa, free], strain_rate: [3e4 s^-1, 3e4 s^-1, -5e4 s^-1], "
    "shear_rate: 1e5 s^-1",
)
SOURCE = CAKE.replace("BOUNDARY", "box, wall_speed: 1 m/s").replace("12000", "1200")
# goes on with another run: its walls and their load, its box and its time
KEPT = CAKE.replace("BOUNDARY", "box, pressure: 50 kPa, wall_speed: 1 m/s").replace(
    "{kind: rbd, grains: 60, seed: 3}", "{kind: explicit, file: FILE, keep: [walls, box, time]}"
)
SCENES = {"plain": PLAIN, "stages": STAGES, "replicas": GRAINS + "replicas: 2\n", "grains": GRAINS}
SCENES |= {"continuum": CONTINUUM, "sphere": SPHERE, "leaning cell": LEANING, "kept sample": KEPT}
SHARES = dict.fromkeys(SCENES, 0.1) | {"plain": 0.2, "stages": 0.3}
