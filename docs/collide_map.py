"""Table of a map of collisions: `python docs/collide_map.py STUDY`.

STUDY is the directory of `dust collide configs/collide_map.yaml`, or of another study over filling
factors, speeds and impact parameters. It prints docs/validation/pages/collide_map.csv: the mean
growth efficiency of the pairs that touched, for each speed by filling factor and by impact
parameter.
"""

import sys

from dusttaichi import analysis

CAPTION = (
    "# `dust collide configs/collide_map.yaml` and `python docs/collide_map.py "
    "runs/collide_map-collisions`; φ: averaged over the area, b: over R1 + R2, mean of the pairs "
    "that touched."
)


def tabulate_growth(data):
    """Rows of the table of a dataset of collisions whose bodies are named phi_VALUE."""
    growth = data.growth_efficiency.isel(mass_ratio=0)
    columns = {
        f"φ {name.removeprefix('phi_')}": growth.sel(body=name).mean(("impact_parameter", "seed"))
        for name in data.body.values
    }
    columns |= {
        f"b {b:.2f}": growth.sel(impact_parameter=b).mean(("body", "seed"))
        for b in data.impact_parameter.values
    }
    for number, speed in enumerate(data.speed.values):
        row = {"speed (m/s)": f"{speed:.3g}"}
        yield row | {name: f"{means.values[number]:.2f}" for name, means in columns.items()}


def main(study):
    """Entry point: print the table of a study as CSV."""
    rows = list(tabulate_growth(analysis.open_collisions(study)[0]))
    print(CAPTION)
    for line in [rows[0], *(row.values() for row in rows)]:
        print(",".join(line))


if __name__ == "__main__":
    main(*sys.argv[1:])
