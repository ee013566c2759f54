"""Provenance of a result: scene, versions and machine, as global attributes."""

from __future__ import annotations

import os
import platform
import subprocess
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any, Protocol

import yaml

from dusttaichi.compute import compiler, processor
from dusttaichi.compute.version import __version__ as __version__
from dusttaichi.results.plain import plain


class SceneTexts(Protocol):
    """A scene with its name and its texts."""

    @property
    def name(self) -> str: ...
    @property
    def source(self) -> str: ...
    def to_yaml(self) -> str: ...


@cache
def git_commit() -> str | None:
    """Commit of the source tree this package runs from, `-dirty` if changed; None outside one.

    As it is at the first call of a process, whose code is that of its imports.
    """
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return None
    command = ["git", "-C", str(root), "describe", "--always", "--dirty", "--abbrev=40"]
    try:
        answer = subprocess.run(command, capture_output=True, text=True, timeout=5)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return answer.stdout.strip() or None


def provenance(scene_given: str, scene_resolved: str, **numbers: Any) -> dict[str, Any]:
    """Global attributes of a run: both YAML texts, versions, machine, and `numbers`.

    Those that are None are left out.

    Parameters
    ----------
    scene_given : str
        YAML as given.
    scene_resolved : str
        YAML with every default.
    **numbers
        title, seed, backend, precision, threads, time_step [s] and further attributes of the run.
    """
    versions = {name: metadata.version(name) for name in (compiler.name(), "numpy", "netCDF4")}
    attributes = {
        "Conventions": "CF-1.11",
        "source": f"dusttaichi {__version__}",
        "dusttaichi_version": __version__,
        "git_commit": git_commit(),
        "scene_given": scene_given,
        "scene_resolved": scene_resolved,
        "cpu": processor.model(),
        "cpu_cores": os.cpu_count(),
        "platform": platform.platform(),
        "python_version": platform.python_version(),
        **{f"{name.lower()}_version": version for name, version in versions.items()},
        **numbers,
    }
    return {name: value for name, value in attributes.items() if value is not None}


def describe_study(
    scene: SceneTexts, resolved: SceneTexts | None = None, **numbers: Any
) -> dict[str, Any]:
    """Global attributes of the dataset of a study of a scene; see `provenance`.

    resolved: the scene that was used, if other than `scene`.
    """
    texts = scene.source or "", (resolved or scene).to_yaml()
    attributes = provenance(*texts, title=scene.name, **numbers)
    # as lists: a plain text is limited to 64 kB
    return {
        key: [value] if key.startswith("scene_") else value for key, value in attributes.items()
    }


def yaml_text(value: Any) -> str:
    """A value as YAML; see `plain`."""
    return str(yaml.safe_dump(plain(value), sort_keys=False))
