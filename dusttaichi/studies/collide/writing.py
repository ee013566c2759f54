"""From the rows of a study to its files: dataset, table, figures."""

from dusttaichi import files
from dusttaichi.analysis.collisions import collisions_dataset, table_text
from dusttaichi.analysis.ensemble import save_ensemble
from dusttaichi.analysis.thresholds import threshold_text, thresholds
from dusttaichi.results import provenance


def write(study, rows, *, figures=True):
    """Write collisions.nc, collisions.csv and, where wanted, the figures of a Study.

    Returns the dataset, its thresholds and the paths. Raises DustError where writing fails.
    """
    scene = study.source
    attrs = provenance(scene.source, scene.to_yaml(), title=scene.name, by_area=int(study.by_area))
    data = collisions_dataset(rows, study.axes, {k: v for k, v in attrs.items() if v is not None})
    found = thresholds(data)
    save_ensemble(data, study.file)
    paths = [study.file, study.file.with_suffix(".csv")]
    files.write_whole(paths[1], table_text(data).encode())
    paths.append(study.directory / "thresholds.csv")
    files.write_whole(paths[2], threshold_text(found).encode())
    if figures:
        paths += _draw(data, found, study.directory)
    return data, found, paths


def _draw(data, found, directory):
    from dusttaichi import plots

    drawn = {"outcomes": plots.outcome_map(data)}
    if data.sizes["mass_ratio"] > 1:
        drawn["outcomes_mass_ratio"] = plots.outcome_map(data, "mass_ratio")
    if data.sizes["body"] > 1:
        drawn["thresholds"] = plots.threshold_speeds(data, found)
    drawn |= {"growth": plots.growth(data), "spectrum": plots.fragment_spectrum(data)}
    drawn["phases"] = plots.phases(data)
    there = {name: figure for name, figure in drawn.items() if figure is not None}
    return [plots.save(figure, directory / f"{name}.png") for name, figure in there.items()]
