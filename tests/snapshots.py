"""Result files whose snapshots hold given grains, nothing is simulated."""

import numpy as np
import synthetic

from dusttaichi import analysis
from dusttaichi.grains.grain_variables import VARIABLES
from dusttaichi.results import Writer, provenance, select_variables

DENSITY = 2650.0
SCENE = "name: made\nmaterial: {density: 2650 kg/m^3}\n"


def write(path, frames, radius, box=None, periodic="", dt=1e-9, scene=SCENE, attrs=()):
    """A result at `path` with a snapshot for each of `frames`, `dt` [s] apart. Returns the path.

    frames: dicts with position (N, 3), and perhaps velocity, spin (N, 3), pairs (C, 2), overlap,
    twist (C,), pointer_i, pointer_j (C, 3), box (6,), tilt [m], touching: [(grain, wall), ...].
    radius: (N,) or a number. box: (6,), of all frames that name none; None: no walls.
    attrs: further global attributes (dict). With force, torque_i, torque_j (C, 3) of the pairs and
    wall_force, wall_torque of what touches the walls in each frame the result has forces, with
    normal_force and wall_normal_force or none.
    """
    count = len(frames[0]["position"])
    features = {"snapshots", "contacts"} | ({"walls", "room"} if box is not None else set())
    features |= {"forces"} if "force" in frames[0] else set()
    features |= {"tilt"} if "tilt" in frames[0] else set()
    attributes = provenance(scene, scene, title="made", seed=1, backend="cpu", precision="f64")
    attrs = attributes | {"periodic_axes": periodic} | dict(attrs)
    coords = {"snapshots/radius": np.broadcast_to(radius, count)}
    attrs = {"grains": count} | attrs
    variables = select_variables(VARIABLES.values(), features)
    with Writer.create(path, variables, {"grain": count}, coords, attrs) as writer:
        for number, frame in enumerate(frames):
            for group, record in _records(frame, number, dt, count, box).items():
                writer.append(group, record)
            record = synthetic.series_record(1000 * number, features)
            writer.append("series", record | {"time": number * dt})
        writer.set_status("finished: made")
    return path


def open_snapshots(folder, frames, radius=0.6e-6, **options):
    """The Run of the result that `write` writes into a folder."""
    return analysis.open_run(write(folder / "result.nc", frames, radius, **options))


def _records(frame, number, dt, count, box):
    pairs = np.asarray(frame.get("pairs", np.zeros((0, 2))), dtype=int).reshape(-1, 2)
    rows = len(pairs)
    snapshot = {"snapshot_time": number * dt, "step": 1000 * number, "contact_count": rows}
    for name in ("position", "velocity", "spin"):
        snapshot[name] = frame.get(name, np.zeros((count, 3)))
    if "tilt" in frame:
        snapshot["tilt"] = frame["tilt"]
    contacts = {"grain_i": pairs[:, 0], "grain_j": pairs[:, 1], "approach": np.zeros(rows)}
    for name, tail in (("overlap", ()), ("twist", ()), ("pointer_i", (3,)), ("pointer_j", (3,))):
        contacts[name] = frame.get(name, np.zeros((rows, *tail)))
    if "force" in frame:
        load = {n: frame[n] for n in ("force", "torque_i", "torque_j")}
        normal = frame.get("normal_force", np.zeros(rows))
        contacts |= load | {"normal_force": normal, "step": np.zeros(rows)}
    records = {"contacts": contacts}
    if box is not None:
        touching = np.asarray(frame.get("touching", []), dtype=int).reshape(-1, 2)
        zero, zeros = np.zeros(len(touching)), np.zeros((len(touching), 3))
        snapshot |= {"box": frame.get("box", box), "wall_contact_count": len(touching)}
        records["wall_contacts"] = {
            "grain": touching[:, 0],
            "wall": touching[:, 1],
            "pointer": zeros,
            "foot": zeros,
            "twist": zero,
            "approach": zero,
            "overlap": zero,
        }
        if "wall_force" in frame:
            load = {"force": frame["wall_force"], "torque": frame["wall_torque"]}
            normal = frame.get("wall_normal_force", zero)
            records["wall_contacts"] |= load | {"normal_force": normal, "step": zero}
    return {"snapshots": snapshot, **records}


def collision_row(outcome="fragmentation", fragments=(6, 3, 1), **changes):
    """The row of a collision of `dust collide`, SI."""
    total = sum(fragments)
    fractions = [n / total for n in fragments]
    values = {
        "growth_efficiency": 0.2,
        "impact_energy": 2.0,
        "loss": {"rolling": 1.0},
        "grains": 10,
    }
    return {"outcome": outcome, "fragments": fragments, "masses": fractions, **values, **changes}
