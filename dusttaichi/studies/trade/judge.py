"""Assessment of an error: scatter of seeds, error of the reference, tolerance."""

import math
from dataclasses import dataclass

from dusttaichi.analysis.observables import CURVE, differences, scatter
from dusttaichi.errors import DustError
from dusttaichi.studies.trade.point import NUMERICAL


@dataclass(frozen=True)
class Judge:
    """Errors against the Measured of a converged reference.

    name: of the decisive observable. scatter, convergence: observable -> standard deviation
    between seeds, and difference of the reference from its check (Parameters.check), as errors; nan
    where unknown. tolerance: largest accepted error.
    """

    reference: object
    name: str
    scatter: dict
    convergence: dict
    tolerance: float

    @classmethod
    def of(cls, reference, check, default, seeds, *, tolerance, name=None):
        """The Judge from Measured of the reference, its check (or None), the default and all seeds.

        name: of the observable, by default the first of reference and default that is not 0, such
        as a restitution coefficient of bodies that stick. Raises DustError for an unknown one.
        """
        names = [n for n in reference.names if n in default.names]
        if name is not None and name not in names:
            known = f"allowed: {', '.join(names)}" if names else "it has none"
            raise DustError(f"--observable {name}: the scene has no such number; {known}")
        if not names:
            raise DustError(
                "the reference and the unchanged scene have no number in common for a "
                "comparison; give the run a longer time"
            )
        nothing = dict.fromkeys(reference.names, math.nan)
        found = nothing
        if check is not None:
            found = {n: e for n, (_, e) in differences(check, reference).items()}
        telling = [n for n in names if n == CURVE or reference.values[n] != 0.0]
        spread = scatter(seeds, reference)
        return cls(reference, name or (telling or names)[0], spread, nothing | found, tolerance)

    @property
    def floor(self):
        """Error that is not significant: the scatter, without seeds the convergence."""
        known = self.scatter[self.name]
        return known if math.isfinite(known) else self.convergence[self.name]

    @property
    def converged(self):
        """True where the error of the reference is below a third of the tolerance."""
        return self.convergence[self.name] < self.tolerance / 3.0

    def errors(self, result):
        """observable -> (value, error) of a PointResult."""
        return differences(result.measured, self.reference)

    def error(self, result):
        """Error of the decisive observable."""
        return self.errors(result)[self.name][1]

    def free(self, result):
        """True where the error is below the floor."""
        return self.error(result) < self.floor

    def accepts(self, row):
        """True for a Row within the tolerance or, of a numerical parameter, within the scatter.

        Errors of the numerics below the scatter give another sample of the same distribution; a
        change of the physics or of the sample changes the mean, too, which scatter may only hide.
        """
        if not row.result.ok:
            return False
        hidden = row.point.kind == NUMERICAL and self.free(row.result)
        return hidden or self.error(row.result) <= self.tolerance
