"""Materials of the grains of a sample: names, numbers, radii and masses."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.physics.contact.constants import mixed_constants, pair_constants, sphere_mass
from dusttaichi.physics.geometry import AXES
from dusttaichi.samples.sample import Sample
from dusttaichi.scene.fields import AnyScene
from dusttaichi.scene.material import DEFAULT


class Materials:
    """The materials of a scene, by number and by name; all in SI.

    Number 0 is the scene's `material`, those of `materials` follow in their order.

    Attributes
    ----------
    all
        The materials in this order.
    names
        Their names.
    interaction
        Block of the scene.
    radius
        Radius of a grain of material 0 [m].
    distance
        Distance between the centres of two such grains in equilibrium contact [m].
    periodic
        True along the periodic axes of the scene, (3,).
    period
        Edges of the cell that the scene prescribes [m], inf along axes without one, (3,).
    cube
        True where the cell has to be a cube around the sample.
    """

    def __init__(self, scene: AnyScene) -> None:
        self.all = scene.all_materials
        self.names = [DEFAULT, *scene.materials]
        self.interaction = scene.interaction
        self.radius = scene.material.radius
        self.distance = 2 * self.radius - pair_constants(scene.material, scene.interaction).delta0
        axes = scene.boundary.periodic_axes
        size = getattr(scene.boundary, "size", "fit") if axes else "fit"
        edges = (size,) * 3 if isinstance(size, str) else size
        self.periodic, self.cube = np.isin(AXES, axes), size == "cube"
        self.period = tuple(
            edge if axis in axes and not isinstance(edge, str) else np.inf
            for axis, edge in zip(AXES, edges, strict=True)
        )

    def numbers(
        self, names_or_numbers: Sequence[Any] | None, grains: int, origin: str
    ) -> np.ndarray:
        """Numbers of the materials (N,) from names or numbers; zeros without any.

        Parameters
        ----------
        names_or_numbers : sequence, optional
            Names or numbers of the materials.
        grains
            Number N of grains.
        origin
            Source of the materials, for errors.

        Returns
        -------
        array
            (N,) of int.

        Raises
        ------
        DustError
            A material is unknown.
        """
        if names_or_numbers is None:
            return np.zeros(grains, np.int32)
        if len(names_or_numbers) != grains:
            raise DustError(
                f"{origin}: there are {len(names_or_numbers)} materials; allowed: {grains}."
            )
        out = [self._number(value, origin) for value in names_or_numbers]
        return np.array(out, np.int32)

    def _number(self, value: Any, origin: str) -> int:
        text = str(value).strip()
        if text in self.names:
            return self.names.index(text)
        if text.isdigit() and int(text) < len(self.names):
            return int(text)
        raise DustError(
            f"{origin}: there is no material {text!r} in the scene; allowed: "
            f"{', '.join(self.names)}, or a number from 0 to {len(self.names) - 1}."
        )

    def radii(
        self,
        radii_of_file: Sequence[float] | NDArray[np.float64] | None,
        numbers: np.ndarray,
        origin: str,
    ) -> np.ndarray:
        """Radii (N,) [m]: those of the file, otherwise those of the materials.

        Parameters
        ----------
        radii_of_file : sequence, optional
            Radii [m].
        numbers
            Numbers of the materials, (N,).
        origin
            Source of the radii, for errors.

        Returns
        -------
        array
            (N,).

        Raises
        ------
        DustError
            The law of rolling is not valid for a radius.
        """
        radii = np.array([material.radius for material in self.all])[numbers]
        if radii_of_file is not None:
            radii = np.array(radii_of_file, dtype=np.float64)
        if radii.shape != numbers.shape:
            raise DustError(f"{origin}: there are {radii.size} radii; allowed: {len(numbers)}.")
        least = np.array([material.critical_rolling for material in self.all])[numbers]
        refused = np.flatnonzero(~(np.isfinite(radii) & (radii > least) & (radii <= 1e-3)))
        if len(refused):
            radius, smallest = float(radii[refused[0]]), float(least[refused[0]])
            hint = " Are lengths in the unit you meant?" if radius > 1e-3 else ""
            raise DustError(
                f"{origin}: radius of grain {refused[0]} (from 0) is {radius * 1e6:g} µm; allowed: "
                f"above critical_rolling of its material ({smallest * 1e9:g} nm), up to 1 mm.{hint}"
            )
        values: NDArray[Any] = radii
        return values

    def polydisperse(self, radii: np.ndarray, numbers: np.ndarray) -> dict[str, Any]:
        """Radii and materials for a Sample; None for both where all grains are of `material`.

        Parameters
        ----------
        radii
            [m], (N,).
        numbers
            (N,).

        Returns
        -------
        dict
            With the keys radii and materials.
        """
        if not numbers.any() and np.allclose(radii, self.radius, rtol=1e-9, atol=0.0):
            return {"radii": None, "materials": None}
        return {"radii": radii, "materials": numbers}

    def radii_of(self, sample: Sample) -> float | NDArray[np.float64]:
        """Radii of the grains of a sample [m]: one number where all are equal, or (N,)."""
        return self.radius if sample.radii is None else sample.radii

    def numbers_of(self, sample: Sample) -> NDArray[np.integer]:
        """Numbers of the materials of the grains of a sample, (N,)."""
        return np.zeros(len(sample), np.int32) if sample.materials is None else sample.materials

    def masses(self, sample: Sample) -> np.ndarray:
        """Masses of the grains of a sample [kg], (N,)."""
        numbers = self.numbers_of(sample)
        radii = np.broadcast_to(self.radii_of(sample), len(sample))
        values: NDArray[Any] = sphere_mass(
            radii, np.array([material.density for material in self.all])[numbers]
        )
        return values

    def equilibrium_distance(
        self,
        radii: Sequence[float] | NDArray[np.float64],
        numbers: Sequence[int] | NDArray[np.integer],
    ) -> float:
        """Distance [m] of two grains in equilibrium contact.

        Parameters
        ----------
        radii : pair
            Radii of the grains [m].
        numbers : pair
            Numbers of their materials.
        """
        first, second = (self.all[n] for n in numbers)
        overlap = mixed_constants(first, radii[0], second, radii[1], self.interaction).delta0
        return float(radii[0] + radii[1] - overlap)
