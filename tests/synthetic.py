"""Result files of runs that never took place: a known law, a ledger that closes."""

import numpy as np
import xarray as xr

from dusttaichi.analysis import Run
from dusttaichi.grains.grain_variables import VARIABLES
from dusttaichi.physics import laws
from dusttaichi.physics.laws import S12_STATIC, UNIDIRECTIONAL
from dusttaichi.results import Writer, provenance, select_variables
from dusttaichi.results.variables import LABELS
from dusttaichi.scene.material import NAMED, Material

RADIUS = 0.6e-6
SHARES = np.array([0.22, 0.17, 0.11, 0.37, 0.1, 0.03])  # of the losses, by channel
BOX = {"walls", "room", "height", "filling", "profiles", "snapshots", "contacts"}
PLATES = {"walls", "room", "height", "filling", "plates"}
CELL = {"cell", "room", "stress", "filling", "stages", "snapshots"}
FEATURES = BOX | PLATES | CELL | {"push"}  # no scene has them all
POLYDISPERSE = {"polydisperse"}  # grains of different radius or material
ICE = Material(**NAMED["ice_t19"])
ICE_LAW = (ICE.surface_energy, ICE.radius, ICE.critical_rolling)  # what T19's laws know of it


def writer(
    path,
    grains=50,
    bins=20,
    features=FEATURES,
    scene="name: test\n",
    attrs=(),
    radius=RADIUS,
    requested=(),
    **options,
):
    """An empty result file for `grains` grains. attrs: further global attributes (dict)."""
    lower = np.arange(bins) * 2 * RADIUS
    coords = {
        "snapshots/radius": np.full(grains, radius),
        "profiles/bin_lower": lower,
        "profiles/bin_height": lower + RADIUS,
        "profiles/bin_upper": lower + 2 * RADIUS,
    }
    if features >= POLYDISPERSE:
        coords |= {"snapshots/mass": np.ones(grains), "snapshots/material": np.zeros(grains)}
    attributes = provenance(scene, scene, title="test", seed=1, backend="cpu", precision="f64")
    return Writer.create(
        path,
        select_variables(VARIABLES.values(), features, requested),
        {"grain": grains, "bin": bins, "body": 2, "surface": 1},
        coords,
        attributes | {"grains": grains} | dict(attrs),
        **options,
    )


def make_run(time=None, scene="", attrs=(), profiles=None, **variables):
    """A Run without a file whose time series has these variables, with their declared dimensions.

    time: by default a microsecond for each step. A pressure may be that on the top wall alone.
    """
    data = {}
    for name, values in variables.items():
        attributes = {"units": VARIABLES[name].units, "long_name": VARIABLES[name].long_name}
        data[name] = (VARIABLES[name].dims, values, attributes)
    if np.ndim(variables.get("pressure")) == 1:
        walls = np.full((len(variables["pressure"]), len(LABELS["wall"])), np.nan)
        walls[:, -1] = variables["pressure"]
        data["pressure"] = (("time", "wall"), walls, data["pressure"][2])
    length = len(next(iter(variables.values())))
    data = {"step": ("time", np.arange(length))} | data
    dims = [dim for dims, *_ in data.values() for dim in dims]
    labels = {dim: list(LABELS[dim]) for dim in dims if dim in LABELS}
    labels["time"] = 1e-6 * np.arange(length) if time is None else time
    attrs = {"scene_resolved": scene, "title": "made"} | dict(attrs)
    return Run("made/result.nc", xr.Dataset(data, labels, attrs), profiles)


def series_record(step, features=FEATURES):
    """A record of the time series with numbers that tell the step."""
    variables = [v for v in select_variables(VARIABLES.values(), features) if v.group == "series"]
    shapes = {v.name: tuple(len(LABELS[d]) for d in v.dims[1:]) for v in variables}
    return {k: np.full(shape, float(step)) if shape else step for k, shape in shapes.items()}


def _nothing(features):
    """A record of the time series in which nothing happens: every number 0."""
    return {name: 0.0 * value for name, value in series_record(0, features).items()} | {
        "largest_overlap": 1e-10,
        "largest_speed": 0.05,
    }


def _append_series(result, features, interval, **columns):
    """Records `interval` [s] and 1000 steps apart in which all but `columns`, (time, ...), is 0."""
    number = np.arange(len(columns["filling_factor"]))
    nothing = {
        k: np.broadcast_to(v, (len(number), *np.shape(v))) for k, v in _nothing(features).items()
    }
    result.append("series", nothing | {"time": interval * number, "step": 1000 * number} | columns)


