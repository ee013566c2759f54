"""From the result files of a plan to its dataset."""

import xarray as xr

from dusttaichi import analysis
from dusttaichi.analysis.ensemble import gather


def gather_plan(plan, results):
    """The dataset of `analysis.gather` for a Plan whose runs ended with these JobResults.

    Runs that failed are not a number in it. Raises DustError where all did.
    """
    runs = [
        _read(member.directory) if result.code == 0 else None
        for member, result in zip(plan.members, results, strict=True)
    ]
    labels = {
        name: [member.seeds[name] for member in plan.members] for name in plan.members[0].seeds
    }
    labels["status"] = [
        result.text if run is None else run.status
        for run, result in zip(runs, results, strict=True)
    ]
    labels["directory"] = [member.label for member in plan.members]
    axes = {axis.dimension: _variable(axis) for axis in plan.axes}
    scene = plan.scene
    attrs = {
        "title": scene.name,
        # as lists: a plain text is limited to 64 kB
        "scene_given": [scene.source],
        "scene_resolved": [scene.to_yaml()],
    }
    data = gather(runs, axes, labels, attrs)
    for name in plan.members[0].seeds:
        data[name].attrs["long_name"] = f"sample.{name.replace('_', '.')} of the run"
    data["directory"].attrs["long_name"] = "directory of the run, from that of this file"
    data["status"].attrs["long_name"] = "how the run ended"
    return data


def _read(directory):
    with analysis.open_run(directory) as run:
        return run  # its series stays in memory


def _variable(axis):
    attrs = {"long_name": f"{axis.key} of the scene", "key": axis.key}
    if axis.coordinate.dtype.kind in "fi":
        attrs["units"] = axis.unit or "1"
    return xr.Variable((axis.dimension,), axis.coordinate, attrs)
