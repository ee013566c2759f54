"""The cells of each group of the map."""

from itertools import product

from dusttaichi.studies.extremes.cell import Cell

BASE = {
    "name": "extremes",
    "material": "silicate_s12",
    "interaction": {"rolling": {"modifier": 8}, "sliding": {"modifier": 2.5}, "damping": "viscous"},
    "sample": {"kind": "explicit", "positions": [["0 m", "0 m", "0 m"]]},
    "boundary": {"kind": "open"},
    "stop": {"steps": 1},
    "numerics": {"threads": 1},
}
BOTTOM = {"kind": "box", "omit": ["x_min", "x_max", "y_min", "y_max", "top"]}
PERIODIC = {"kind": "periodic"}


def scene(**blocks):
    """The blocks of BASE with some in their place; `numerics` is added to."""
    own = {**BASE, **blocks}
    own["numerics"] = {**BASE["numerics"], **blocks.get("numerics", {})}
    return own


FRACTIONS = (0.01, 0.03, 0.1, 0.2, 0.25, 0.28, 0.3, 0.31, 0.33, 0.36, 0.4, 0.5, 0.7, 1.0, 1.2)
FEW_FRACTIONS = (0.01, 0.2, 0.3, 0.33, 0.5, 1.2)


def time_step(quick):
    """Steps from a hundredth of the stiffest period of what is there to beyond it."""
    things = {
        "pair": ({"kind": "chain", "grains": 2}, {"kind": "open"}, 20_000),
        "wall": ({"kind": "given", "positions": [[0, 0, 0]]}, BOTTOM, 20_000),
        "RBD cake": ({"kind": "cake", "grains": 200}, {"kind": "open"}, 4_000),
        "compacted cake": ({"kind": "compacted"}, {"kind": "open"}, 4_000),
    }
    cells = []
    for name, (sample, boundary, steps) in things.items():
        for damping in ("none",) if quick else ("none", "viscoelastic"):
            own = scene(boundary=boundary,
                        interaction={**BASE["interaction"], "damping": damping})  # fmt: skip
            for n, fraction in enumerate(FEW_FRACTIONS if quick else FRACTIONS):
                cells.append(Cell(
                    "time step", f"{name}, damping {damping}, {fraction:g}", own,
                    {**sample, "speed": 0.005, "spin": 5e3}, steps if not quick else steps // 4,
                    fraction=fraction, limit=n == 0,
                    coordinates={"row": f"{name}, {damping}", "column": fraction},
                ))  # fmt: skip
    return cells


CORNERS = {
    "gamma": ("1e-4 J/m^2", "1 J/m^2"),
    "E": ("1e6 Pa", "1e12 Pa"),
    "r": ("10 nm", "1 mm"),
    "rho": ("100 kg/m^3", "2e4 kg/m^3"),
    "xi_crit": ("0.01 nm", "1 um"),
    "nu": (0, 0.49),
}
KEYS = ("surface_energy", "young_modulus", "radius", "density", "critical_rolling",
        "poisson_ratio")  # fmt: skip
MIDDLE = ("20 mJ/m^2", "54 GPa", "0.6 um", "2.65 g/cm^3", "2 nm", 0.17)


def materials(quick):
    """All corners of the six numbers: a pair that meets, and a few grains on a wall."""
    cells = []
    for values in list(product(*CORNERS.values()))[:: 13 if quick else 1]:
        place = [", ".join(f"{k} {v}" for k, v in some) for some in _halves(values)]
        cells += _of_material(values, "materials", ", ".join(place), *place)
    return sorted(cells, key=lambda cell: cell.alike)


def single_materials(quick):
    """Each of the six numbers at its ends, the others those of silicate."""
    cells = []
    for n, (key, ends) in enumerate(CORNERS.items()):
        for end in ends[1 if quick else 0 :]:
            values = (*MIDDLE[:n], end, *MIDDLE[n + 1 :])
            name = f"{key} {end}"
            cells += _of_material(values, "one number", name, "", name)
    for damping in ("viscoelastic", "viscous", "scaled"):
        own = scene(material=dict(zip(KEYS, (*MIDDLE[:5], 0), strict=True)),
                    interaction={"damping": damping})  # fmt: skip
        cells.append(Cell("one number", f"nu 0, {damping}", own,
                          {"kind": "meeting", "sticking": 0.7}, 2_000, alike=damping,
                          coordinates={"row": "pair", "column": f"nu 0, {damping}"}))  # fmt: skip
    return sorted(cells, key=lambda cell: cell.alike)


