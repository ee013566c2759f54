"""Judgement of an error: beside the scatter of seeds, the reference's own, and the tolerance."""

import math
from dataclasses import dataclass

from dusttaichi.analysis.observables import CURVE, differences, scatter
from dusttaichi.errors import DustError
from dusttaichi.studies.trade.point import NUMERICAL


@dataclass(frozen=True)
class Judge:
    """Errors against the Measured of a converged reference.

    name: of the observable that decides. scatter, convergence: observable -> standard deviation
    between seeds, and difference of the reference from its check (knobs.check), as errors; nan
    where they are not known. tolerance: largest error that is wanted.
    """

    reference: object
    name: str
    scatter: dict
    convergence: dict
    tolerance: float

    @classmethod
    def of(cls, reference, check, default, seeds, *, tolerance, name=None):
        """The Judge from Measured of the reference, of its check (or None), of the
        default and of all seeds.

        name: of the observable, by default the first that reference and default have and that is
        not 0: bodies that stick have a restitution, but it tells nothing. Raises DustError for
        an observable that there is not.
        """
        names = [n for n in reference.names if n in default.names]
        if name is not None and name not in names:
            known = f"allowed: {', '.join(names)}" if names else "it has none"
            raise DustError(f"--observable {name}: the scene gives no such number; {known}")
        if not names:
            raise DustError(
                "the reference and the scene as it is have no number in common that could be "
                "compared; let the run go on for longer"
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
        """Error below which nothing can be told: the scatter, without seeds the convergence."""
        known = self.scatter[self.name]
        return known if math.isfinite(known) else self.convergence[self.name]

    @property
    def converged(self):
        """True where the reference's own error is below a third of the tolerance."""
        return self.convergence[self.name] < self.tolerance / 3.0

    def errors(self, result):
        """observable -> (value, error) of a PointResult."""
        return differences(result.measured, self.reference)

    def error(self, result):
        """The error of the observable that decides."""
        return self.errors(result)[self.name][1]

    def free(self, result):
        """True where the error is below the floor."""
        return self.error(result) < self.floor

    def accepts(self, row):
        """True for a Row within the tolerance, or, of a numerical knob, within the scatter.

        Numerics that err less than the scatter give another sample of the same; but what changes
        the physics or the sample moves the mean too, which scatter may only hide.
        """
        if not row.result.ok:
            return False
        hidden = row.point.kind == NUMERICAL and self.free(row.result)
        return hidden or self.error(row.result) <= self.tolerance
