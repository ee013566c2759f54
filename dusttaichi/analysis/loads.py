"""Tests under load: filling factor under a controlled pressure, and strength in shear."""

from dataclasses import dataclass

import numpy as np

from dusttaichi.analysis.cycles import pressure_of
from dusttaichi.errors import DustError
from dusttaichi.scene.quantities import parse

LAST = 10  #: Records at the end of a stage over which a load is averaged.
MISSED = 0.1  #: Relative deviation of a load from the controlled one from which it is missed.
ROUNDING = 1e-9  #: Shear strain below which nothing has been sheared.
FLOWING = 0.5  #: Share of the strain of a stage, at its end, over which stresses are averaged.


@dataclass(frozen=True)
class ControlledLoad:
    """One stage under a controlled pressure."""

    stage: str  #: Name of the stage.
    wanted: float  #: Controlled pressure [Pa].
    pressure: float  #: Mean over the LAST records [Pa].
    overshoot: float  #: Largest mean over LAST successive records over `wanted`, less 1.
    filling_factor: float  #: At the end.
    creep: float  #: Rate of the logarithm of the filling factor over the LAST records [1/s].
    time: float  #: Duration [s].

    @property
    def missed(self):
        """True where the load deviates from the controlled one by more than MISSED."""
        return misses(self.pressure, self.wanted)


def misses(load, wanted, other=0.0):
    """True where a load deviates from the prescribed one by more than MISSED of it.

    other: stress that takes its place where no load is prescribed, that is 0 [Pa]. False where
    `wanted` is NaN: the load is free.
    """
    return abs(load - wanted) > MISSED * (abs(wanted) or abs(other))


def load_text(test):
    """Load [kPa] of a Shearing or Triaxial, beside the prescribed one where that was missed."""
    wanted = f" instead of {test.wanted / 1e3:.3g}" if test.missed else ""
    return f"{test.load / 1e3:.3g}{wanted} kPa"


def controlled_loads(run):
    """Controlled loads of the stages of a run that control a pressure, in order."""
    return [
        _controlled_load(part, parse(pressure, "pressure"))
        for part in run.parts
        if (pressure := drive_of(part).get("pressure")) and len(part.series.time) > LAST
    ]


def stage_of(part):
    """Block of a stage of a Run in its scene; None of a run without stages."""
    stages = {stage["name"]: stage for stage in part.scene.get("stages") or []}
    return stages.get(part.stage_name, {}) if stages else None


def drive_of(part):
    """Drive of a stage of a Run, as in its scene; of a run without stages its block `boundary`."""
    stage = stage_of(part)
    return part.scene.get("boundary", {}) if stage is None else stage.get("drive", {})


def _controlled_load(part, wanted):
    series = part.series
    pressure = pressure_of(series)
    mean = np.convolve(pressure, np.ones(LAST) / LAST, "valid")
    time, phi = series.time.values, series.filling_factor.values
    return ControlledLoad(
        stage=part.stage_name,
        wanted=wanted,
        pressure=float(mean[-1]),
        overshoot=float(mean.max() / wanted - 1.0),
        filling_factor=float(phi[-1]),
        creep=float(np.log(phi[-1] / phi[-LAST]) / (time[-1] - time[-LAST])),
        time=float(time[-1] - part.start.time),
    )


@dataclass(frozen=True)
class Shearing:
    """One stage that shears, in n records."""

    stage: str  #: Name of the stage.
    strain: np.ndarray  #: Shear strain since its start, (n,).
    #: Shear stress along the motion [Pa], (n,); of a wall its force over its area.
    shear: np.ndarray
    normal: np.ndarray  #: Stress across the motion, positive in compression [Pa], (n,).
    filling_factor: np.ndarray  #: (n,).
    strength: float  #: Mean of the shear stress over the last FLOWING of the strain [Pa].
    strength_sigma: float  #: Its standard error, from the scatter of ten successive parts [Pa].
    load: float  #: Mean of the normal stress there [Pa].
    density: float  #: Mean of the filling factor there.
    #: Normal stress, or pressure, that the scene prescribes [Pa]; NaN without one.
    wanted: float
    direction: float  #: 1 or -1, that of the shear along x; strain and shear are positive along it.
    before: float  #: Total shear strain of the run at the start of the stage.

    @property
    def controlled(self):
        """True if the scene prescribes the normal stress, or a pressure."""
        return not np.isnan(self.wanted)

    @property
    def missed(self):
        """True where the normal stress is prescribed and deviates by more than MISSED."""
        return misses(self.load, self.wanted, self.strength)

    @property
    def has_friction(self):
        """True for a point of the line of friction: a compressive normal stress, as prescribed."""
        return self.controlled and self.load > 0.0 and not self.missed

    @property
    def total_strain(self):
        """Shear strain along x since the start of the run, (n,)."""
        return self.before + self.direction * self.strain


