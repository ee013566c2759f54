"""Tables of compression from all sides: `python docs/compression_law.py OUT.csv RUN...`.

`python docs/compression_law.py factors OUT.csv [BASE LOW HIGH]` prints the pressure of the runs
SWITCH_SEED of a table over that of the runs BASE_SEED, between two filling factors (base, 0.05,
0.13).

A row for each run and tenth of a decade of the filling factor: the mean pressure, its ratio to the
laws of T19 eq 9 and of Tatsuuma et al. 2023, and the share of each channel in what is lost there.
Runs that continue another one (`sample.file`) are rows of their own. The seed is what follows the
last underscore of the name of the run.
"""

from pathlib import Path

import numpy as np
import pandas as pd
from tables import main

from dusttaichi import analysis
from dusttaichi.physics import laws
from dusttaichi.physics.contact.effect_numbers import CHANNELS
from dusttaichi.scene import extensions

TATSUUMA_2023 = extensions.import_extension("tatsuuma2023/compressive_strength.py")

DECADES = 0.1


def rows(path):
    """Dicts of the bins of one run."""
    with analysis.open_run(path) as run:
        compression = analysis.measure_isotropic_compression(run)
        phi, pressure = compression.raw_filling_factor, compression.raw_pressure
        # the stress of a record is the mean since the one before
        phi = np.concatenate([phi[:1], 0.5 * (phi[1:] + phi[:-1])])
        m = run.material
        numbers = m.surface_energy, m.radius, m.critical_rolling
        loss_shares = TATSUUMA_2023.loss_shares(run, decades=DECADES)
        drive = run.scene["stages"][0]["drive"] if run.scene.get("stages") else {}
        about = {
            "run": Path(path).name,
            "grains": run.grains,
            "seed": Path(path).name.rpartition("_")[2],
            "compression_rate": drive.get("compression_rate", ""),
            "version": run.attrs.get("git_commit", ""),
        }
        for n, middle in enumerate(loss_shares.filling_factor):
            low, high = middle * 10 ** (-0.5 * DECADES), middle * 10 ** (0.5 * DECADES)
            inside = (phi >= low) & (phi < high)
            mean = pressure[inside].mean()
            thin = laws.isotropic_pressure(phi[inside], *numbers).mean()
            dense = TATSUUMA_2023.compressive_strength(phi[inside], *numbers).mean()
            yield about | {
                "filling_factor": f"{middle:.4g}",
                "pressure_Pa": f"{mean:.5g}",
                "over_phi3": f"{mean / thin:.4g}",
                "over_2023": f"{mean / dense:.4g}",
                **{f"share_{c}": f"{loss_shares.by_channel[c][n]:.4f}" for c in CHANNELS},
            }


def factors(path, base="base", low=0.05, high=0.13):
    """Print the geometric mean over the bins that two runs of a seed have in common from `low` to
    `high`: mean and standard deviation between the seeds, and their number."""
    table = pd.read_csv(path)
    table = table[table.filling_factor.between(float(low), float(high), inclusive="neither")]
    table[["switch", "seed"]] = table.run.str.removeprefix("sw_").str.rsplit("_", n=1, expand=True)
    keys = ["switch", "seed", "filling_factor"]
    logs = np.log(table.groupby(keys).over_phi3.first()).unstack("switch")
    for switch in table.switch.unique():
        change = (logs[switch] - logs[base]).dropna().groupby("seed").mean()
        spread = f"scatter {change.std():.2f}, {len(change)} seeds"
        print(f"{switch}: {np.exp(change.mean()):.2f}, {spread}")


if __name__ == "__main__":
    main(rows, factors=factors)
