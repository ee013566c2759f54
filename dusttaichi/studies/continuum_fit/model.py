"""The tests of grains repeated with a material point, for many materials at once."""

from types import SimpleNamespace

import numpy as np

from dusttaichi.physics.continuum.numbers import MaterialNumbers
from dusttaichi.physics.continuum.point import MaterialPoint
from dusttaichi.studies.continuum_fit.observations import middle, seen

# name in the YAML -> (unit, lowest, highest); of SCALES the logarithm is fitted
PARAMETERS = {
    "bulk_modulus": ("Pa", 1e2, 1e9),
    "exponent": ("1", 1.0, 20.0),
    "shear_ratio": ("1", 0.02, 1.5),
    "compressive.p_m": ("Pa", 1.0, 1e7),
    "compressive.delta": ("1", 0.05, 4.0),
    "compressive.phi_1": ("1", 0.0, 0.5),
    "shear.factor": ("1", 0.02, 50.0),
    "shear.exponent": ("1", 0.0, 1.0),
    "tensile.a": ("1", -2.0, 8.0),
    "tensile.b": ("1", 0.0, 25.0),
}
START = (2e5, 4.5, 0.7, 5e3, 0.6, 0.12, 1.5, 0.6, 2.8, 1.5)


def numbers_of(values, solid_density, density, phi_2):
    """MaterialNumbers of values (..., parameters) in the order of PARAMETERS, each an array."""
    v = dict(zip(PARAMETERS, np.moveaxis(np.asarray(values, dtype=float), -1, 0), strict=True))
    squeeze = {name: v[f"compressive.{name}"] for name in ("p_m", "delta", "phi_1")}
    return MaterialNumbers.of(
        SimpleNamespace(
            solid_density=solid_density,
            density=density,
            bulk_modulus=v["bulk_modulus"],
            exponent=v["exponent"],
            shear_ratio=v["shear_ratio"],
            compressive=SimpleNamespace(phi_2=phi_2, **squeeze),
            tensile=SimpleNamespace(a=v["tensile.a"], b=v["tensile.b"]),
            shear=SimpleNamespace(factor=v["shear.factor"], exponent=v["shear.exponent"]),
        )
    )


def stresses(test, m):
    """Stress [Pa], positive in compression, of points of the materials m strained as the test.

    A list of arrays (records, materials, 3) by segment of the GrainTest, means over the intervals.
    """
    density = np.broadcast_to(test.phi * test.solid_density, np.shape(m.p_m))
    point = MaterialPoint.at(m, density)
    out = []
    for segment in test.segments:
        rows = [-point.stress]
        for step in np.diff(segment.strain, axis=0):
            point = point.strained(step) if step.any() else point
            rows.append(-point.stress)
        rows = np.stack(rows)
        out.append(0.5 * (rows[1:] + rows[:-1]))
    return out


def predicted(test, found, m):
    """Predictions of the materials m for the Observations `found`, (found, m)."""
    history = stresses(test, m)
    return np.array(
        [
            seen(
                one.quantity,
                middle(test.segments[one.segment].strain)[one.rows],
                history[one.segment][one.rows],
            )
            for one in found
        ]
    ).reshape(len(found), -1)
