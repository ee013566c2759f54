"""Four small scenes of grains, and the expected states of their grains.

`python tests/gpu/stored_states.py` computes the states again and writes states.json, as is
necessary after a change of the physics.
"""

import json
from pathlib import Path

import numpy as np

from dusttaichi import method, units
from dusttaichi.scene import Scene

STATES = Path(__file__).with_name("states.json")
STEPS = 200
STORED = 40  # grains

BASE = {
    "name": "stored",
    "material": "silicate_s12",
    "interaction": {
        "rolling": {"modifier": 8},
        "sliding": {"modifier": 2.5},
        "twisting": "on",
        "damping": "viscoelastic",
    },
    "sample": {"kind": "rbd", "grains": STORED, "seed": 3},
    "boundary": {"kind": "box", "wall_speed": "3 m/s"},
    "stop": {"steps": STEPS},
    # with a small skin, for several searches
    "numerics": {"time_step": "0.2 ns", "threads": 1, "skin": 0.02, "precision": "f64"},
    "output": {"snapshots": "off"},
}
SPHERE = {"radius": "2 um", "gap": "20 nm", "velocity": ["0 m/s", "0 m/s", "-2 m/s"]}
SIZES = {"kind": "power", "exponent": -2.5, "smallest": "0.4 um", "largest": "0.8 um"}
CHANGES = {
    "box": {"numerics": {"precision": "f64"}},
    "sheared cell, mixed": {
        # with contacts across the faces from the first step on
        "sample": {"kind": "random_packing", "filling_factor": 0.42, "seed": 5},
        "boundary": {
            "kind": "periodic",
            "stress": ["-20 kPa", "-20 kPa", "free"],
            "strain_rate": ["3e4 s^-1", "3e4 s^-1", "-2e5 s^-1"],
            "shear_rate": "1e5 s^-1",
        },
        "numerics": {"precision": "mixed"},
        "output": {"stress": True},
    },
    "sphere and gravity": {
        "boundary": {"kind": "box", "omit": ["top"]},
        "sphere": SPHERE,
        "gravity": {"acceleration": ["0 m/s^2", "0 m/s^2", "-9.81 m/s^2"]},
    },
    "grains of different size": {"sample": {"sizes": SIZES}, "output": {"stress": True}},
}
"""Changes of BASE for each scene."""

# Relative to the largest position, velocity or spin. Compilers differ in the fusion of operations,
# devices in the division: differences in rounding (1e-16), amplified by a few thousand contacts and
# collisions; mixed precision rounds loads to 6e-8.
TOLERANCE = {"f64": 1e-9, "mixed": 1e-5}


def scene(name, backend):
    """The Scene with a name of CHANGES."""
    data = {key: dict(value) if isinstance(value, dict) else value for key, value in BASE.items()}
    for key, value in CHANGES[name].items():
        replaces_block = key == "boundary" or key not in data
        data[key] = value if replaces_block else data[key] | value
    data["numerics"]["backend"] = backend
    return Scene.from_dict(data)


def tolerance(name):
    """Tolerance of the state of a scene against the stored one."""
    return TOLERANCE[CHANGES[name].get("numerics", BASE["numerics"])["precision"]]


def move_scene(scene):
    """(motion of a scene after STEPS steps, its Measurement at the start)."""
    motion = method.find_method(scene).build(scene, method.make_sample(scene))
    start = motion.measure()
    motion.advance(STEPS)
    return motion, start


def state(motion):
    """Positions [m], velocities [m/s] and spins [rad/s] of the grains, (3, N, 3)."""
    scales = np.array([units.LENGTH, units.SPEED, units.SPIN])
    return np.array(motion.motion.measure()) * scales[:, None, None]


def read_stored():
    """Name -> expected state, from states.json."""
    data = json.loads(STATES.read_text(encoding="utf-8"))
    return {name: np.array(values) for name, values in data.items()}


def difference(values, expected):
    """Largest difference of positions, velocities or spins, each over its largest value."""
    scale = np.abs(expected).max(axis=(1, 2), keepdims=True)
    return float(np.max(np.abs(values - expected) / scale))


def write_states():
    """Compute the states on the CPU and write them."""
    states = {name: state(move_scene(scene(name, "cpu"))[0]).tolist() for name in CHANGES}
    text = json.dumps(states).replace("]], ", "]],\n")
    STATES.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    write_states()
