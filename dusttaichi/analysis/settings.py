"""Settings of the scenes of runs, for comparisons."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from dusttaichi.analysis.numbers import Family, Observable
from dusttaichi.analysis.summary import format_value

if TYPE_CHECKING:
    from dusttaichi.analysis.run import Run


DRIVES = ("wall_speed", "face_speed", "strain_rate", "compression_rate", "pressure", "stress",
          "shear_speed", "shear_rate")  # fmt: skip


def look_up(scene: Mapping[str, Any], path: str) -> Any:
    """Value of a scene (plain dicts) at a path such as "numerics.spacing", or ""."""
    value: Any = scene
    for key in path.split("."):
        value = value.get(key, "") if isinstance(value, dict) else ""
    return value


def _read_modifier(effect: Any) -> Any:
    return effect.get("modifier") if isinstance(effect, dict) else effect


def _read_grain_settings(run: Run) -> dict[str, Any]:
    scene = run.scene
    return {
        "damping": look_up(scene, "interaction.damping.model"),
        "m_r": _read_modifier(look_up(scene, "interaction.rolling")),
        "m_s": _read_modifier(look_up(scene, "interaction.sliding")),
        "wall_speed": str(look_up(scene, "boundary.wall_speed") or ""),
        "time_step_ns": float(run.attrs.get("time_step", np.nan)) * 1e9,
        "drive": _format_drives(scene),
    }


def _format_drives(scene: Mapping[str, Any]) -> str:
    """Text of the drive of a scene, of each stage if it has stages."""
    stages = scene.get("stages") or [{"drive": scene.get("boundary", {})}]
    texts: list[str] = []
    for stage in stages:
        drive = stage.get("drive") or {}
        moved = [
            f"{key} {format_value(drive[key])}" for key in DRIVES if drive.get(key) is not None
        ]
        name = f"{stage['name']}: " if "name" in stage else ""
        texts.extend(f"{name}{text}" for text in moved)
    return "; ".join(texts)


OF_GRAINS = Family(
    name="grains",
    title="the scene of grains",
    order=0,
    measure=_read_grain_settings,
    compared=True,
    numbers=tuple(
        Observable(name=name, title=title, unit=unit, column=None)
        for name, title, unit in (
            ("damping", "model of the damping", ""),
            ("m_r", "modifier of the rolling", ""),
            ("m_s", "modifier of the sliding", ""),
            ("wall_speed", "speed of the wall", ""),
            ("time_step_ns", "time step", "ns"),
            ("drive", "drive of each stage", ""),
        )
    ),
)
