"""The collisions of a study, each as the sample of its scene."""

import hashlib
import itertools
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dusttaichi import __version__
from dusttaichi.errors import DustError
from dusttaichi.results.provenance import plain
from dusttaichi.scene import Scene, quantities
from dusttaichi.scene.yaml_text import read
from dusttaichi.studies.settings import as_files, keys_of, relative_files, seeds_moved
from dusttaichi.studies.store import core_of

OTHER = 1_000_000  # added to the seed of a projectile whose block is that of the target
SAMPLE = "sample"  # name of the bodies where the study names none


@dataclass(frozen=True)
class Collision:
    """One collision.

    index: along the dimensions of a Study. sample: its block of the YAML. key: states which stored
    row belongs to it.
    """

    index: tuple[int, ...]
    sample: dict[str, Any]
    key: str


@dataclass(frozen=True)
class Study:
    """All collisions of a scene with a block `collisions`.

    scene: without that block. axes: name of a dimension -> values, in the order of the indices;
    speeds [m/s]. by_area: the impact parameters are those of equal areas. phases: losses of
    compression and of stretching are wanted. inputs: files that the bodies are read from, and
    extensions.
    """

    source: Scene
    scene: Scene
    directory: Path
    axes: dict[str, tuple]
    by_area: bool
    phases: bool
    collisions: tuple[Collision, ...]
    inputs: tuple[str, ...]

    @property
    def rows_file(self) -> Path:
        """File in which each collision is a line of JSON as soon as it is done."""
        return self.directory / "collisions.jsonl"

    @property
    def file(self) -> Path:
        """The dataset of all of them."""
        return self.directory / "collisions.nc"


def make_study(scene: Scene, directory: Path, added: tuple = ()) -> Study:
    """The Study of a scene, with the speeds `added` [m/s] beside its own.

    Raises DustError where it has no block `collisions`.
    """
    own = getattr(scene, "collisions", None)
    if own is None:
        raise DustError(
            f"{scene.name} has no block `collisions`, which says what to vary; for example "
            "collisions: {speed: [10 m/s, 30 m/s], impact_parameter: [0], seeds: 3} "
            "(`dust new collide` writes a file)"
        )
    data = read(scene.to_yaml()).data
    data.pop("collisions")
    data.pop("replicas", None)
    data["extensions"] = [os.path.relpath(path) for path in data["extensions"]]
    if data["numerics"]["threads"] == "auto":  # many small scenes: a thread each
        data["numerics"]["threads"] = 1
    templates = _templates(data["sample"], own)
    axes = {
        "body": tuple(templates),
        "mass_ratio": own.mass_ratio,
        "speed": tuple(sorted({*own.speeds, *added})) if added else own.speeds,
        "impact_parameter": own.impacts,
        "seed": tuple(range(own.seeds)),
    }
    inputs = [
        path for block in (data["sample"], *templates.values()) for path in relative_files(block)
    ]
    inputs = sorted({*as_files(inputs), *data["extensions"]})
    core = json.dumps([__version__, core_of(scene.to_yaml()) | {"collisions": None, "name": ""}])
    collisions = []
    for index in itertools.product(*(range(len(values)) for values in axes.values())):
        point = {name: values[n] for (name, values), n in zip(axes.items(), index, strict=True)}
        sample = _sample(templates[point["body"]], point)
        text = core + json.dumps(sample, sort_keys=True) + "phases" * own.phases
        key = hashlib.sha256(text.encode()).hexdigest()[:32]
        collisions.append(Collision(index, sample, key))
    for sample in templates.values():  # a filling factor that a body does not allow
        Scene.from_dict(data | {"sample": sample}, title="the scene of the study")
    base = Scene.from_dict(data, title="the scene of the study")
    own = own.by_area, own.phases
    return Study(scene, base, Path(directory), axes, *own, tuple(collisions), tuple(inputs))


def _templates(sample: dict, own) -> dict[str, dict]:
    """Sample of the two bodies by the names of the dimension `body`."""
    if own.filling_factor:
        return {f"phi_{phi:g}": _filled(_copy(sample), phi) for phi in own.filling_factor}
    found = {}
    for name, body in own.bodies.items():
        block = plain(body.model_dump(mode="json"))
        other = seeds_moved(_copy(block), OTHER)
        found[name] = _copy(sample) | {"target": block, "projectile": other}
    return found or {SAMPLE: _copy(sample)}


def _filled(sample: dict, phi: float) -> dict:
    """The sample with a filling factor in place of those of its bodies; in place."""
    for _, block in keys_of(sample, "filling_factor"):
        block["filling_factor"] = phi
    return sample


def _copy(block: dict) -> dict:
    return json.loads(json.dumps(block))


def _sample(template: dict, point: dict) -> dict:
    """The sample of a point: its bodies, speed, impact parameter and seeds."""
    sample = _copy(template)
    if point["mass_ratio"] != 1.0:
        projectile = sample["projectile"]
        projectile["grains"] = round(projectile["grains"] / point["mass_ratio"])
    sample["speed"] = quantities.format(point["speed"], "speed")
    sample["impact_parameter"] = point["impact_parameter"]
    return seeds_moved(sample, point["seed"])
