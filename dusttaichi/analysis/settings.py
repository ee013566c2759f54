"""Settings of the scenes of runs, for comparisons."""

import numpy as np

from dusttaichi.analysis.compare import text_of
from dusttaichi.analysis.numbers import Family, Observable

DRIVES = ("wall_speed", "face_speed", "strain_rate", "compression_rate", "pressure", "stress")
DRIVES += ("shear_speed", "shear_rate")


def at(scene, path):
    """Value of a scene (plain dicts) at a path such as "numerics.spacing", or ""."""
    for key in path.split("."):
        scene = scene.get(key, "") if isinstance(scene, dict) else ""
    return scene


def _modifier(effect):
    return effect.get("modifier") if isinstance(effect, dict) else effect


def _of_grains(run):
    scene = run.scene
    return {
        "damping": at(scene, "interaction.damping.model"),
        "m_r": _modifier(at(scene, "interaction.rolling")),
        "m_s": _modifier(at(scene, "interaction.sliding")),
        "wall_speed": str(at(scene, "boundary.wall_speed") or ""),
        "time_step_ns": float(run.attrs.get("time_step", np.nan)) * 1e9,
        "drive": _drive(scene),
    }


def _drive(scene):
    """Drive of a scene: what moves and how fast; of each stage where there are stages."""
    stages = scene.get("stages") or [{"drive": scene.get("boundary", {})}]
    texts = []
    for stage in stages:
        drive = stage.get("drive") or {}
        moved = [f"{key} {text_of(drive[key])}" for key in DRIVES if drive.get(key) is not None]
        name = f"{stage['name']}: " if "name" in stage else ""
        texts.extend(f"{name}{text}" for text in moved)
    return "; ".join(texts)


def _setting(name, title, unit=""):
    return Observable(name=name, title=title, unit=unit, column=None)


OF_GRAINS = Family(
    name="grains",
    title="the scene of grains",
    place=0,
    measure=_of_grains,
    compared=True,
    numbers=(
        _setting("damping", "model of the damping"),
        _setting("m_r", "modifier of the rolling"),
        _setting("m_s", "modifier of the sliding"),
        _setting("wall_speed", "speed of the wall"),
        _setting("time_step_ns", "time step", "ns"),
        _setting("drive", "what moves, of each stage"),
    ),
)
