"""Bodies of the continuum before the first step, as particles."""

from dataclasses import dataclass, field, replace

import numpy as np

from dusttaichi.results.roles import DUST, FIXED

COMPONENTS = ("xx", "yy", "zz", "xy", "xz", "yz")  # of a symmetric tensor, in this order


@dataclass(frozen=True)
class Body:
    """A body as a whole at the start [SI]; in two dimensions per metre of depth.

    mass [kg, or kg/m]; centre [m], velocity [m/s], spin [rad/s]: (3,). inertia (3, 3) about the
    centre [kg m^2, or kg m]. size: its largest diameter [m]. shape: "sphere" ..., for closed forms;
    radius, half_height [m]: of a rigid one, half_height 0 of a sphere.
    """

    name: str
    rigid: bool
    mass: float
    centre: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    inertia: np.ndarray
    size: float
    shape: str = ""
    elastic: bool = False
    radius: float = 0.0
    half_height: float = 0.0

    def displace(self, shift, velocity, spin) -> "Body":
        """The displaced body, with velocity and spin added to its own (each (3,))."""
        return replace(
            self,
            centre=self.centre + shift,
            velocity=self.velocity + velocity,
            spin=self.spin + spin,
        )


@dataclass
class Particles:
    """N particles of one spacing, all in SI; in two dimensions the plane is x-z and y = 0.

    position [m], velocity [m/s]: (N, 3). mass (N,) [kg, in two dimensions kg per metre of depth].
    density (N,) [kg/m^3]; reference (N,): the density without pressure on its elastic path
    [kg/m^3]. deviator (N, 6) [Pa], in the order of COMPONENTS. modulus (N,) [Pa], shear_ratio (N,):
    bulk modulus and shear modulus over it of elastic bodies, NaN for others. role (N,) int8: DUST
    ...; material (N,) int8: number of the material of dust in the scene; body (N,) int32: number in
    `bodies`, -1 of a wall; face (N,) int8: number in geometry.WALLS of the face that moves the
    particle, or -1. room (3, 2) [m]: positions of its faces, NaN where there is none. info: plain
    numbers and texts that describe it.
    """

    position: np.ndarray
    mass: np.ndarray
    density: np.ndarray
    spacing: float
    dimension: int
    velocity: np.ndarray = None
    reference: np.ndarray = None
    deviator: np.ndarray = None
    modulus: np.ndarray = None
    shear_ratio: np.ndarray = None
    role: np.ndarray = None
    material: np.ndarray = None
    body: np.ndarray = None
    face: np.ndarray = None
    room: np.ndarray = None
    bodies: tuple[Body, ...] = ()
    info: dict = field(default_factory=dict)

    def __post_init__(self):
        n = len(self.position)
        defaults = {
            "velocity": lambda: np.zeros((n, 3)),
            "reference": lambda: np.array(self.density, dtype=np.float64),
            "deviator": lambda: np.zeros((n, 6)),
            "modulus": lambda: np.full(n, np.nan),
            "shear_ratio": lambda: np.full(n, np.nan),
            "role": lambda: np.full(n, DUST, np.int8),
            "material": lambda: np.zeros(n, np.int8),
            "body": lambda: np.zeros(n, np.int32),
            "face": lambda: np.full(n, -1, np.int8),
            "room": lambda: np.full((3, 2), np.nan),
        }
        for name, make in defaults.items():
            if getattr(self, name) is None:
                setattr(self, name, make())

    def __len__(self) -> int:
        return len(self.position)

    @property
    def volume(self) -> np.ndarray:
        """Volumes (N,) [m^3, in two dimensions m^2]."""
        return self.mass / self.density

    @property
    def is_dust(self) -> np.ndarray:
        """True for particles of dust, fixed or not, (N,) bool."""
        return np.isin(self.role, (DUST, FIXED))

    @property
    def axes(self) -> tuple[int, ...]:
        """Numbers of the axes along which particles can move."""
        return (0, 2) if self.dimension == 2 else (0, 1, 2)

    def fill_room(self, size) -> None:
        """Set `room` to a box of these edges [m], (2,) or (3,), about the origin."""
        for axis, edge in zip(self.axes, size, strict=True):
            self.room[axis] = (-edge / 2, edge / 2)


ARRAYS = (
    "position", "velocity", "mass", "density", "reference", "deviator", "modulus", "shear_ratio",
    "role", "material", "face",
)  # fmt: skip


def join_bodies(bodies: list[Particles]) -> Particles:
    """Several bodies as one sample, numbered consecutively."""
    first = bodies[0]
    together = {name: np.concatenate([getattr(p, name) for p in bodies]) for name in ARRAYS}
    numbers, count = [], 0
    for particles in bodies:
        numbers.append(np.where(particles.body < 0, -1, particles.body + count))
        count += len(particles.bodies)
    remarks = [text for particles in bodies for text in particles.info.pop("remarks", ())]
    return Particles(
        **together,
        body=np.concatenate(numbers).astype(np.int32),
        spacing=first.spacing,
        dimension=first.dimension,
        bodies=tuple(body for particles in bodies for body in particles.bodies),
        info={"bodies": [particles.info for particles in bodies]}
        | ({"remarks": remarks} if remarks else {}),
    )


def displace(particles: Particles, shift=0.0, velocity=0.0, spin=0.0) -> Particles:
    """The displaced sample, with motion and rotation about its centre of mass.

    shift [m], velocity [m/s], spin [rad/s]: (3,) each, added to its own.
    """
    shift, velocity, spin = (np.zeros(3) + v for v in (shift, velocity, spin))
    centre = np.average(particles.position, axis=0, weights=particles.mass)
    turning = np.cross(spin, particles.position - centre)
    moved_bodies = [
        body.displace(shift, velocity + np.cross(spin, body.centre - centre), spin)
        for body in particles.bodies
    ]
    return replace(
        particles,
        position=particles.position + shift,
        velocity=particles.velocity + velocity + turning,
        room=particles.room + shift[:, None],
        bodies=tuple(moved_bodies),
    )