def _halves(values):
    named = list(zip(CORNERS, values, strict=True))
    return named[:3], named[3:]


def _of_material(values, group, name, row, column):
    material = dict(zip(KEYS, values, strict=True))
    cells = []
    for what, boundary, sample in (
        ("pair", {"kind": "open"}, {"kind": "meeting", "sticking": 0.7}),
        ("wall", BOTTOM, {"kind": "cluster", "grains": 4}),
    ):
        own = scene(material=material, boundary=boundary, interaction={"damping": "none"})
        place = {"row": f"{what}: {row}".rstrip(": "), "column": column}
        cells.append(Cell(group, f"{what}, {name}", own, sample, 2_000, limit=what == "wall",
                          coordinates=place, alike=what))  # fmt: skip
    return cells


SPEEDS = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0)


def wall_speeds(quick):
    """A cake pressed at speeds over six decades; pairs, and grains and walls, at the same."""
    cells = []
    for speed in SPEEDS[::3] if quick else SPEEDS:
        for damping in ("viscous",) if quick else ("viscous", "viscoelastic"):
            own = {**BASE["interaction"], "damping": damping}
            box = {"kind": "box", "wall_speed": f"{speed} m/s"}
            half = [[-0.5 * speed, 0, 0], [0.5 * speed, 0.05 * speed, 0]]
            things = {
                "cake": (scene(boundary=box, interaction=own), {"kind": "cake", "grains": 60},
                         4_000),
                "pair": (scene(interaction=own),
                         {"kind": "given", "positions": [[2.0005, 0, 0], [0, 0, 0]],
                          "velocities": half}, 3_000),
                "wall": (scene(boundary=BOTTOM, interaction=own),
                         {"kind": "given", "positions": [[0, 0, 0]],
                          "velocities": [[0.1 * speed, 0, -speed]]}, 3_000),
            }  # fmt: skip
            for what, (blocks, sample, steps) in things.items():
                name = f"{what}, {damping}, {speed:g} m/s"
                place = {"row": f"{what}, {damping}", "column": speed}
                cells.append(Cell("wall speeds", name, blocks, sample, steps, coordinates=place))
    return sorted(cells, key=lambda cell: cell.coordinates["row"])


RATIOS = (1, 3, 10, 30, 100, 300, 1000)


def size_ratios(quick):
    """A large grain and small ones of 0.1 um: one that flies at it, six that sit on it, a coat
    of up to forty."""
    cells = []
    material = {"base": "silicate_s12", "radius": "0.1 um"}
    for ratio in RATIOS[::3] if quick else RATIOS:
        own = scene(material=material, interaction={"damping": "none"})
        for what, sample, limit in (
            ("flying", {"kind": "unlike", "ratio": ratio, "speed_in": 0.3}, False),
            ("six", {"kind": "unlike", "ratio": ratio, "around": 6, "speed": 0.01}, True),
            (
                "coat",
                {
                    "kind": "unlike",
                    "ratio": ratio,
                    "around": min(40, 2 * (1 + ratio) ** 2),
                    "speed": 0.01,
                },
                True,
            ),
        ):
            cells.append(Cell("size ratios", f"{what}, 1:{ratio}", own, sample, 3_000, limit=limit,
                              coordinates={"row": what, "column": ratio}))  # fmt: skip
    return sorted(cells, key=lambda cell: cell.coordinates["row"])


FAST = 1e9  # rad/s


