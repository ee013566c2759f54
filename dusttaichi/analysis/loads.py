"""Tests under load: filling factor at a controlled pressure, strength in shear, triaxial tests.

In a triaxial test one axis of a cell is strained at a controlled stress along the others.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dusttaichi.analysis.cycles import compute_pressure
from dusttaichi.errors import DustError
from dusttaichi.physics.geometry import AXES, Floats
from dusttaichi.results.datasets import read_at
from dusttaichi.scene.quantities import parse

if TYPE_CHECKING:
    import xarray as xr

    from dusttaichi.analysis.records import Records

LAST = 10  #: Records at the end of a stage over which a load is averaged.
MISSED = 0.1  #: Relative deviation of a load from the controlled one from which it is missed.
ROUNDING = 1e-9  #: Shear strain below which nothing has been sheared.
FLOWING = 0.5  #: Share of the strain of a stage, at its end, over which stresses are averaged.


@dataclass(frozen=True)
class ControlledLoad:
    """One stage under a controlled pressure."""

    stage: str  #: Name of the stage.
    prescribed: float  #: Controlled pressure [Pa].
    pressure: float  #: Mean over the LAST records [Pa].
    overshoot: float  #: Largest mean over LAST successive records over `prescribed`, less 1.
    filling_factor: float  #: At the end.
    creep: float  #: Rate of the logarithm of the filling factor over the LAST records [1/s].
    time: float  #: Duration [s].

    @property
    def missed(self) -> bool:
        """True where the load deviates from the controlled one by more than MISSED."""
        return is_load_missed(self.pressure, self.prescribed)


def is_load_missed(load: float, prescribed: float, reference: float = 0.0) -> bool:
    """True where a load deviates from the prescribed one by more than MISSED of it.

    reference: stress for the comparison where a load of 0 is prescribed [Pa]. False where
    `prescribed` is NaN: the load is free.
    """
    return abs(load - prescribed) > MISSED * (abs(prescribed) or abs(reference))


def format_load(test: StrengthTest) -> str:
    """Load [kPa] of a Shearing or Triaxial, beside the prescribed one where that was missed."""
    target = f" instead of {test.prescribed / 1e3:.3g}" if test.missed else ""
    return f"{test.load / 1e3:.3g}{target} kPa"


def measure_controlled_loads(run: Records) -> list[ControlledLoad]:
    """Controlled loads of the stages of a run that control a pressure, in order."""
    return [
        _measure_controlled_load(stage, parse(pressure, "pressure"))
        for stage in run.parts
        if (pressure := find_drive(stage).get("pressure")) and len(stage.series.time) > LAST
    ]


def find_stage_block(stage_run: Records) -> dict[str, Any] | None:
    """Block of a stage of a Run in its scene; None of a run without stages."""
    blocks = {block["name"]: block for block in stage_run.scene.get("stages") or []}
    return blocks.get(stage_run.stage_name, {}) if blocks else None


def find_drive(stage_run: Records) -> dict[str, Any]:
    """Drive of a stage of a Run, as in its scene; of a run without stages its block `boundary`."""
    block = find_stage_block(stage_run)
    scene = stage_run.scene
    drive: dict[str, Any] = scene.get("boundary", {}) if block is None else block.get("drive", {})
    return drive


def _measure_controlled_load(stage: Records, prescribed: float) -> ControlledLoad:
    series = stage.series
    pressure = compute_pressure(series)
    mean = np.convolve(pressure, np.ones(LAST) / LAST, "valid")
    time, phi = series.time.values, series.filling_factor.values
    return ControlledLoad(
        stage=stage.stage_name,
        prescribed=prescribed,
        pressure=float(mean[-1]),
        overshoot=float(mean.max() / prescribed - 1.0),
        filling_factor=float(phi[-1]),
        creep=float(np.log(phi[-1] / phi[-LAST]) / (time[-1] - time[-LAST])),
        time=float(time[-1]) - float(stage.start.time),
    )


@dataclass(frozen=True)
class StrengthTest:
    """One stage in which a sample yields under a load, in n records."""

    stage: str  #: Name of the stage.
    strain: Floats  #: Since its start, (n,).
    filling_factor: Floats  #: (n,).
    strength: float  #: Mean of the stress over the last FLOWING of the strain [Pa].
    strength_sigma: float  #: Its standard error, from the scatter of ten successive blocks [Pa].
    load: float  #: Mean there of the stress that loads the sample [Pa].
    density: float  #: Mean of the filling factor there.
    prescribed: float  #: Load that the scene prescribes [Pa]; NaN without one.

    @property
    def controlled(self) -> bool:
        """True if the scene prescribes the load."""
        return not np.isnan(self.prescribed)

    @property
    def missed(self) -> bool:
        """True where the load is prescribed and deviates by more than MISSED."""
        return is_load_missed(self.load, self.prescribed, self.strength)

    @property
    def has_friction(self) -> bool:
        """True for a point of the line of friction: a compressive load, as prescribed."""
        return self.controlled and self.load > 0.0 and not self.missed


@dataclass(frozen=True)
class Shearing(StrengthTest):
    """One stage that shears, in n records, with the normal stress as its load."""

    #: Shear stress along the motion [Pa], (n,); of a wall its force over its area.
    shear: Floats
    normal: Floats  #: Stress across the motion, positive in compression [Pa], (n,).
    direction: float  #: 1 or -1, that of the shear along x; strain and shear are positive along it.
    previous_strain: float  #: Total shear strain of the run at the start of the stage.

    @property
    def total_strain(self) -> Floats:
        """Shear strain along x since the start of the run, (n,)."""
        return self.previous_strain + self.direction * self.strain


@dataclass(frozen=True)
class Triaxial(StrengthTest):
    """One stage that controls the stress along two axes and strains the third, in n records.

    Its strain, along the third axis, is the logarithm of the lengths, positive in compression; its
    strength is that of the deviator, its load the confining stress.
    """

    axis: str  #: Letter of the third axis.
    #: Stress along it less the mean of the others, positive in compression [Pa], (n,).
    deviator: Floats


def measure_shear_tests(run: Records) -> list[Shearing]:
    """Shear test of every stage of a run that shears, in order.

    Raises
    ------
    DustError
        No stage shears.
    """
    tests, previous_strain = [], 0.0
    for stage in run.parts if "shear_strain" in run.series else []:
        strain = _compute_shear_strain(stage)
        if np.any(np.abs(strain) > ROUNDING) and len(stage.series.time) > 2:
            tests.append(_measure_shear_test(stage, strain, previous_strain))
        previous_strain += float(strain[-1]) if len(strain) else 0.0
    if not tests:
        raise DustError(f"{run.path}: no stage shears; it needs a shear_rate or a shear_speed.")
    return tests


def _compute_shear_strain(stage: Records) -> Floats:
    """Shear strain since the start of a stage, (n,).

    For a top wall it is the integral of its displacement over the current height.
    """
    records = [stage.start, stage.series]
    strain: Floats = np.concatenate([np.atleast_1d(r.shear_strain.values) for r in records])
    if "wall_force" not in stage.series or "height" not in stage.series:
        since_start: Floats = strain[1:] - strain[0]
        return since_start
    height = np.concatenate([np.atleast_1d(r.height.values) for r in records])
    growth: Floats = np.diff(strain * height) / (0.5 * (height[1:] + height[:-1]))
    return np.cumsum(growth)


def _parse_normal_stress(stage: Records) -> float:
    """Stress across the shear of a stage, or pressure, that the scene prescribes [Pa], or NaN."""
    drive = find_drive(stage)
    stress = drive.get("stress")
    if isinstance(stress, (list, tuple)):
        stress = stress[2]
    if stress not in (None, "free"):
        return -parse(stress, "pressure")
    return parse(drive["pressure"], "pressure") if drive.get("pressure") else np.nan


def _measure_shear_test(stage: Records, strain: Floats, previous_strain: float) -> Shearing:
    series, direction = stage.series, float(np.sign(strain[-1]))
    shear, normal = _read_stresses(series)
    strain, shear = direction * strain, direction * shear
    phi = np.asarray(series.get("filling_factor", np.full(len(strain), np.nan)))
    return Shearing(
        stage=stage.stage_name,
        strain=strain,
        shear=shear,
        normal=normal,
        filling_factor=phi,
        prescribed=_parse_normal_stress(stage),
        direction=direction,
        previous_strain=previous_strain,
        **average_flow(strain, shear, normal, phi),
    )


def average_flow(
    strain: Floats,
    stress: Floats,
    load: Floats,
    density: Floats,
) -> dict[str, float]:
    """strength, strength_sigma, load, density: means over the last FLOWING of a growing strain.

    strain, stress, load, density: (n,). The standard error of the strength is that of the means of
    ten blocks of these records.
    """
    late = strain > (1.0 - FLOWING) * strain[-1]
    blocks = [np.mean(block) for block in np.array_split(stress[late], 10) if len(block)]
    sigma = float(np.std(blocks, ddof=1) / np.sqrt(len(blocks))) if len(blocks) > 1 else np.nan
    means = {"strength": stress, "load": load, "density": density}
    return {name: float(np.mean(a[late])) for name, a in means.items()} | {"strength_sigma": sigma}


def _read_stresses(series: xr.Dataset) -> tuple[Floats, Floats]:
    """Shear and normal stress [Pa], (n,) each: of the cell, or on the top wall."""
    if "wall_force" in series:
        across, along = (read_at(series.wall_force, wall="top", xyz=axis) for axis in "xz")
        pressure = read_at(series.pressure, wall="top")
        return across / -along * pressure, pressure
    stress = series.stress.values
    return 0.5 * (stress[:, 0, 2] + stress[:, 2, 0]), -stress[:, 2, 2]


def measure_triaxial_tests(run: Records) -> list[Triaxial]:
    """Triaxial test of every such stage of a run, in order.

    Raises
    ------
    DustError
        There is none.
    """
    stresses = _find_controlled_stresses(run)
    candidates = [stage for stage in run.parts if stage.stage_name in stresses]
    stages = [c for c in candidates if "stress" in c.series and len(c.series.time) > 2]
    if not stages:
        raise DustError(
            f"{run.path}: no stage is a triaxial test; it needs a stress along two axes and a "
            "strain_rate along the third (drive: {stress: [-5 kPa, -5 kPa, free], ...})."
        )
    return [_measure_triaxial_test(stage, stresses[stage.stage_name]) for stage in stages]


def is_triaxial(run: Records) -> bool:
    """True where a stage of a Run is a triaxial test."""
    return bool(_find_controlled_stresses(run)) and "stress" in run.series


def _find_controlled_stresses(run: Records) -> dict[str, list[str]]:
    """Stress along each axis of each stage that controls it along two, by name of the stage."""
    stresses = {stage.stage_name: find_drive(stage).get("stress") for stage in run.parts}
    return {
        name: list(stress)
        for name, stress in stresses.items()
        if isinstance(stress, (list, tuple)) and list(stress).count("free") == 1
    }


def _measure_triaxial_test(stage: Records, stress: list[str]) -> Triaxial:
    """Triaxial of a stage; stress: prescribed along each axis, once "free"."""
    axis, series = stress.index("free"), stage.series
    levels = [parse(level, "pressure") for level in stress if level != "free"]
    start, length = (records.box_length.values[..., axis] for records in (stage.start, series))
    strain = np.log(float(start) / length)
    compression = -np.diagonal(series.stress.values, axis1=1, axis2=2)
    confining = np.delete(compression, axis, axis=1).mean(axis=1)
    deviator, phi = compression[:, axis] - confining, series.filling_factor.values
    return Triaxial(
        stage=stage.stage_name,
        axis=AXES[axis],
        strain=strain,
        deviator=deviator,
        filling_factor=phi,
        prescribed=-float(np.mean(levels)),
        **average_flow(np.abs(strain), deviator, confining, phi),
    )
