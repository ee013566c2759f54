"""Response to a velocity gradient over a step: density, pressure, deviator, their work.

Density by rho exp(-tr L dt); pressure by the path of the equation of state; deviator by Jaumann's
rate, dS/dt = 2 mu (D - tr D/3) + W S - S W, pulled back to the strength (von Mises). An elastic
body has no strengths: it remains on its path, and its deviator follows the rate.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.continuum.kernels import tensors
from dusttaichi.continuum.physics.kernels import laws_of, material_type
from dusttaichi.results.roles import ELASTIC


@ti.data_oriented
class Response:
    """fields, lists: see store.place; layout: store.Layout."""

    def __init__(self, fields, lists, layout):
        self.f, self.lists, self.layout, self.n = fields, lists, layout, layout.dimension
        self.laws, self.Material = laws_of(layout.laws), material_type(layout.laws)
        self.columns = range(layout.material_numbers)

    @ti.func
    def material(self, i, first: ti.template()):
        """The numbers of the material of particle i; first: those of the scene's `material`."""
        material = first
        if ti.static(self.layout.materials):
            row = self.f.material[i]
            material = self.Material(*[self.lists.materials[row, n] for n in self.columns])
        return material

    @ti.func
    def respond(self, i, end: ti.template(), dt, numbers: ti.template(), m: ti.template()):
        """The stress of particle i after the step, and its volume over that before.

        Its state is updated. end: gradient of the velocity of the step with respect to the
        positions at its end. With respect to those half way, L = end (1 - dt end/2)^-1, it is a
        pure spin where the body only rotates.
        """
        identity = ti.Matrix.identity(ti.f64, self.n)
        L = end @ (identity - (0.5 * dt) * end).inverse()
        D, W = 0.5 * (L + L.transpose()), 0.5 * (L - L.transpose())
        growth = L.trace()
        pressure_before, S = self.f.pressure[i], tensors.matrix(self.f.deviator[i], self.n)
        density = self.f.density[i] * ti.exp(-growth * dt)
        reference, K = self.f.reference[i], self.f.modulus[i]
        elastic = self.laws.path_pressure(density, reference, K)
        pressure, yields = elastic, self.f.role[i] != ELASTIC
        if yields:
            pressure = self.laws.limited_pressure(density, elastic, m)
            if pressure != elastic:
                reference = self.laws.reference_density(density, pressure, m)
                K = self.laws.bulk_modulus(reference, m)
        mu = self.f.shear_ratio[i] * K
        trial = tensors.rotate(S, dt * W) + (2.0 * mu * dt) * (
            D - numbers.share * growth * identity
        )
        over = 1.0
        if yields:
            Y = self.laws.shear(density / m.rho_s, m)
            over = self.laws.radial(self.laws.second_invariant(trial), Y)
        returned = trial * (over * ti.select(numbers.over_return > 0.5, over, 1.0))
        swollen = self.f.density[i] / density
        power = 0.5 * (1.0 + swollen) * self.f.volume[i] * dt
        self.f.density[i], self.f.reference[i], self.f.pressure[i] = density, reference, pressure
        self.f.deviator[i], self.f.modulus[i] = tensors.rows(returned), K
        self.f.impedance[i] = ti.sqrt((K + 4.0 / 3.0 * mu) * density)
        if ti.static(self.layout.damage):
            undamaged = self.laws.undamaged_fraction(self.f.damage[i])
            pressure_before, S = (
                self.laws.carried_pressure(pressure_before, undamaged),
                undamaged * S,
            )
            self.crack(i, returned, dt, m)
            undamaged = self.laws.undamaged_fraction(self.f.damage[i])
            pressure, returned = (
                self.laws.carried_pressure(pressure, undamaged),
                undamaged * returned,
            )
        pressed = -0.5 * (pressure_before + pressure) * growth * power
        dissipated = ti.Vector(
            [
                ti.select(pressure_before + pressure >= 0.0, pressed, 0.0),
                ti.select(pressure_before + pressure < 0.0, pressed, 0.0),
                0.5 * tensors.double_dot(S + returned, D) * power,
            ]
        )
        self.f.work[i] = self.f.work[i] + dissipated  # `+=` would be an atomic one
        return returned - pressure * identity, swollen

    @ti.func
    def crack(self, i, S: ti.template(), dt, m: ti.template()):
        """Flaws of particle i grow over a step; S: the deviator without damage."""
        weakest, exponent, count = self.f.flaws[i][0], self.f.flaws[i][1], self.f.flaws[i][2]
        K, pressure = self.f.modulus[i], self.f.pressure[i]
        strain = self.laws.tensile_strain(tensors.largest(S) - pressure, K, m)
        active = self.laws.active_flaws(strain, weakest, exponent, count)
        sound = self.f.impedance[i] / self.f.density[i]
        step = m.crack_speed * sound * dt * self.f.flaws[i][3]
        self.f.damage[i] = self.laws.grow_cracks(self.f.damage[i], active, count, step)
