"""Line of friction through the strengths of several shear or triaxial tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from dusttaichi.analysis.loads import StrengthTest


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
    def angle(self) -> float:
        """Friction angle [degrees]."""
        return float(np.degrees(np.arctan(self.slope)))

    @property
    def angle_sigma(self) -> float:
        """Uncertainty of the friction angle [degrees]."""
        return float(np.degrees(self.slope_sigma / (1.0 + self.slope**2)))

    @property
    def triaxial_angle(self) -> float:
        """Friction angle [degrees] of a line through deviators over confining stresses.

        It is that of Mohr's circles: sin = M/(2 + M) with the slope M.
        """
        return float(np.degrees(np.arcsin(self._sine)))

    @property
    def triaxial_angle_sigma(self) -> float:
        """Uncertainty of the friction angle of triaxial tests [degrees]."""
        change = 2.0 / (2.0 + self.slope) ** 2 / np.sqrt(1.0 - self._sine**2)
        return float(np.degrees(change * self.slope_sigma))

    @property
    def triaxial_cohesion(self) -> float:
        """Cohesion [Pa] of the tangent of these circles."""
        return float(self.cohesion * np.sqrt((1.0 - self._sine) / (1.0 + self._sine)) / 2.0)

    @property
    def _sine(self) -> float:
        return self.slope / (2.0 + self.slope)


def fit_friction(tests: Sequence[StrengthTest]) -> Friction | None:
    """Line of friction of several shear or triaxial tests, of one sample or more.

    It uses stages with a compressive normal stress that the scene prescribes; None below two loads.
    """
    usable = [test for test in tests if test.has_friction]
    load, strength = np.array([(test.load, test.strength) for test in usable]).reshape(-1, 2).T
    if len(usable) < 2 or np.ptp(load) == 0.0:
        return None
    if len(usable) == 2:
        line, sigma = np.polyfit(load, strength, 1), np.full(2, np.nan)
    else:
        line, covariance = np.polyfit(load, strength, 1, cov=True)
        sigma = np.sqrt(np.diag(covariance))
    return Friction(*map(float, (line[1], sigma[1], line[0], sigma[0])))