@dataclass(frozen=True)
class Friction:
    """Line through the strengths of several loads: strength = cohesion + slope x load.

    The 1-sigma uncertainties follow from the scatter about the line; they are NaN for two loads.
    """

    cohesion: float  #: [Pa].
    cohesion_sigma: float  #: Uncertainty of the cohesion [Pa].
    slope: float  #: Slope of the line.
    slope_sigma: float  #: Uncertainty of the slope.

    @property
    def angle(self):
        """Friction angle [degrees]."""
        return float(np.degrees(np.arctan(self.slope)))

    @property
    def angle_sigma(self):
        """Uncertainty of the friction angle [degrees]."""
        return float(np.degrees(self.slope_sigma / (1.0 + self.slope**2)))

    @property
    def triaxial_angle(self):
        """Friction angle [degrees] of a line through deviators over confining stresses.

        It is that of Mohr's circles: sin = M/(2 + M) with the slope M.
        """
        return float(np.degrees(np.arcsin(self._sine)))

    @property
    def triaxial_angle_sigma(self):
        """Uncertainty of the friction angle of triaxial tests [degrees]."""
        change = 2.0 / (2.0 + self.slope) ** 2 / np.sqrt(1.0 - self._sine**2)
        return float(np.degrees(change * self.slope_sigma))

    @property
    def triaxial_cohesion(self):
        """Cohesion [Pa] of the tangent of these circles."""
        return float(self.cohesion * np.sqrt((1.0 - self._sine) / (1.0 + self._sine)) / 2.0)

    @property
    def _sine(self):
        return self.slope / (2.0 + self.slope)


def shearings(run):
    """Shear test of every stage of a run that shears, in order.

    Raises
    ------
    DustError
        No stage shears.
    """
    found, before = [], 0.0
    for part in run.parts if "shear_strain" in run.series else []:
        strain = _sheared(part)
        if np.any(np.abs(strain) > ROUNDING) and len(part.series.time) > 2:
            found.append(_shearing(part, strain, before))
        before += float(strain[-1]) if len(strain) else 0.0
    if not found:
        raise DustError(f"{run.path}: no stage shears; it needs a shear_rate or a shear_speed.")
    return found


def friction(found):
    """Line of friction of several shear or triaxial tests, of one sample or more.

    It uses stages with a compressive normal stress that the scene prescribes; None below two loads.
    """
    used = [s for s in found if s.has_friction]
    load, strength = (np.array([getattr(s, name) for s in used]) for name in ("load", "strength"))
    if len(used) < 2 or np.ptp(load) == 0.0:
        return None
    if len(used) == 2:
        slope, cohesion = np.polyfit(load, strength, 1)
        return Friction(float(cohesion), np.nan, float(slope), np.nan)
    (slope, cohesion), covariance = np.polyfit(load, strength, 1, cov=True)
    slope_sigma, cohesion_sigma = np.sqrt(np.diag(covariance))
    return Friction(float(cohesion), float(cohesion_sigma), float(slope), float(slope_sigma))


def _sheared(part):
    """Shear strain since the start of a stage, (n,).

    For a top wall it is the integral of its displacement over the current height.
    """
    records = [part.start, part.series]
    strain = np.concatenate([np.atleast_1d(r.shear_strain.values) for r in records])
    if "wall_force" not in part.series or "height" not in part.series:
        return strain[1:] - strain[0]
    height = np.concatenate([np.atleast_1d(r.height.values) for r in records])
    return np.cumsum(np.diff(strain * height) / (0.5 * (height[1:] + height[:-1])))


def _normal_stress(part):
    """Stress across the shear of a stage, or pressure, that the scene prescribes [Pa], or NaN."""
    drive = drive_of(part)
    stress = drive.get("stress")
    if isinstance(stress, (list, tuple)):
        stress = stress[2]
    if stress not in (None, "free"):
        return -parse(stress, "pressure")
    return parse(drive["pressure"], "pressure") if drive.get("pressure") else np.nan


def _shearing(part, strain, before):
    series = part.series
    shear, normal = _stresses(series)
    direction = float(np.sign(strain[-1]))
    strain, shear = direction * strain, direction * shear
    phi = np.asarray(series.get("filling_factor", np.full(len(strain), np.nan)))
    return Shearing(
        stage=part.stage_name,
        strain=strain,
        shear=shear,
        normal=normal,
        filling_factor=phi,
        wanted=_normal_stress(part),
        direction=direction,
        before=before,
        **flow(strain, shear, normal, phi),
    )


def flow(strain, stress, load, density):
    """strength, strength_sigma, load, density: means over the last FLOWING of a growing strain.

    strain, stress, load, density: (n,). The standard error of the strength is that of the means of
    ten parts of these records.
    """
    late = strain > (1.0 - FLOWING) * strain[-1]
    parts = [np.mean(p) for p in np.array_split(stress[late], 10) if len(p)]
    sigma = float(np.std(parts, ddof=1) / np.sqrt(len(parts))) if len(parts) > 1 else np.nan
    means = {"strength": stress, "load": load, "density": density}
    return {name: float(np.mean(a[late])) for name, a in means.items()} | {"strength_sigma": sigma}


def _stresses(series):
    """Shear and normal stress [Pa], (n,) each: of the cell, or on the top wall."""
    if "wall_force" in series:
        force = series.wall_force.sel(wall="top")
        pressure = series.pressure.sel(wall="top").values
        return force.sel(xyz="x").values / -force.sel(xyz="z").values * pressure, pressure
    stress = series.stress.values
    return 0.5 * (stress[:, 0, 2] + stress[:, 2, 0]), -stress[:, 2, 2]
