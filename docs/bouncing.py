"""Tables of bouncing: `python docs/bouncing.py OUT.csv STUDY...`.

STUDY is a directory of `dust collide` with bodies of several numbers of grains, one filling factor
each; the word before the last underscore of a body is its level, such as phi60_n500.

A row for each study, body and speed: pairs, how many of them bounce, stick and grow, filling factor
within the characteristic radius, coefficient of restitution of those that bounce.

`python docs/bouncing.py fit OUT.csv` prints for each level and speed the number of grains per body
at which half of the pairs bounce, and the exponent s of this threshold N ~ v^s, with 68 % intervals
of the profile likelihood, nan where it does not end within the table: a logistic regression,
P = 1/(1 + exp(-b (ln N - t - s ln v))), b >= 0.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr
from tables import main

from dusttaichi.analysis.collisions import FAILED, MISS, compute_mean_and_error
from dusttaichi.scene import extensions

bouncing = extensions.import_extension("oshiro2025/bouncing.py")


def rows(path):
    """Dicts of one study."""
    data = xr.load_dataset(f"{path}/collisions.nc")
    for body in data.body.values:
        for speed in data.speed.values:
            collisions = data.sel(body=body, speed=speed)
            hit = ~collisions.outcome.isin([MISS, FAILED])
            count = {
                name: int((collisions.outcome == name).sum())
                for name in np.unique(collisions.outcome)
            }
            phi = compute_mean_and_error(
                np.append(
                    collisions.target_filling_factor.values,
                    collisions.projectile_filling_factor.values,
                )
            )
            bounced = collisions.restitution.values[collisions.outcome.values == "bouncing"]
            apart = compute_mean_and_error(bounced)
            yield {
                "study": Path(path).name,
                "level": str(body).rpartition("_")[0],
                "grains_per_body": round(float(collisions.grains.mean()) / 2),
                "filling_factor": f"{phi[0]:.4f}",
                "speed_m_per_s": f"{speed:g}",
                "pairs": int(hit.sum()),
                "bouncing": count.get("bouncing", 0),
                "sticking": count.get("sticking", 0),
                "growth": count.get("growth", 0),
                "failed": count.get(FAILED, 0),
                "not_settled": int((collisions.settled == 0).sum()),
                "restitution": f"{apart[0]:.3f}" if len(bounced) else "",
                "residual": f"{float(np.abs(collisions.residual).max()):.1e}",
                "version": data.attrs.get("git_commit", ""),
            }


def fit(path):
    """Print thresholds and exponents of a table."""
    for level, rows_of_level in pd.read_csv(path).groupby("level", sort=False):
        columns = ["grains_per_body", "speed_m_per_s", "pairs", "bouncing"]
        every = rows_of_level[columns].to_numpy(float).T
        every[:2] = np.log(every[:2])
        for speed in np.unique(every[1]):
            points = every[:, every[1] == speed]
            likelihood, middles = bouncing.likelihoods(points, np.zeros(1))
            t, low, high = np.exp(bouncing.interval(middles, likelihood.max(axis=(1, 2))))
            bounced, pairs = points[3].sum(), points[2].sum()
            print(
                f"{level}, {np.exp(speed):g} m/s: {bounced:.0f} of {pairs:.0f} bounce, threshold "
                f"{t:.0f} ({low:.0f} to {high:.0f})"
            )
        if len(np.unique(every[1])) < 2:
            continue
        profile = bouncing.likelihoods(every, bouncing.EXPONENTS)[0].max(axis=(0, 2))
        s, low, high = bouncing.interval(bouncing.EXPONENTS, profile)
        at = np.interp(-4 / 3, bouncing.EXPONENTS, profile) - profile.max()
        print(
            f"{level}: exponent {s:.1f} ({low:.1f} to {high:.1f}), log likelihood of -4/3 {at:.1f}"
        )


if __name__ == "__main__":
    main(rows, fit=fit)
