"""`dust check` and `dust schema`: what a scene says, before it is run."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from dusttaichi.commands.console import console, remark, say
from dusttaichi.commands.options import SceneFile, load_scene


def check(
    file: SceneFile,
    costs: Annotated[
        bool, typer.Option("--costs", help="time the scene with each of its parts left out")
    ] = False,
):
    """Check a YAML file and print the scene resolved: constants, step, size, cost, parts."""
    from dusttaichi.grains.preview import report

    scene = load_scene(file)
    console.print(scene.to_yaml().rstrip())
    sections, grains = report(scene)
    for title, rows in [*sections, ("Cost of the parts", _part_costs(scene, grains, costs))]:
        console.print(f"\n{title}", style="bold")
        for what, value in rows:
            say(f"  {what:<42} {value}")


def _part_costs(scene, grains, costs):
    if not costs:
        return [("not measured", "with --costs, for this scene; in general by dust bench --parts")]
    from dusttaichi.studies.bench.costs import cost_rows

    return cost_rows(scene, grains, remark)


def schema(
    file: Annotated[
        Path | None, typer.Argument(help="YAML file whose extensions count", metavar="[FILE]")
    ] = None,
):
    """Print the JSON Schema of the YAML, for editors that complete and check it."""
    from dusttaichi.scene import load_extensions, schema_text

    if file is not None:
        load_extensions(file)
    sys.stdout.write(schema_text())
