"""Random sizes and materials of the grains of a generator, and their equilibrium distances.

Distributions are of the number of grains, not of mass: a power law N(r) dr ~ r^exponent dr between
two radii, a lognormal law, or a list of radii with the share of grains of each. Materials have
shares of the grains too. Grains are drawn independently, in the order in which a generator uses
them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from dusttaichi.physics.contact.material_interface import interface
from dusttaichi.samples.materials import Materials
from dusttaichi.samples.sample import ROUNDING, Sample, touching_pairs
from dusttaichi.samples.sample_registry import SampleBlock
from dusttaichi.samples.values import Radius, Seed
from dusttaichi.scene.fields import AnyScene, Block, Faults, Field, Number
from dusttaichi.scene.material import Material

Share = Annotated[float, Number(gt=0)]
SmallestField = Annotated[Radius, Field(description="smallest radius; there are none below it")]
LargestField = Annotated[Radius, Field(description="largest radius; there are none above it")]


class Truncated(Block):
    """A distribution of radii between two bounds."""

    last: ClassVar[tuple[str, ...]] = ("smallest", "largest")

    smallest: SmallestField
    largest: LargestField

    def faults(self) -> Faults:
        if not self.smallest < self.largest:
            yield "largest", "it must be above smallest"

    @property
    def least(self) -> float:
        """Lower bound of the radii [m]."""
        return self.smallest


class PowerLaw(Truncated):
    """N(r) dr ~ r^exponent dr; -3.5 for collisional cascades (Mathis et al. 1977)."""

    kind: Literal["power"]
    exponent: Annotated[float, Number()] = Field(
        description="exponent k of the number of grains, N(r) dr ~ r^k dr, for example -3.5"
    )

    def draw(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """Radii (count,) [m], by the inverse of the cumulative distribution."""
        low, high, k = self.smallest, self.largest, self.exponent + 1.0
        quantiles = rng.random(count)
        if abs(k) < 1e-9:
            return low * (high / low) ** quantiles
        values: NDArray[Any] = low * (1.0 + quantiles * ((high / low) ** k - 1.0)) ** (1.0 / k)
        return values


class Lognormal(Truncated):
    """Normal distribution of ln r about that of the median, with the standard deviation sigma."""

    kind: Literal["lognormal"]
    median: Radius = Field(description="median radius")
    sigma: Annotated[float, Number(gt=0, le=2)] = Field(
        description="standard deviation of ln r", examples=[0.5]
    )

    def faults(self) -> Faults:
        if not self.smallest < self.median < self.largest:
            yield "median", "it must lie between smallest and largest"
        else:
            yield from super().faults()

    def draw(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """Radii (count,) [m]."""
        radii = np.zeros(count)
        pending = np.arange(count)
        while len(pending):
            radii[pending] = self.median * np.exp(self.sigma * rng.standard_normal(len(pending)))
            pending = pending[(radii[pending] < self.smallest) | (radii[pending] > self.largest)]
        return radii


class Radii(Block):
    """Discrete radii, each with its share of the grains."""

    kind: Literal["list"]
    radii: tuple[Radius, ...] = Field(
        description="radii of the grains", examples=[["0.3 um", "0.6 um"]]
    )
    shares: tuple[Share, ...] | None = Field(
        None,
        description="number of grains of each, in any unit; by default equal numbers",
        examples=[[3, 1]],
    )

    def faults(self) -> Faults:
        if not self.radii:
            yield "radii", "at least one radius is needed"
        elif self.shares is not None and len(self.shares) != len(self.radii):
            text = f"as many as radii are needed, {len(self.radii)} and not {len(self.shares)}"
            yield "shares", text

    @property
    def least(self) -> float:
        """Lower bound of the radii [m]."""
        return min(self.radii)

    def draw(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """Radii (count,) [m]."""
        weights = np.ones(len(self.radii)) if self.shares is None else np.array(self.shares)
        return rng.choice(np.array(self.radii), size=count, p=weights / weights.sum())


def place_grains(
    positions: NDArray[np.float64], grains: "Grains", materials: Materials, info: dict[str, Any]
) -> Sample:
    """Place Grains at rest at these centres (N, 3) [m]; info: of the Sample."""
    if isinstance(grains, EqualGrains):
        return Sample.at_rest(
            positions, info | {"equilibrium_distance": float(grains.distance(0, 0))}
        )
    unequal = materials.polydisperse(grains.radii, grains.numbers)
    info = info | {
        "smallest_radius": float(grains.radii.min()),
        "largest_radius": float(grains.radii.max()),
    }
    return replace(Sample.at_rest(positions, info), **unequal)


Sizes = Annotated[PowerLaw | Lognormal | Radii, Field(discriminator="kind")]


LOGNORMAL = {
    "kind": "lognormal",
    "median": "0.6 um",
    "sigma": 0.5,
    "smallest": "0.2 um",
    "largest": "1.8 um",
}  #: An example of sizes.


class MixtureBlock(SampleBlock):
    """The block of a kind with random sizes and materials of its grains."""

    last: ClassVar[tuple[str, ...]] = ("sizes", "shares", "seed")

    sizes: Sizes | None = Field(
        None,
        description="sizes of the grains, by a law or a list; by default all have the radius of "
        "their material",
        examples=[LOGNORMAL],
    )
    shares: dict[str, Share] | None = Field(
        None,
        description="materials of the grains and the number of grains of each, in any unit, such "
        "as {default: 3, ice: 1}; by default all are of `material`",
    )
    seed: Seed = Field(1, description="seed of the random numbers")

    def conflicts(self, scene: AnyScene) -> Faults:
        for name in self.shares or ():
            if name not in scene.material_names:
                text = f"the scene does not have it; allowed: {', '.join(scene.material_names)}"
                yield f"shares.{name}", text
                return


@dataclass(frozen=True)
class Grains:
    """Radii (N,) [m] and numbers of the materials (N,) of grains in the order of the draws.

    touch: Touch of the scene.
    """

    radii: np.ndarray
    numbers: np.ndarray
    touch: "Touch"

    def __len__(self) -> int:
        return len(self.radii)

    def distance(self, i: Any, j: Any) -> Any:
        """Distance [m] of the grains i and j in equilibrium contact; arrays broadcast."""
        return self.touch.distance(
            (self.radii[i], self.numbers[i]), (self.radii[j], self.numbers[j])
        )

    def volume(self) -> float:
        """Volume of all grains [m^3]."""
        return float(np.sum(4 / 3 * np.pi * self.radii**3))

    def touching(self, positions: NDArray[np.float64], period: Any = None) -> np.ndarray:
        """Pairs i < j that touch at these centres (N, 3) [m], to rounding, (C, 2) int.

        period: edges (3,) [m] of a periodic cell; None: no images.
        """
        pairs = touching_pairs(positions, 2.0 * float(self.radii.max(initial=0.0)), period)
        apart = positions[pairs[:, 0]] - positions[pairs[:, 1]]
        if period is not None:
            apart -= period * np.round(apart / period)
        apart = np.linalg.norm(apart, axis=1)
        values: NDArray[Any] = pairs[apart <= self.distance(*pairs.T) * (1 + ROUNDING)]
        return values

    def select(self, which: Any) -> "Grains":
        """Select the grains with these indices."""
        return replace(self, radii=self.radii[which], numbers=self.numbers[which])

    def join(self, appended: "Sequence[Grains]") -> "Grains":
        """Join these grains and the appended ones, in this order."""
        groups = (self, *appended)
        radii = np.concatenate([grains.radii for grains in groups])
        return replace(self, radii=radii, numbers=np.concatenate([g.numbers for g in groups]))


class EqualGrains(Grains):
    """Grains of the scene's `material` and radius; touch: distance of their centres [m]."""

    def distance(self, i: Any, j: Any) -> Any:
        return self.touch

    def volume(self) -> float:
        return len(self) * (4 / 3 * np.pi * float(self.radii[0]) ** 3)


