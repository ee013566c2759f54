"""Plan of a trade: which parameters at which levels, from which scene, with which seeds."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

from dusttaichi import method
from dusttaichi.errors import DustError
from dusttaichi.method.variants import SAMPLE, Parameters, Variant, change_scene, list_stage_paths
from dusttaichi.scene import Scene, quantities
from dusttaichi.studies.scene_settings import find_keys

QUICK_LEVELS = 3  # of a parameter
QUICK_SEEDS, SEEDS = 2, 4
ALL_METHODS = [method.attribute(entry.trade_parameters) for entry in method.METHODS.values()]
NAMES = tuple(row.name for parameters in ALL_METHODS if parameters for row in parameters.parameters)


def find_parameters(scene: Scene) -> Parameters:
    """The Parameters of the method of a scene. Raises DustError where it has none."""
    parameters: Parameters | None = method.attribute(method.find_method(scene).trade_parameters)
    if parameters is None:
        raise DustError(f"method: {scene.method} has no parameters for dust trade")
    return parameters


@dataclass(frozen=True)
class TradePlan:
    """Plan of a trade.

    names: of the parameters. quick: three levels of each. seeds: how many in all, None: 4, quick 2.
    tolerance: largest accepted error, a share. observable: name of the number whose error decides,
    or None for the first.
    """

    names: tuple[str, ...] = NAMES
    quick: bool = False
    seeds: int | None = None
    tolerance: float = 0.05
    observable: str | None = None

    def list_variants(
        self, scene: Scene
    ) -> tuple[list[Variant], Variant, list[Variant], dict[str, str]]:
        """(presets and single changes, check of the reference, seeds, left out) of a scene."""
        parameters = find_parameters(scene)
        singles, left_out = list_single_changes(scene, self.names, self.quick)
        seeds = list_seeds(scene, self.seeds or (QUICK_SEEDS if self.quick else SEEDS))
        return [*parameters.presets(scene), *singles], parameters.check(scene), seeds, left_out


def make_base_scene(scene: Scene, threads: int | str = 1) -> Scene:
    """The scene before the changes: one run, with a time in place of a number of steps.

    threads: of each run, by default one, so that costs do not contain what is shared among several.

    A number of steps would be another time at another time step.
    """
    data = scene.input_data
    data.pop("replicas", None)
    scene = scene.with_data(data).with_value("numerics.threads", threads)
    paths = list_stage_paths(scene)
    counted = [
        path
        for path, plan in zip(paths, scene.stage_plans, strict=True)
        if plan.stop.steps is not None
    ]
    if not counted:
        return scene
    compute_step = find_parameters(scene).step
    if compute_step is None:
        text = "a number of steps is another time at another spacing; set stop.time"
        raise DustError(f"{counted[0]}stop.steps: {text}")
    dt, data = compute_step(scene), scene.input_data
    for path in counted:
        stop = (data["stages"][paths.index(path)] if path else data)["stop"]
        steps = stop.pop("steps")
        if stop.get("time") is None:
            # a little less, so that rounding does not add a step
            stop["time"] = quantities.format((float(steps) - 0.01) * dt, "time")
    return scene.with_data(data)


def list_single_changes(
    scene: Scene, names: tuple[str, ...] = NAMES, quick: bool = False
) -> tuple[list[Variant], dict[str, str]]:
    """(Variants, left out: parameter -> reason) of a base scene: every level but its own.

    quick: at most three levels of a parameter, the first and the last among them. Raises DustError
    where the method of the scene has none of the parameters.
    """
    parameters = find_parameters(scene).parameters
    allowed = [parameter.name for parameter in parameters]
    foreign = [] if names == NAMES else [name for name in names if name not in allowed]
    if foreign and len(foreign) == len(names):
        raise DustError(
            f"--parameters {', '.join(names)}: no parameter of method: {scene.method}; allowed: "
            f"{', '.join(allowed)}"
        )
    variants: list[Variant] = []
    left_out = dict.fromkeys(foreign, f"no parameter of method: {scene.method}")
    for parameter in parameters:
        if (name := parameter.name) not in names:
            continue
        if reason := parameter.obstacle(scene):
            left_out[name] = reason
            continue
        levels = parameter.list_levels(scene)
        levels = [(text, changes) for text, changes in levels if not _is_base(scene, changes)]
        if not levels:
            left_out[name] = "the scene allows no other level"
        if quick and len(levels) > QUICK_LEVELS:
            last = len(levels) - 1
            levels = [levels[round(n * last / (QUICK_LEVELS - 1))] for n in range(QUICK_LEVELS)]
        variants += [
            Variant(f"{name} = {text}", name, text, _read_number(text), parameter.kind, changes)
            for text, changes in levels
        ]
    return variants, left_out


def _is_base(scene: Scene, changes: dict[str, Any]) -> bool:
    """True where the changes leave the scene unchanged."""
    try:
        return change_scene(scene, changes) == scene
    except DustError:  # it stays, as a variant that is refused
        return False


def _read_number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def list_seeds(scene: Scene, count: int) -> list[Variant]:
    """Variants with further seeds, `count` with that of the scene; [] for a sample without seeds.

    They add a number to every seed of the sample that has an effect: among the lattices of the
    continuum only a glass is random.
    """
    blocks = find_keys({"sample": scene.plain["sample"]}, "seed")
    seeds = {
        ".".join(path): block["seed"]
        for path, block in blocks
        if block.get("lattice", "glass") == "glass"
    }
    return [
        Variant(f"seed + {n}", "seed", f"+{n}", n, SAMPLE,
                {path: (seed + n) % 2**32 for path, seed in seeds.items()})
        for n in range(1, count if seeds else 0)
    ]  # fmt: skip


def parse_names(text: str | None) -> tuple[str, ...]:
    """Names of parameters in a text such as "skin,speed"; None: all. Raises DustError."""
    if text is None:
        return NAMES
    names = [name.strip() for name in text.split(",") if name.strip()]
    unknown = [name for name in names if name not in NAMES]
    if unknown or not names:
        raise DustError(
            f"--parameters {', '.join(unknown) or text}: unknown parameter; allowed: "
            f"{', '.join(NAMES)}"
        )
    return tuple(name for name in NAMES if name in names)


def parse_tolerance(text: str) -> float:
    """A share from "5%", "5 %" or "0.05". Raises DustError."""
    match = re.fullmatch(r"\s*([\d.eE+-]+)\s*(%?)\s*", text)
    value = _read_number(match[1]) / (100.0 if match[2] else 1.0) if match else 0.0
    if not 0.0 < value <= 1.0:
        raise DustError(f"--tolerance {text}: must be a share above 0 and up to 1, such as 5%")
    return value
