"""Time of the same sample in LAMMPS, for comparison.

LAMMPS runs as a program in a temporary directory, with `units micro`, our internal units (um, us,
pg; nN, kPa).

Equal: JKR with the same E*, gamma, F_c, a0 and equilibrium distance 2 r - delta0; normal damping;
springs of rolling and sliding; limit of rolling without load. Different (LAMMPS 22 Jul 2025): a
contact breaks at the largest pull, F = F_c at an overlap of -0.397 delta0, not at -0.825 delta0;
the limits of rolling, sliding and twisting depend on the load F + 2 F_c; sliding has a coefficient
of friction; twisting has spring and limit from sliding, the spring as 4 G* a^2 (without a factor a
of a torque), in these units 33 times ours for silicate.
"""

import re
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from dusttaichi.errors import DustError
from dusttaichi.physics.contact import constants
from dusttaichi.samples.formats import lammps as program
from dusttaichi.samples.sample import touching_pairs
from dusttaichi.units import DAMPING, DENSITY, LENGTH, PRESSURE, SPEED, STIFFNESS, TIME

FRICTION = 0.3  # coefficient of sliding; S12's zeta_crit without load would be 2.4
SKIN = 0.1  # of the neighbour list [um]
CHECK_EVERY = 10  # steps between checks of the neighbour list; a grain at 1 m/s moves 3 nm in them
ROUNDING = 1e-9  # of the touching distance, far below the overlap delta0

_LOOP = re.compile(r"^Loop time of (\S+) on \d+ procs for (\d+) steps", re.MULTILINE)


def lammps_version() -> str:
    """Version of the installed LAMMPS. Raises DustError without one, or if it does not start."""
    program.lammps_program("this comparison needs it")
    help_text = program.run_lammps(None, "-help")
    match = re.search(r"Simulator - (.+)|LAMMPS \((.+)\)", help_text)
    return next(filter(None, match.groups())).strip() if match else "unknown"


def time_lammps(positions_m, material, modifiers, box_m, **options) -> tuple[float, int]:
    """(seconds of a step, contacts at the end) of a run; all arguments are those of run_lammps.

    Contacts are those of two grains with an overlap >= 0. For a sample at rest LAMMPS is faster,
    since it skips unloaded springs; use the velocities of our own measurement.
    """
    seconds, final = run_lammps(positions_m, material, modifiers, box_m, **options)
    contacts = len(touching_pairs(final, 2 * material.radius * (1 + ROUNDING)))
    return seconds / options["steps"], contacts


def run_lammps(
    positions_m,
    material,
    modifiers: Mapping[str, float],
    box_m,
    *,
    steps: int,
    time_step_s: float,
    threads: int = 1,
    velocities_m_s=0.0,
    kappa: float = 1e-9,
):
    """Run a warm-up of a tenth, then `steps` steps; their wall time [s], positions at the end.

    positions_m: (N, 3) [m]. material: radius, density, surface_energy, young_modulus,
    poisson_ratio, critical_rolling in SI. modifiers: factors on the springs, {"rolling": 8,
    "sliding": 2.5}; one that is missing is 1. box_m: None, or inner edges (Lx, Ly, Lz) [m] of six
    sticking walls at rest, around the sample's middle in x and y, its floor under the lowest
    grain. time_step_s [s]. threads: number of MPI processes. velocities_m_s: (N, 3). kappa: damping
    of the normal motion [kg/s]. Raises DustError if LAMMPS is missing, does not start, or stops
    with an error.
    """
    positions = np.asarray(positions_m, dtype=np.float64) / LENGTH
    velocities = np.broadcast_to(np.asarray(velocities_m_s) / SPEED, positions.shape)
    with tempfile.TemporaryDirectory(prefix="dust-lammps-") as scratch:
        folder = Path(scratch)
        corners = _find_corners(positions, material.radius / LENGTH, box_m)
        _write_data(folder / "grains.data", positions, velocities, material, corners)
        walls = None if box_m is None else corners
        contacts = [contact_style(material, modifiers, kappa, wall) for wall in (False, True)]
        lines = _write_script(contacts, walls, time_step_s, steps)
        (folder / "in.lammps").write_text("\n".join(lines) + "\n")
        output = program.run_lammps(folder, "-in", "in.lammps", threads=threads)
        final = np.loadtxt(folder / "final.dump", skiprows=9, ndmin=2)
    loops = _LOOP.findall(output)  # the first is the warm-up
    if len(loops) != 2 or final.shape != positions.shape:
        raise DustError("LAMMPS lost grains or did not finish its run.")
    return float(loops[1][0]), final * LENGTH


