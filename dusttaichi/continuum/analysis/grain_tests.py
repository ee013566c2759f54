"""A grain run as a test of a material: its strain and the stress response.

A stage presses, rests, unloads a little or pulls. Strains are natural, along x, y and z from the
start of the run; stresses are those of the grains (virial), positive in compression.
"""

from dataclasses import dataclass

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.results.datasets import take_record

LEAST_PRESSED = 0.01  #: Growth of ln(filling factor) from which a stage presses.

LEAST_PULLED = 0.01  #: Fall of ln(filling factor) from which a stage pulls; by less it unloads.

SIDEWAYS = 0.01  #: Strain along x and y over that along z up to which a test is confined.


@dataclass(frozen=True)
class Segment:
    """One stage: kind "press", "rest", "release" or "pull", and its records in time.

    strain (n + 1, 3): from the start of the run, the first entry at the start of the stage. stress
    (n, 3) [Pa]: mean over the interval that ends with the record, positive in compression.
    phi (n,): filling factor in the middle of the interval. rate [1/s]: of the strain along z, to
    three digits.
    """

    kind: str
    name: str
    strain: np.ndarray
    stress: np.ndarray
    phi: np.ndarray
    rate: float

    @property
    def pressure(self):
        """Third of the trace of the stress [Pa], (n,)."""
        return self.stress.mean(axis=1)

    @property
    def difference(self):
        """Axial stress less the mean of the two at the sides [Pa], (n,)."""
        return self.stress[:, 2] - 0.5 * (self.stress[:, 0] + self.stress[:, 1])


@dataclass(frozen=True)
class GrainTest:
    """A grain run: its segments and its sample.

    seed: of the sample. grains: their number. solid_density [kg/m^3]. phi: filling factor at the
    start.
    """

    name: str
    path: str
    seed: int
    grains: int
    solid_density: float
    phi: float
    segments: tuple[Segment, ...]


def grain_test(run):
    """The GrainTest of a Run. Raises DustError without stress, or where it is not confined."""
    series = run.series
    if "stress" not in series or "filling_factor" not in series:
        raise DustError(
            f"{run.path} has no stress of the grains, and the stress at the sides is needed beside "
            "that along z: set output.stress: true (a periodic cell has it by default)."
        )
    if run.material is None or run.grains is None:
        raise DustError(f"{run.path} has no material of grains: it is no run of grains.")
    if run.sheared:
        raise DustError(f"{run.path} is no confined test: its cell is sheared.")
    segments = tuple(filter(None, (_segment(run, stage) for stage in run.parts)))
    sideways = max((np.abs(s.strain[:, :2]).max() for s in segments), default=0.0)
    along = max((np.abs(s.strain[:, 2]).max() for s in segments), default=0.0)
    if not along or sideways > SIDEWAYS * along:
        raise DustError(
            f"{run.path} is no confined test: it must be strained along z, and along z alone, for "
            "example by strain_rate: [0 s^-1, 0 s^-1, -1e4 s^-1] of a periodic cell."
        )
    sample = run.scene.get("sample", {})
    return GrainTest(
        name=run.name,
        path=str(run.path),
        seed=int(sample.get("seed", 0)),
        grains=run.grains,
        solid_density=float(run.material.density),
        phi=float(series.filling_factor.values[0]),
        segments=segments,
    )


def _segment(run, stage):
    """The Segment of a stage, or of a run without stages; None where it has no records."""
    first = take_record(run.series, "time", 0)
    includes_start = int(stage.start.step) >= stage.series.step.values[0]
    series = stage.series.isel(time=slice(int(includes_start), None))
    if not len(series.time):
        return None
    strain = np.vstack([_strain(stage.start, first)[None], _strain(series, first)])
    stress = -np.stack([series.stress.values[:, k, k] for k in range(3)], axis=1)
    is_complete = np.isfinite(stress).all(axis=1)
    strain, stress = strain[np.r_[True, is_complete]], stress[is_complete]
    if not len(stress):
        return None
    grown = -(strain[-1] - strain[0]).sum()
    segment_kind = (
        "press" if grown > LEAST_PRESSED else "pull" if grown < -LEAST_PULLED else "release"
    )
    if abs(grown) < 1e-6:
        segment_kind = "rest"
    middle = 0.5 * (strain[1:] + strain[:-1]).sum(axis=1)
    span = float(series.time.values[-1]) - float(stage.start.time)
    return Segment(
        kind=segment_kind,
        name=run.whole.stages[int(series.stage.values[-1])] if run.whole.stages else "",
        strain=strain,
        stress=stress,
        phi=float(first.filling_factor) * np.exp(-middle),
        rate=float(f"{abs(strain[-1, 2] - strain[0, 2]) / span:.3g}") if span > 0 else 0.0,
    )


def _strain(records, first):
    """Natural strain since the first record, (..., 3)."""
    if "box_length" in records:
        return np.log(records.box_length.values / first.box_length.values)
    volume = np.log(first.filling_factor.values / records.filling_factor.values)
    return np.stack([0.0 * volume, 0.0 * volume, volume], axis=-1)