def special(quick):
    """Single grains, contacts that just touch or just hold, coinciding grains, wild spins."""
    given, still = {"kind": "given"}, scene()
    timed = scene(numerics={"time_step": "0.1 ns"})
    apart = [[0, 0, 0], [3, 0, 0]]
    touching = [[0, 0, 0], [2, 0, 0]]
    near = 1.9997
    things = {
        "one grain, auto": (still, given | {"positions": [[0, 0, 0]]}),
        "one grain at rest": (timed, given | {"positions": [[0, 0, 0]]}),
        "one grain flying": (timed, given | {"positions": [[0, 0, 0]], "velocities": [[1, 2, 3]]}),
        "one grain spinning": (timed, given | {"positions": [[0, 0, 0]], "spins": [[FAST, 0, 0]]}),
        "two grains at rest": (still, given | {"positions": apart}),
        "two grains, bound": (still, {"kind": "chain", "grains": 2}),
        "touching exactly, at rest": (still, given | {"positions": touching}),
        "touching exactly, approaching": (still, given | {
            "positions": touching, "velocities": [[1e-3, 0, 0], [0, 0, 0]]}),
        "touching exactly, leaving": (still, given | {
            "positions": touching, "velocities": [[-1e-3, 0, 0], [0, 0, 0]]}),
        "touching exactly, sliding past": (still, given | {
            "positions": touching, "velocities": [[0, 0.1, 0], [0, 0, 0]]}),
        "coinciding": (scene(sample={"kind": "explicit", "positions": [
            ["0 m"] * 3, ["0 m"] * 3]}), None),
        "nearly coinciding": (scene(sample={"kind": "explicit", "positions": [
            ["0 m"] * 3, ["1e-15 m", "0 m", "0 m"]]}), None),
        "overlapping by half": (scene(sample={"kind": "explicit", "positions": [
            ["0 m"] * 3, ["0.6 um", "0 m", "0 m"]]}), None),
        "overlapping by 9 %": (scene(sample={"kind": "explicit", "positions": [
            ["0 m"] * 3, ["1.092 um", "0 m", "0 m"]]}), None),
        "at pull-off, two": (still, {"kind": "pulled", "grains": 2}),
        "at pull-off, ten": (still, {"kind": "pulled", "grains": 10}),
        "at pull-off, ten, hot": (still, {"kind": "pulled", "grains": 10, "speed": 0.01}),
        "spin 1e9, pair rolling": (still, given | {
            "positions": [[0, 0, 0], [near, 0, 0]], "spins": [[0, 0, FAST], [0, 0, -FAST]]}),
        "spin 1e9, pair sliding": (still, given | {
            "positions": [[0, 0, 0], [near, 0, 0]], "spins": [[0, 0, FAST], [0, 0, FAST]]}),
        "spin 1e9, pair twisting": (still, given | {
            "positions": [[0, 0, 0], [near, 0, 0]], "spins": [[FAST, 0, 0], [-FAST, 0, 0]]}),
        "spin 1e9, one of two": (still, given | {
            "positions": [[0, 0, 0], [near, 0, 0]], "spins": [[FAST, FAST, FAST], [0, 0, 0]]}),
        "spin 1e9, on a wall": (scene(boundary=BOTTOM), given | {
            "positions": [[0, 0, 0]], "spins": [[0, FAST, 0]]}),
        "spin 1e9, upright on a wall": (scene(boundary=BOTTOM), given | {
            "positions": [[0, 0, 0]], "spins": [[0, 0, FAST]]}),
        "spin 1e9, cluster": (still, {"kind": "cluster", "grains": 13, "spin": FAST}),
        "cluster at rest": (still, {"kind": "cluster", "grains": 13}),
        "no effects, pair": (scene(interaction={
            "rolling": "off", "sliding": "off", "twisting": "off", "damping": "none"}),
            {"kind": "meeting", "sticking": 0.5}),
    }  # fmt: skip
    return [Cell("special states", name, blocks, sample, 3_000, alike="special",
                 coordinates={"row": name, "column": ""})
            for name, (blocks, sample) in things.items()]  # fmt: skip


