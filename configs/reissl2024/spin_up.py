"""Numbers and figure of an aggregate that is spun up in open space until it breaks.

Named by the scenes in this folder under `extensions`; after Reissl et al. 2024, A&A 692, A60.
"""

from dataclasses import dataclass

import numpy as np

from dusttaichi import plots
from dusttaichi.analysis import count_frames, numbers, read_frame, read_grain_masses
from dusttaichi.analysis.fragments import find_frame_fragments
from dusttaichi.analysis.numbers.number_registry import Family, Observable, quiet, strength_by_law
from dusttaichi.analysis.tensile import compute_strength_law
from dusttaichi.errors import DustError
from dusttaichi.plots import style

INTACT = 0.9  #: Share of the mass in the largest fragment below which the aggregate is broken.


@dataclass(frozen=True)
class SpinUp:
    """Rotation of an aggregate, snapshot by snapshot.

    rate [rad/s] (snapshots,): |L|/I of all grains about their centre of mass, with the moment of
    inertia about L, spins and the grains' own moments included. rigid_rate [rad/s] (snapshots,):
    that of a rigid body, |L| over the moment of inertia of the first snapshot. largest_share
    (snapshots,): of the mass in the largest fragment. stress [Pa] (snapshots,): rho R^2 rate^2 / 4,
    the mean over a plane through the axis of a uniform sphere of the same mass (half of it pulls
    with pi rho R^4 omega^2 / 4), with R = sqrt(5/3) R_g of the first snapshot. filling_factor: of
    that sphere. law [Pa]: tensile strength at it by T19 eq 33, NaN for an unknown material. top:
    number of the snapshot with the largest rate while it is whole. broken: number of the first in
    which it is not, None where it has not broken.
    """

    rate: np.ndarray
    rigid_rate: np.ndarray
    largest_share: np.ndarray
    stress: np.ndarray
    filling_factor: float
    law: float
    top: int
    broken: int | None

    @property
    def count_shown(self):
        """Number of snapshots up to the first of the broken aggregate."""
        return len(self.rate) if self.broken is None else self.broken + 1


def is_spun(run):
    """True of a Run in open space in which some push is a spin."""
    if run.boundary != "open":
        return False
    drives = [stage.get("drive") or {} for stage in run.scene.get("stages") or ()]
    pushes = [run.scene.get("push") or (), *(drive.get("push") or () for drive in drives)]
    return any(push.get("spin") is not None for entries in pushes for push in entries)


def measure_spin_up(run):
    """Rotation of a run whose aggregate is spun up until it breaks.

    Raises DustError where the snapshots contain no contacts, or the first of them is no single
    aggregate.
    """
    masses = read_grain_masses(run)
    frames = [read_frame(run, number) for number in range(count_frames(run))]
    fragments = [find_frame_fragments(frame, masses) for frame in frames]
    largest_share = np.array([sizes.mass[0] / masses.sum() for sizes in fragments])
    if largest_share[0] < INTACT:
        raise DustError(
            f"{run.path}: the largest fragment has {largest_share[0]:.0%} of the mass at the "
            f"start; an aggregate that is spun up must be one piece (at least {INTACT:.0%})."
        )
    momentum, inertia = np.array([_measure_rotation(frame, masses) for frame in frames]).T
    rate = momentum / inertia
    first = fragments[0]
    radius, phi = float(first.characteristic_radius[0]), float(first.filling_factor[0])
    density = masses.sum() / (4.0 / 3.0 * np.pi * radius**3)
    broken = np.flatnonzero(largest_share < INTACT)
    broken = int(broken[0]) if len(broken) else None
    return SpinUp(
        rate,
        momentum / inertia[np.argmax(momentum > 0.0)],
        largest_share,
        0.25 * density * radius**2 * rate**2,
        phi,
        compute_strength_law(run, phi),
        int(np.argmax(rate[:broken])),
        broken,
    )


