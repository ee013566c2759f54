"""Tables of collisions: `python docs/fragmentation.py OUT.csv STUDY...`.

STUDY is a directory of `dust collide`.

`python docs/fragmentation.py pairs STUDY OTHER...` prints growth efficiencies and tangential losses
of the same pairs in the other studies less those in the first, with the standard error over the
collisions.

A row for each study, body, mass ratio and speed: means over impact parameters and seeds in which
the bodies touched, with standard errors over these collisions. Energies are those of the relative
motion over N E_break, N grains of both bodies, E_break the work that separates two grains from
equilibrium. second_over_projectile: mass of the second largest fragment over that of the
projectile, above 1 where it has taken mass from the target; heavier: in how many collisions it is.
single: share of the mass in single grains. loss_...: shares of the energy of the relative motion;
tangential: rolling, sliding and twisting.
"""

from pathlib import Path

import numpy as np
import xarray as xr
from tables import main

from dusttaichi.analysis.collisions import (
    FAILED,
    MISS,
    compute_mean_and_error,
    fit_fragment_slope,
    select_fragments,
)
from dusttaichi.analysis.thresholds import find_thresholds
from dusttaichi.grains.contact_table import ContactTable
from dusttaichi.physics.contact import jkr
from dusttaichi.physics.contact.effect_numbers import CHANNELS
from dusttaichi.scene import from_yaml

TANGENTIAL = ["rolling", "sliding", "twisting"]
ROUNDING = 1e-9  # of shares of the mass


def breaking_energy(scene):
    """Work [J] that pulls two grains of the scene apart from equilibrium."""
    c = ContactTable(scene).farthest_pair
    s = (1.0 / 6.0) ** (1.0 / 3.0)  # at pull-off
    return 4.0 * c.F_c * c.delta0 * (jkr.energy(s) - jkr.energy(1.0))


def open_study(path):
    """(name, dataset) of a directory."""
    return Path(path).name, xr.load_dataset(f"{path}/collisions.nc")


def tangential_loss(data):
    """Share of the energy of the relative motion that rolling, sliding and twisting dissipate."""
    return data.loss.sel(channel=TANGENTIAL).sum("channel", skipna=False) / data.impact_energy


def rows(path):
    """Dicts of one study."""
    name, data = open_study(path)
    energy = breaking_energy(from_yaml(data.attrs["scene_resolved"]))
    fragment_thresholds = {
        (t.body, t.mass_ratio): t for t in find_thresholds(data) if t.name == "fragment"
    }
    for index in np.ndindex(data.outcome.shape[:3]):
        body, ratio, speed = (data[a].values[n] for a, n in zip(data.dims, index, strict=False))
        data_of_speed = data.isel(body=index[0], mass_ratio=index[1], speed=index[2])
        choice = np.zeros(data.outcome.shape, bool)
        choice[index] = True
        hit = int((~data_of_speed.outcome.isin([MISS, FAILED])).sum())
        growth = compute_mean_and_error(data_of_speed.growth_efficiency.values.ravel())
        second = (data_of_speed.second * (1.0 + data_of_speed.actual_mass_ratio)).values.ravel()
        loss = data_of_speed.loss / data_of_speed.impact_energy
        tangential = compute_mean_and_error(tangential_loss(data_of_speed).values.ravel())
        over = float((data_of_speed.impact_energy / data_of_speed.grains).mean() / energy)
        t = fragment_thresholds[str(body), float(ratio)]
        grains, collisions = select_fragments(data, choice)
        tau = fit_fragment_slope(grains, np.nanmax(data.grains.values[choice], initial=1))
        numbers = np.isin(data.fragment_collision, np.flatnonzero(choice.ravel()))
        single = data.fragment_mass.values[numbers & (data.fragment_grains.values == 1)].sum()
        head_on = compute_mean_and_error(
            data_of_speed.growth_efficiency.isel(impact_parameter=0).values
        )
        yield {
            "study": name,
            "body": body,
            "grains": int(np.nanmean(data_of_speed.grains)),
            "mass_ratio": f"{float(np.nanmean(data_of_speed.actual_mass_ratio)):.4g}",
            "speed_m_per_s": f"{speed:g}",
            "touching": hit,
            "growth_efficiency": f"{growth[0]:.4f}",
            "growth_efficiency_error": f"{growth[1]:.4f}",
            "growth_smallest_impact_parameter": f"{head_on[0]:.4f}",
            "energy_over_breaking": f"{over:.4g}",
            "largest": f"{float(data_of_speed.largest.mean()):.4f}",
            "second_over_projectile": f"{compute_mean_and_error(second)[0]:.4f}",
            "second_over_projectile_error": f"{compute_mean_and_error(second)[1]:.4f}",
            "heavier": int((second > 1.0 + ROUNDING).sum()),
            "fragments": f"{float(data_of_speed.fragments.mean()):.4g}",
            "single": f"{single / hit:.4f}",
            "slope": f"{tau[0]:.3f}",
            "slope_error": f"{tau[1]:.3f}",
            "bouncing": int((data_of_speed.outcome == "bouncing").sum()),
            "not_settled": int((data_of_speed.settled == 0).sum()),
            **{f"loss_{c}": f"{float(loss.sel(channel=c).mean()):.4f}" for c in CHANNELS},
            "loss_tangential": f"{tangential[0]:.4f}",
            "loss_tangential_error": f"{tangential[1]:.4f}",
            "residual": f"{float(np.abs(data_of_speed.residual).max()):.1e}",
            "v_fragment_m_per_s": f"{t.speed:.4g}",
            "v_fragment_low": f"{t.low:.4g}",
            "v_fragment_high": f"{t.high:.4g}",
            "version": data.attrs.get("git_commit", ""),
        }


def pairs(first, *other_paths):
    """Print differences of growth efficiencies and of tangential losses of the same pairs."""
    _, base = open_study(first)
    for path in other_paths:
        name, data = open_study(path)
        growth = (data.growth_efficiency - base.growth_efficiency).squeeze()
        loss = (tangential_loss(data) - tangential_loss(base)).squeeze()
        for speed in [*base.speed.values, None]:
            differences = [x if speed is None else x.sel(speed=speed) for x in (growth, loss)]
            (f, error), (lost, lost_error) = (
                compute_mean_and_error(x.values.ravel()) for x in differences
            )
            speed_text = "all speeds" if speed is None else f"{speed:g} m/s"
            print(
                f"{name}, {speed_text}: {f:+.3f} ± {error:.3f}; loss {lost:+.3f} ± {lost_error:.3f}"
            )


if __name__ == "__main__":
    main(rows, pairs=pairs)