def filling_factors(quick):
    """From a gas to the densest packing, in a periodic cell that shrinks or rests."""
    things = {phi: {"kind": "gas", "grains": 60, "filling_factor": phi}
              for phi in (1e-4, 1e-3, 0.01, 0.05, 0.15)}  # fmt: skip
    things[0.3] = {"kind": "gas", "grains": 60, "filling_factor": 0.25}
    things[0.5] = {"kind": "packed_", "grains": 200, "filling_factor": 0.5}
    things[0.6] = {"kind": "packed_", "grains": 200, "filling_factor": 0.6}
    things[0.74] = {"kind": "lattice_", "structure": "fcc", "cells": [4, 4, 4]}
    cells = []
    for n, (phi, sample) in enumerate(things.items()):
        if quick and n % 4:
            continue
        own = dict(sample)
        if own["kind"].endswith("_"):
            block = {"packed_": "random_packing", "lattice_": "lattice"}[own.pop("kind")]
            own = {"kind": "packed", "block": {"kind": block, **own}}
        for what, speed, drive in (
            ("slow", 0.001, {}), ("fast", 1.0, {}),
            ("shrinking", 0.01, {"strain_rate": "-1e4 s^-1"}),
        ):  # fmt: skip
            cells.append(Cell("filling factors", f"{what}, {phi:g}",
                              scene(boundary={**PERIODIC, **drive}), {**own, "speed": speed},
                              1_500, coordinates={"row": what, "column": phi},
                              alike=f"{phi}"))  # fmt: skip
    return cells


def long_runs(quick):
    """Many steps: what drifts?"""
    steps = 200_000 if quick else 10_000_000
    cells = []
    for precision in ("f64",) if quick else ("f64", "mixed"):
        own = scene(interaction={"damping": "none"}, numerics={"precision": precision})
        for what, sample in (
            ("pair", {"kind": "chain", "grains": 2, "speed": 0.002, "spin": 1e3}),
            ("chain", {"kind": "chain", "grains": 10, "speed": 0.002, "spin": 1e3}),
        ):
            cells.append(Cell("long runs", f"{what}, {precision}, {steps:.0e} steps", own, sample,
                              steps, time_limit=300.0,
                              coordinates={"row": what, "column": precision}))  # fmt: skip
    return cells


def precisions(quick):
    """Every precision on what the other groups are made of."""
    things = {
        "pair, meeting": (scene(), {"kind": "meeting", "sticking": 0.7}, 5_000),
        "pair, 10 m/s": (scene(), {"kind": "given", "positions": [[2.0005, 0, 0], [0, 0, 0]],
                                   "velocities": [[-10, 0, 0], [0, 1, 0]]}, 3_000),
        "cake, warm": (scene(), {"kind": "cake", "grains": 60, "speed": 0.003}, 3_000),
        "cake, pressed": (scene(boundary={"kind": "box", "wall_speed": "1 m/s"}),
                          {"kind": "cake", "grains": 60}, 3_000),
        "pair, spinning": (scene(), {"kind": "given", "positions": [[0, 0, 0], [1.9997, 0, 0]],
                                     "spins": [[1e7, 0, 1e7], [0, 0, 0]]}, 5_000),
        "unlike": (scene(material={"base": "silicate_s12", "radius": "0.1 um"}),
                   {"kind": "unlike", "ratio": 10, "around": 6, "speed": 0.01}, 3_000),
        "ice, meeting": (scene(material="ice_t19"), {"kind": "meeting", "sticking": 0.7}, 5_000),
    }  # fmt: skip
    cells = []
    for what, (blocks, sample, steps) in list(things.items())[:: 3 if quick else 1]:
        for precision in ("f64", "mixed", "f32"):
            own = {**blocks, "numerics": {**blocks["numerics"], "precision": precision}}
            cells.append(Cell("precisions", f"{what}, {precision}", own, sample, steps,
                              coordinates={"row": what, "column": precision}))  # fmt: skip
    return cells


GROUPS = {
    "time step": time_step,
    "materials": materials,
    "one number": single_materials,
    "wall speeds": wall_speeds,
    "size ratios": size_ratios,
    "special states": special,
    "filling factors": filling_factors,
    "long runs": long_runs,
    "precisions": precisions,
}