def _measure_rotation(frame, masses):
    """Angular momentum and moment of inertia of all grains of a Frame about their centre of mass.

    In kg m^2/s and kg m^2, the latter about the angular momentum; about z without one.
    """
    m = masses[:, None]
    x = frame.position - (m * frame.position).sum(axis=0) / masses.sum()
    v = frame.velocity - (m * frame.velocity).sum(axis=0) / masses.sum()
    inertia = 0.4 * masses * frame.radius**2
    momentum = (m * np.cross(x, v) + inertia[:, None] * frame.spin).sum(axis=0)
    size = float(np.linalg.norm(momentum))
    along = x @ (momentum / size if size > 0.0 else np.array([0.0, 0.0, 1.0]))
    return size, float(np.sum(masses * (np.sum(x**2, axis=1) - along**2) + inertia))


def _format_rate(value, n):
    text = f"{value:.3g} rad/s"
    intact = f"{INTACT:.0%} of the mass in one fragment"
    return text if n["spin_broken"] else f"at least {text}: still {intact}"


SPIN_UP = Family(
    name="spin_up",
    title="an aggregate that is spun up",
    order=85,
    applies=is_spun,
    measure=measure_spin_up,
    numbers=(
        Observable(name="spin_rate", title="largest rotation rate", unit="rad/s", text=_format_rate,
                   value=lambda spin: float(spin.rate[spin.top]),
                   about="largest rotation rate in a snapshot before the largest fragment has less "
                   f"than {INTACT:.0%} of the mass", column=("largest rad/s", "{:.3g}", 1),
                   figure="spin_up"),
        Observable(name="spin_stress", title="… stress across a plane through the axis", unit="Pa",
                   value=lambda spin: float(spin.stress[spin.top]),
                   literature=strength_by_law("spin_law", "tensile strength, "),
                   about="rho R^2 omega^2 / 4 at that rate",
                   column=("spin stress kPa", "{:.3g}", 1e3), trade_rank=2, figure="spin_up"),
        quiet("spin_phi", "filling factor of the sphere with the aggregate's radius of gyration",
              value="filling_factor",
              column=("phi of sphere", "{:.3g}", 1)),
        quiet("spin_broken", "the aggregate has broken", "",
              value=lambda spin: spin.broken is not None, column=("broken", "{!s}", 1)),
        quiet("spin_law", "tensile strength at that filling factor by T19 eq 33", "Pa",
              value="law"),
    ),
)  # fmt: skip
numbers.register(SPIN_UP)


@plots.figure("Spin-up", 116, name="spin_up", applies=is_spun, together=True)
def draw_spin_up(runs, labels=None):
    """Rotation rate and largest fragment of one run or several.

    The rate is drawn against that of a rigid body with the same angular momentum, which is the
    dotted line; the dashed line is the share below which an aggregate counts as broken. Curves end
    with the first snapshot of the broken aggregate.
    """
    runs, labels = style.label_runs(runs, labels)
    figure, (axes, below) = style.create_figure(height=4.6, rows=2)
    spins = [measure_spin_up(run) for run in runs]
    for number, (spin, label) in enumerate(zip(spins, labels, strict=True)):
        look = style.run_style(number)
        values = (spin.rigid_rate, spin.rate, spin.largest_share)
        rigid_rate, rate, share = (value[: spin.count_shown] for value in values)
        axes.plot(rigid_rate / 1e6, rate / 1e6, label=label, **look)
        below.plot(rigid_rate / 1e6, share, **look)
    largest = max(float(spin.rigid_rate[: spin.count_shown].max()) for spin in spins) / 1e6
    rigid = [0.0, largest]
    axes.plot(rigid, rigid, **style.line_look(style.GREY, 1.0, style.DOTTED))
    below.axhline(INTACT, **style.line_look(style.GREY, 1.0, style.DASHED))
    below.set_ylim(0.0, 1.05)
    below.set_xlabel(r"$L/I_0$ ($10^6$ rad/s)")
    axes.set_ylabel(r"rotation rate ($10^6$ rad/s)")
    below.set_ylabel("share of the mass\nin the largest fragment")
    style.draw_legend(axes)
    return figure


plots.register(draw_spin_up)
