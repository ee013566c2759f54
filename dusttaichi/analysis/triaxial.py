"""Triaxial tests: one axis of a cell is strained at a controlled stress along the others."""

from dataclasses import dataclass

import numpy as np

from dusttaichi.analysis.loads import drive_of, flow, misses
from dusttaichi.errors import DustError
from dusttaichi.names import AXES
from dusttaichi.scene.quantities import parse


@dataclass(frozen=True)
class Triaxial:
    """One stage that controls the stress along two axes and strains the third, in n records."""

    stage: str  #: Name of the stage.
    axis: str  #: Letter of the third axis.
    #: Of that axis since the start of the stage, ln of the lengths, positive in compression, (n,).
    strain: np.ndarray
    #: Stress along it less the mean of the others, positive in compression [Pa], (n,).
    deviator: np.ndarray
    confining: np.ndarray  #: Mean stress along the other axes [Pa], (n,).
    filling_factor: np.ndarray  #: (n,).
    strength: float  #: Mean deviator over the last half of the strain, as in loads.Shearing [Pa].
    strength_sigma: float  #: Its standard error [Pa].
    load: float  #: Mean confining stress there [Pa].
    density: float  #: Mean filling factor there.
    wanted: float  #: Prescribed confining stress [Pa].

    @property
    def missed(self):
        """True where the confining stress deviates from the prescribed one by more than MISSED."""
        return misses(self.load, self.wanted, self.strength)

    @property
    def has_friction(self):
        """True for a point of the line of friction: compressed by the prescribed stress."""
        return self.load > 0.0 and not self.missed


def triaxials(run):
    """Triaxial test of every such stage of a run, in order.

    Raises
    ------
    DustError
        There is none.
    """
    stresses = _stresses(run)
    parts = run.parts if "stress" in run.series else []
    tests = [part for part in parts if part.stage_name in stresses and len(part.series.time) > 2]
    found = [_triaxial(part, stresses[part.stage_name]) for part in tests]
    if not found:
        raise DustError(
            f"{run.path}: no stage is a triaxial test; it needs a stress along two axes and a "
            "strain_rate along the third (drive: {stress: [-5 kPa, -5 kPa, free], ...})."
        )
    return found


def is_triaxial(run):
    """True where a stage of a Run is a triaxial test."""
    return bool(_stresses(run)) and "stress" in run.series


def _stresses(run):
    """Stress along each axis of each part that controls it along two, by name of the stage."""
    stresses = {part.stage_name: drive_of(part).get("stress") for part in run.parts}
    return {
        name: list(stress)
        for name, stress in stresses.items()
        if isinstance(stress, (list, tuple)) and list(stress).count("free") == 1
    }


def _triaxial(part, stress):
    """Triaxial of a stage; stress: prescribed along each axis, once "free"."""
    axis = stress.index("free")
    wanted = -np.mean([parse(own, "pressure") for own in stress if own != "free"])
    series = part.series
    length = series.box_length.values[:, axis]
    strain = np.log(float(part.start.box_length.values[axis]) / length)
    pressed = -np.diagonal(series.stress.values, axis1=1, axis2=2)
    confining = np.delete(pressed, axis, axis=1).mean(axis=1)
    deviator, phi = pressed[:, axis] - confining, series.filling_factor.values
    return Triaxial(
        stage=part.stage_name,
        axis=AXES[axis],
        strain=strain,
        deviator=deviator,
        confining=confining,
        filling_factor=phi,
        wanted=float(wanted),
        **flow(np.abs(strain), deviator, confining, phi),
    )