def snapshot_records(step, grains, rows, wall_rows=2):
    """A snapshot with `rows` contacts, all numbers telling the step: group -> record."""
    return {
        "snapshots": {
            "snapshot_time": step,
            "step": step,
            "position": np.full((grains, 3), step + 0.1),
            "velocity": np.zeros((grains, 3)),
            "spin": np.zeros((grains, 3)),
            "box": np.full(6, step),
            "contact_count": rows,
            "wall_contact_count": wall_rows,
        },
        "contacts": {
            "grain_i": np.arange(rows),
            "grain_j": np.full(rows, step),
            "pointer_i": np.full((rows, 3), step),
            "pointer_j": np.zeros((rows, 3)),
            "twist": np.zeros(rows),
            "approach": np.zeros(rows),
            "overlap": np.full(rows, step),
        },
        "wall_contacts": {
            "grain": np.arange(wall_rows),
            "wall": np.full(wall_rows, 5),
            "pointer": np.zeros((wall_rows, 3)),
            "foot": np.full((wall_rows, 3), step),
            "twist": np.zeros(wall_rows),
            "approach": np.zeros(wall_rows),
            "overlap": np.zeros(wall_rows),
        },
    }


def _energies(phi, height, pressure, area, grains, contacts):
    """Energies over time, shape (time,), that balance up to a stated residual."""
    work = np.concatenate(
        [[0], np.cumsum(-np.diff(height) * area * 0.5 * (pressure[1:] + pressure[:-1]))]
    )
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
    with writer(path, grains, bins, BOX) as result:
        walls = np.outer(pressure, [0.6] * 5 + [1.0])
        force = np.zeros((points, 6, 3))
        force[:, 5, 2] = -pressure * area
        _append_series(
            result,
            BOX,
            1e-6,
            height=height,
            filling_factor=phi,
            pressure=walls,
            wall_force=force,
            coordination_number=2 * contacts / grains,
            contact_count=contacts.astype(int),
            wall_contact_count=20 + np.arange(points),
            kinetic_translation=0.6 * kinetic,
            kinetic_rotation=0.4 * kinetic,
            potential=np.outer(potential, np.eye(4)[0]),
            loss=0.9 * np.outer(lost, SHARES),
            loss_wall=0.1 * np.outer(lost, SHARES),
            wall_work=work,
            energy_residual=residual,
            energy_residual_relative=residual / np.maximum(work, 1e-30),
            wall_clock=0.5 * np.arange(points),
        )
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
        "profile_time": i * 1e-6,
        "step": i * 1000,
        "height": height,
        "box_filling_factor": phi,
        "filling_factor": np.where(np.arange(bins) * 2 * RADIUS < height, values, np.nan),
    }


SHAPE = 2.0
"""Of the stress of `stretched_stress`: its maximum is where the filling factor has halved."""


def stretched_stress(phi, phi_init, strength):
    """Stress [Pa] at `phi`: 0 at phi_init, `strength` at phi_init / 2, falling beyond."""
    rise = np.log(phi_init / phi) / np.log(2.0)
    return strength * (rise * np.exp(1.0 - rise)) ** SHAPE


def cell_scene(material="ice_t19"):
    """Resolved scene of a cell that is pressed and then stretched (T19)."""
    numbers = "".join(f"  {key}: {value}\n" for key, value in NAMED[material].items())
    return (
        f"name: test\nmaterial:\n  name: {material}\n{numbers}"
        "boundary: {kind: periodic, axes: [x, y, z]}\n"
        "stages:\n"
        "- {name: press, drive: {compression_rate: 3e-7}}\n"
        "- {name: stretch, drive: {face_speed: [10 cm/s, 0 m/s, 0 m/s]}}\n"
    )


def cell_run(
    path,
    phi_init=0.1,
    noise=0.05,
    points=400,
    seed=1,
    strength=None,
    last=0.03,
    ratio=1.3,
    grains=300,
    stages=("press", "stretch"),
):
    """A periodic cell of ice pressed from all sides to phi_init, then stretched along x to `last`.

    Pressed along `ratio` times T19 eq 9 from phi_init / 10 on; stretched along `stretched_stress`,
    by default with the strength of T19 eq 33; noise: of a record of the stress, as a share of the
    largest, in each of the two. stages: those written ("stretch" alone is a run without stages).
    """
    rng = np.random.default_rng(seed)
    strength = laws.tensile_strength(phi_init, *ICE_LAW[:2]) if strength is None else strength
    volume = grains * 4 / 3 * np.pi * ICE.radius**3
    segments = []
    if "press" in stages:
        segments.append(_press(phi_init, volume, points, ratio, noise, rng))
    if "stretch" in stages:
        length = np.linspace(1.0, phi_init / last, points + 1)[len(segments) :]
        segments.append(_stretch(phi_init, volume, length, strength, noise, rng))
    stage = np.concatenate([np.full(len(segment[0]), n) for n, segment in enumerate(segments)])
    phi, sizes, stress = (np.concatenate(column) for column in zip(*segments, strict=True))
    staged = len(stages) > 1
    features = CELL if staged else CELL - {"stages"}
    attrs = {"periodic_axes": "x y z", "grains": grains}
    attrs |= {"stages": " ".join(stages)} if staged else {}
    with writer(path, grains, 1, features, cell_scene(), attrs, ICE.radius) as result:
        stage_column = {"stage": stage} if staged else {}
        columns = _cell_series(phi, sizes, stress, grains)
        _append_series(result, features, 1e-7, **columns, **stage_column)
        shape = rng.random((grains, 3))
        begin = points - 1 if staged else 0
        for i in np.unique([0, *np.linspace(begin, len(phi) - 1, 4).astype(int)]):
            result.append("snapshots", _cell_snapshot(i, sizes[i], shape))
        result.set_status("finished: filling factor reached")
    return path