class Touch:
    """Equilibrium distances of two grains of any radii and materials of a scene.

    delta0 = a0^2/(3 R) with a0 = (9 pi gamma R^2/E*)^(1/3) is c R^(1/3), with a constant c for each
    pair of materials.
    """

    def __init__(self, materials: Materials) -> None:
        def factor(a: Material, b: Material) -> float:
            face = interface(a, b, materials.interaction)
            number: float = (9.0 * np.pi * face.gamma / face.E_star) ** (2.0 / 3.0) / 3.0
            return number

        self.factors = np.array([[factor(a, b) for b in materials.all] for a in materials.all])

    def distance(self, first: tuple[Any, Any], second: tuple[Any, Any]) -> Any:
        """Distance of centres [m]; first, second: (radii [m], numbers of the materials)."""
        (r1, n1), (r2, n2) = first, second
        reduced = r1 * r2 / (r1 + r2)
        return r1 + r2 - self.factors[n1, n2] * np.cbrt(reduced)


class Crowd:
    """Source of any number of grains for a block: equal ones, or of its sizes and shares.

    radius: of the mean volume [m]; smallest: lower bound of the radii [m]; largest: of ten thousand
    grains [m]. distance: of the centres of two in contact [m], approximate for unequal ones.
    overlap: of two of the mean volume at rest [m].
    """

    def __init__(self, spec: Any, materials: Materials, rng: np.random.Generator) -> None:
        self._spec, self._materials = spec, materials
        self.equal = not is_mixture(spec)
        self.radius = self.smallest = self.largest = materials.radius
        self.distance = materials.distance
        self.overlap = 2 * self.radius - self.distance
        if self.equal:
            return
        radii = draw_grains(spec, materials, 10_000, rng).radii
        self.radius = float(np.mean(radii**3) ** (1 / 3))
        self.distance = 2.0 * self.radius
        touch = Touch(materials)
        self.overlap = float(touch.factors.min() * np.cbrt(self.radius / 2.0))
        self.largest = float(radii.max())
        self.smallest = radii.min() if spec.sizes is None else spec.sizes.least

    def draw(self, count: int, rng: np.random.Generator) -> Grains:
        """The next `count` grains; equal ones need no random numbers."""
        if not self.equal:
            return draw_grains(self._spec, self._materials, count, rng)
        radii, numbers = np.full(count, self.radius), np.zeros(count, np.int32)
        return EqualGrains(radii, numbers, self.distance)

    def least(self, grains: Grains) -> np.ndarray:
        """Smallest distance [m], (N,), of the centre of each from that of a grain in contact."""
        values: NDArray[Any] = self._compute_contact_distances(grains, self.smallest).min(axis=0)
        return values

    def most(self, grains: Grains, largest: float) -> np.ndarray:
        """Largest distance [m], (N,), of the same, for grains up to a radius [m]."""
        values: NDArray[Any] = self._compute_contact_distances(grains, largest).max(axis=0)
        return values

    def _compute_contact_distances(self, grains: Grains, radius: float) -> NDArray[np.float64]:
        if self.equal:
            return np.full((1, len(grains)), self.distance)
        material_numbers = np.arange(len(self._materials.all))[:, None]
        values: NDArray[np.float64] = grains.touch.distance(
            (grains.radii, grains.numbers), (radius, material_numbers)
        )
        return values


def is_mixture(spec: Any) -> bool:
    """True for a block of unequal grains."""
    return any(getattr(spec, name, None) is not None for name in ("sizes", "shares"))


def draw_grains(spec: Any, materials: Materials, count: int, rng: np.random.Generator) -> Grains:
    """Draw `count` random Grains of a block, sizes first, then materials."""
    shares_by_material = spec.shares or {"default": 1.0}
    names = [materials.numbers([name], 1, "sample.shares")[0] for name in shares_by_material]
    radii = None if spec.sizes is None else spec.sizes.draw(rng, count)
    weights = np.array(list(shares_by_material.values()))
    numbers = rng.choice(np.array(names), size=count, p=weights / weights.sum())
    numbers = numbers.astype(np.int32)
    return Grains(materials.radii(radii, numbers, "sample.sizes"), numbers, Touch(materials))
