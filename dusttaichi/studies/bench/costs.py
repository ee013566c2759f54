"""What each part of one scene costs: what `dust check FILE --costs` shows."""

from collections.abc import Callable

import yaml

from dusttaichi.errors import DustError
from dusttaichi.physics.contact import registry
from dusttaichi.scene.grains import GrainsScene
from dusttaichi.studies.bench.parts import GRAIN_STEPS, LEAST_STEPS, Part, Variant, measure_pair

ROUNDS = 25
EFFECTS = tuple(kind for kind in registry.EFFECTS if kind not in ("normal", "damping"))
# a stretch is timed, which no stage or end belongs to
PLAIN = {
    "stages": [],
    "stop": {"steps": 1},
    "output": {"series": {"steps": 1000}, "profiles": "off", "contacts": False},
}


def parts_of(scene) -> list[Part]:
    """The parts that a scene has and could do without, each with the scene without it.

    Raises DustError for a scene whose parts are not known.
    """
    if not isinstance(scene, GrainsScene):
        raise DustError(
            f"--costs times scenes of grains; this one is of the method {scene.method}. The step "
            "of the continuum is timed by dust bench --continuum."
        )
    stress = scene.output.stress
    # as it begins, however long it is timed: a wall that goes on would crush the sample
    still = [
        key
        for key in ("wall_speed", "compression_rate", "strain_rate", "face_speed")
        if getattr(scene.boundary, key, None)
    ]
    data = yaml.safe_load(scene.to_yaml())
    data |= {**PLAIN, "output": PLAIN["output"] | {"stress": stress}}
    data["boundary"] = {k: v for k, v in data["boundary"].items() if k not in still}
    data["numerics"]["threads"] = (
        1  # workers that wait for each other are slow where cores are taken
    )
    base = type(scene).from_dict(data)
    full = Variant(base=base)

    def part(name, settings, **built):
        return Part(name, "", full, Variant(settings, built, base=base))

    found = [
        part(name, {f"interaction.{name}": "off"})
        for name in EFFECTS
        if getattr(scene.interaction, name) is not None
    ]
    if scene.interaction.damping.model != "none":
        found.append(part("damping", {"interaction.damping": "none"}))
    if scene.boundary.kind != "open":
        name = "periodic faces" if scene.boundary.kind == "periodic" else "walls"
        name += " and stress" if stress else ""
        found.append(part(name, {"boundary": {"kind": "open"}, "output.stress": False}))
    if stress:
        found.append(part("stress", {"output.stress": False}))
    if scene.push:
        found.append(part("pushes", {"push": []}))
    found.append(part("energy ledger", {}, ledger=False))
    return [*found, Part("noise: the scene with all", "", full, full)]


def cost_rows(scene, grains: int, log: Callable[[str], None] = lambda line: None) -> list[tuple]:
    """Rows (part, share of the step) of a scene of `grains` grains, timed at its start."""
    rows, parts = [], parts_of(scene)
    steps = max(LEAST_STEPS, GRAIN_STEPS // grains)
    for number, part in enumerate(parts, start=1):
        log(f"{number} of {len(parts)}: {part.name}")
        try:
            row = measure_pair(
                part, grains, (None, None), steps=steps, rounds=ROUNDS, per_step=True
            )
        except DustError as error:
            rows.append((part.name, f"not measured: {' '.join(str(error).split())}"))
            continue
        rows.append((part.name, f"{row.share:.1f} ± {100 * row.scatter:.1f} % of a step"))
    return rows