def contact_style(material, modifiers: Mapping[str, float], kappa: float, wall=False) -> str:
    """Arguments of LAMMPS's `granular` contact for two grains, or a grain and a wall (R = r).

    jkr E damping nu gamma: E* and JKR follow from them as ours do; gamma of one surface.
    """
    r, gamma = material.radius, material.surface_energy
    R_pair = constants.reduced_radius(r, r)
    R = r if wall else R_pair
    m_r, m_s = (modifiers.get(effect, 1.0) for effect in ("rolling", "sliding"))
    # Rolling spring k_r = 4 F_c/R, of a pair also at a wall (S12 sect. 2.2).
    k_r = m_r * 4.0 * constants.pull_off_force(gamma, R_pair) / R_pair
    # LAMMPS limits the rolling force to mu (F + 2 F_c): without load that is k_r xi_crit.
    mu_r = k_r * material.critical_rolling / (2 * constants.pull_off_force(gamma, R))
    # Sliding spring per contact radius, 8 G*; NULL would be the same but for the modifier.
    G_star = constants.reduced_shear_modulus(material, "mindlin")
    k_s = m_s * 8.0 * G_star
    return (
        f"jkr {material.young_modulus / PRESSURE:.12g} {kappa / DAMPING:.12g} "
        f"{material.poisson_ratio:.12g} {gamma / STIFFNESS:.12g} damping velocity "
        f"tangential mindlin {k_s / PRESSURE:.12g} 0 {FRICTION:g} "
        f"rolling sds {k_r / STIFFNESS:.12g} 0 {mu_r:.12g} twisting marshall"
    )


def _write_script(contacts, walls, time_step_s, steps) -> list[str]:
    """Lines of the input. contacts: styles of a pair and of a grain at a wall."""
    pair, wall = contacts
    lines = [
        "units micro",
        "atom_style sphere",
        "boundary m m m",
        "newton off",
        "comm_modify vel yes",  # contacts need velocities of grains of other processes
        "read_data grains.data",
        "pair_style granular",
        f"pair_coeff * * {pair}",
        f"neighbor {SKIN:g} bin",  # foreign name
        f"neigh_modify delay 0 every {CHECK_EVERY} check yes",
        "fix move all nve/sphere",
    ]
    if walls is not None:
        lines += [
            f"fix walls_{axis} all wall/gran granular {wall} {axis}plane {low:.17g} {high:.17g}"
            for axis, low, high in zip("xyz", *walls, strict=True)
        ]
    lines += [
        f"timestep {time_step_s / TIME:.12g}",
        f"thermo {10 * steps}",
        f"run {max(steps // 10, 1)} post no",
        f"run {steps} post no",
        "write_dump all custom final.dump x y z modify sort id format float %.17g",
    ]
    return lines


def _find_corners(positions, r, box_m) -> np.ndarray:
    """Low and high corner [um], shape (2, 3), of the inner box, or of a box around the grains."""
    low, high = positions.min(axis=0) - r, positions.max(axis=0) + r
    if box_m is None:
        return np.array([low, high])
    edges = np.asarray(box_m, dtype=np.float64) / LENGTH
    start = np.append((low + high)[:2] / 2 - edges[:2] / 2, low[2])
    return np.array([start, start + edges])


def _write_data(path: Path, positions, velocities, material, corners) -> None:
    diameter, density = 2 * material.radius / LENGTH, material.density / DENSITY
    low, high = corners[0] - diameter, corners[1] + diameter
    with path.open("w") as out:
        out.write(f"a sample of dust\n\n{len(positions)} atoms\n1 atom types\n")
        for axis, start, end in zip("xyz", low, high, strict=True):
            out.write(f"{start:.17g} {end:.17g} {axis}lo {axis}hi\n")
        out.write("\nAtoms # sphere\n\n")
        for number, (x, y, z) in enumerate(positions, 1):
            out.write(f"{number} 1 {diameter:.17g} {density:.17g} {x:.17g} {y:.17g} {z:.17g}\n")
        out.write("\nVelocities\n\n")
        for number, (x, y, z) in enumerate(velocities, 1):
            out.write(f"{number} {x:.17g} {y:.17g} {z:.17g} 0 0 0\n")
