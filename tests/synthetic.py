"""Result files of compression runs that never took place: a known law, a ledger that closes."""

import numpy as np

from dusttaichi.physics.laws import S12_STATIC
from dusttaichi.results import Writer, provenance, select

RADIUS = 0.6e-6
SHARES = np.array([0.22, 0.17, 0.11, 0.37, 0.1, 0.03])  # of the losses, by channel
FEATURES = {"walls", "height", "volume", "profiles", "snapshots", "contacts"}


def writer(path, grains=50, bins=20, features=FEATURES, **options):
    """An empty result file for `grains` grains."""
    lower = np.arange(bins) * 2 * RADIUS
    coords = {
        "snapshots/radius": np.full(grains, RADIUS),
        "profiles/bin_lower": lower,
        "profiles/bin_height": lower + RADIUS,
        "profiles/bin_upper": lower + 2 * RADIUS,
    }
    attrs = provenance(
        "name: test\n", "name: test\n", title="test", seed=1, backend="cpu", precision="f64"
    )
    return Writer.create(
        path, select(features), {"grain": grains, "bin": bins}, coords, attrs, **options
    )


def series_record(step, features=FEATURES):
    """A record of the time series with numbers that tell the step."""
    shapes = {"pressure": 6, "wall_force": (6, 3), "potential": 4, "potential_wall": 4,
              "loss": 6, "loss_wall": 6}  # fmt: skip
    keys = [k for k in select(features) if "/" not in k]
    return {k: np.full(shapes[k], float(step)) if k in shapes else step for k in keys}


def snapshot_records(step, grains, rows, wall_rows=2):
    """A snapshot with `rows` contacts, all numbers telling the step: group -> record."""
    return {
        "snapshots": {
            "snapshot_time": step, "step": step, "position": np.full((grains, 3), step + 0.1),
            "velocity": np.zeros((grains, 3)), "spin": np.zeros((grains, 3)),
            "box": np.full(6, step), "contact_count": rows, "wall_contact_count": wall_rows,
        },
        "contacts": {
            "grain_i": np.arange(rows), "grain_j": np.full(rows, step),
            "pointer_i": np.full((rows, 3), step), "pointer_j": np.zeros((rows, 3)),
            "twist": np.zeros(rows), "approach": np.zeros(rows), "overlap": np.full(rows, step),
        },
        "wall_contacts": {
            "grain": np.arange(wall_rows), "wall": np.full(wall_rows, 5),
            "pointer": np.zeros((wall_rows, 3)), "foot": np.full((wall_rows, 3), step),
            "twist": np.zeros(wall_rows), "approach": np.zeros(wall_rows),
            "overlap": np.zeros(wall_rows),
        },
    }  # fmt: skip


def _energies(phi, height, pressure, area, grains, contacts):
    """Energies over time, shape (time,), that balance up to a stated residual."""
    work = np.concatenate([[0], np.cumsum(-np.diff(height) * area * 0.5 *
                                          (pressure[1:] + pressure[:-1]))])  # fmt: skip
    bond = 1.2 * 56.5e-9 * 0.166e-9
    potential = -bond * contacts + 0.02 * work
    kinetic = 1e-20 * grains * (1 + phi)
    residual = 1e-7 * work * np.linspace(-1, 1, len(phi))
    lost = work - (kinetic - kinetic[0]) - (potential - potential[0]) + residual
    return work, kinetic, potential, np.maximum.accumulate(np.maximum(lost, 0)), residual


def compression_run(path, law=S12_STATIC, noise=0.1, points=200, seed=1, grains=1000, last=0.55):
    """A run along `law` with log-normal scatter `noise` [dex] in the pressure, at `path`."""
    rng = np.random.default_rng(seed)
    phi = np.linspace(law.phi1 + 0.002, last, points)
    pressure = law.pressure(phi) * 10 ** (noise * rng.standard_normal(points))
    area = (40e-6) ** 2
    height = grains * 4 / 3 * np.pi * RADIUS**3 / (area * phi)
    contacts = (1.0 + 9.38 / 2 * phi**1.62) * grains
    work, kinetic, potential, lost, residual = _energies(
        phi, height, pressure, area, grains, contacts
    )
    bins = int(np.ceil(height[0] / (2 * RADIUS)))
    with writer(path, grains, bins) as result:
        for i in range(points):
            walls = np.full(6, 0.6 * pressure[i])
            walls[5] = pressure[i]
            force = np.zeros((6, 3))
            force[5, 2] = -pressure[i] * area
            result.append("series", {
                "time": i * 1e-6, "step": i * 1000, "height": height[i], "filling_factor": phi[i],
                "pressure": walls, "wall_force": force,
                "coordination_number": 2 * contacts[i] / grains, "contact_count": int(contacts[i]),
                "wall_contact_count": 20 + i, "kinetic_translation": 0.6 * kinetic[i],
                "kinetic_rotation": 0.4 * kinetic[i], "potential": potential[i] * np.eye(4)[0],
                "potential_wall": np.zeros(4), "loss": 0.9 * lost[i] * SHARES,
                "loss_wall": 0.1 * lost[i] * SHARES, "wall_work": work[i],
                "energy_residual": residual[i],
                "energy_residual_relative": residual[i] / max(work[i], 1e-30),
                "largest_overlap": 1e-10, "largest_speed": 0.05, "wall_clock": 0.5 * i,
            })  # fmt: skip
        for i in np.linspace(0, points - 1, 5).astype(int):
            result.append("profiles", _profile(i, phi[i], height[i], bins, rng))
        for i in (0, points - 1):
            for group, record in snapshot_records(int(i), grains, int(contacts[i])).items():
                result.append(group, record)
        result.set_status("finished: filling factor reached")
    return path


def _profile(i, phi, height, bins, rng):
    middle = (np.arange(bins) + 0.5) * 2 * RADIUS
    shape = 1 - 0.25 * np.exp(-(((middle - height) / 1.5e-6) ** 2)) + 0.2 * np.exp(-middle / 1e-6)
    values = phi * shape * (1 + 0.05 * rng.standard_normal(bins))
    return {
        "profile_time": i * 1e-6, "step": i * 1000, "height": height, "box_filling_factor": phi,
        "filling_factor": np.where(np.arange(bins) * 2 * RADIUS < height, values, np.nan),
    }  # fmt: skip