def _press(phi_init, volume, points, ratio, noise, rng):
    """Filling factors (n,), edges (n, 3), stress (n, 3, 3) of a cell pressed to phi_init."""
    phi = np.geomspace(0.1 * phi_init, phi_init, points)
    edges = np.repeat(((volume / phi) ** (1 / 3))[:, None], 3, axis=1)
    halfway = 0.5 * (phi + np.concatenate([phi[:1], phi[:-1]]))
    size = laws.isotropic_pressure(halfway, *ICE_LAW)
    size = ratio * size * 10 ** (noise * rng.standard_normal(points))
    return phi, edges, -size[:, None, None] * np.eye(3)


def _stretch(phi_init, volume, length, strength, noise, rng):
    """Filling factors, edges, stress of a cube of phi_init stretched along x to `length` edges."""
    edge = (volume / phi_init) ** (1 / 3)
    length = edge * length
    phi = phi_init * edge / length
    halfway = 0.5 * (phi + np.concatenate([[phi_init], phi[:-1]]))
    pull = np.zeros((len(length), 3, 3))
    pull[:, 0, 0] = stretched_stress(halfway, phi_init, strength)
    pull += noise * strength * rng.standard_normal(pull.shape)
    across = np.full_like(length, edge)
    return phi, np.stack([length, across, across], 1), pull


def _cell_series(phi, sizes, stress, grains):
    """What the series of a cell says, beside its stages."""
    cube = sizes.prod(axis=1)
    contacts = laws.coordination_number(phi) / 2 * grains
    done = np.abs(np.diff(np.log(cube))) * cube[1:] * np.abs(stress[1:, 0, 0])
    work = np.concatenate([[0], np.cumsum(done)])
    return {
        "box_length": sizes,
        "filling_factor": phi,
        "stress": stress,
        "coordination_number": 2 * contacts / grains,
        "contact_count": contacts.astype(int),
        "kinetic_translation": np.full_like(phi, 1e-20),
        "kinetic_rotation": np.full_like(phi, 1e-20),
        "potential": 0.1 * np.outer(work, np.eye(4)[1]),
        "loss": 0.9 * np.outer(np.maximum.accumulate(work), SHARES),
        "face_work": work,
        "wall_clock": 0.1 * np.arange(len(phi)),
    }


def _cell_snapshot(i, size, shape):
    low, high = -0.5 * size, 0.5 * size
    zeros = np.zeros_like(shape)
    return {
        "snapshot_time": i * 1e-7,
        "step": i * 1000,
        "position": low + shape * size,
        "velocity": zeros,
        "spin": zeros,
        "box": np.stack([low, high], axis=1).ravel(),
    }


def plates_run(path, law=UNIDIRECTIONAL, noise=0.05, points=200, pull=None, grains=291):
    """A cake between plates, pressed along `law`; or pulled apart with the strength `pull` [Pa]."""
    rng = np.random.default_rng(2)
    area = np.pi * (6.6e-6) ** 2
    if pull is None:
        phi = np.linspace(law.phi1 + 0.001, 0.325, points)
        pressure = law.pressure(phi) * 10 ** (noise * rng.standard_normal(points))
        shadow = area * np.linspace(1.0, 1.6, points)  # the cake spreads
    else:
        phi = 0.2 / np.linspace(1.0, 5.0, points)
        halfway = 0.5 * (phi + np.concatenate([phi[:1], phi[:-1]]))
        pressure = -stretched_stress(halfway, 0.2, pull) + noise * pull * rng.standard_normal(
            points
        )
        shadow = np.full(points, area)
    height = grains * 4 / 3 * np.pi * RADIUS**3 / (shadow * phi)
    scene = "name: test\nmaterial: silica_pd08\nboundary: {kind: plates, wall_speed: 5 cm/s}\n"
    with writer(path, grains, 1, PLATES, scene, {"grains": grains}) as result:
        number = np.arange(points)
        _append_series(
            result,
            PLATES,
            1e-6,
            height=height,
            filling_factor=phi,
            projected_area=shadow,
            inner_filling_factor=1.05 * phi,
            outside_count=number // 10,
            pressure=np.outer(pressure, [np.nan] * 4 + [0.9, 1.0]),
            coordination_number=np.full(points, 2.5),
            contact_count=np.full(points, grains),
            wall_contact_count=np.full(points, 20),
            kinetic_translation=np.full(points, 1e-20),
            loss=1e-18 * np.outer(number, SHARES),
            wall_work=1e-18 * number,
            wall_clock=0.1 * number,
        )
        result.set_status("finished")
    return path
