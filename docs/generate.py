"""Parts of these pages that the program itself knows: written at each build to `generated/`.

The keys of a scene come from its blocks, the variables of a result from their declaration, the
commands from the command line itself, the named materials from the scene, the numbers of runs from
their registry, those of a contact from the laws, and the pages of the interface from the packages.
So none of these tables can be out of date.
"""

import csv
import re
from pathlib import Path

import interface
import sample_size
import softening
from tables import VALIDATION, head, row
from tables import cell as _cell
from tables import text as _text

from dusttaichi.analysis.numbers import Family, families
from dusttaichi.continuum.variables import VARIABLES as OF_CONTINUUM
from dusttaichi.grains.variables import VARIABLES
from dusttaichi.physics.contact.registry import table_of_numbers
from dusttaichi.results.shown import NUMBERS
from dusttaichi.scene import NAMED, extensions, shipped
from dusttaichi.scene.keys import rows

HERE = Path(__file__).parent
OUTPUT = HERE / "generated"

GROUPS = ("series", "profiles", "snapshots", "contacts", "wall_contacts", "sphere_contacts")
# What a scene must have for a variable to be there, in words.
FEATURES = {
    "walls": "with walls",
    "cell": "in periodic cells",
    "room": "with walls or periodic faces",
    "height": "with a height",
    "filling": "with a filling factor",
    "plates": "between plates",
    "stress": "with `output.stress`",
    "stages": "with stages",
    "stiffness": "with stages of different `stiffness_scaling`",
    "push": "with pushes",
    "gravity": "with gravity",
    "sphere": "with a sphere",
    "pair": "of two bodies that fly at each other in open space",
    "polydisperse": "with unequal grains",
    "forces": "with `output.forces`",
    "bodies": "with rigid bodies",
    "heat": "with a heat capacity",
    "damage": "with damage",
    "materials": "with several materials",
    "open": "with an open boundary",
    "shear": "where a stage shears",
    "tilt": "in cells that are sheared",
    "requested": "on request",
}


def main():
    """Write every generated part; files that would not change are left as they are."""
    packages = interface.PUBLIC + interface.INNER
    pages = {
        **{f"keys_{block}.md": keys(block) for block in blocks()},
        "keys_continuum.md": keys_of(key for key in rows("continuum") if key not in rows()),
        "materials.md": materials(),
        "contact_numbers.md": contact_numbers(),
        "numbers.md": numbers(family for family in built_in() if not family.compared),
        "numbers_compared.md": numbers(family for family in built_in() if family.compared),
        "numbers_bundled.md": numbers(*bundled()),
        **{f"variables_{group}.md": variables(group, VARIABLES.values()) for group in GROUPS},
        "variables_continuum.md": variables("series", OF_CONTINUUM),
        "variables_continuum_snapshots.md": variables("snapshots", OF_CONTINUUM),
        "commands.md": interface.commands(),
        "exit_codes.md": interface.exit_codes(),
        **{f"{csv_file.stem}.md": csv_table(csv_file) for csv_file in _tables()},
        **softening.pages(),
        "sample_size_table.md": sample_size.page(),
        "api/index.md": interface.api_index(),
        **{f"api/{name}.md": interface.api_page(name, line) for name, line in packages},
    }
    wanted = {OUTPUT / name for name in pages}
    for path in set(OUTPUT.rglob("*.md")) - wanted:
        path.unlink()
    for name, text in pages.items():
        path = OUTPUT / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


# The keys of a scene.


def blocks():
    """Names of the tables of keys: `scene` for the top level, and every block of it."""
    return ["scene", *dict.fromkeys(key.path.split(".")[0] for key in rows() if "." in key.path)]


def keys(block):
    """The table of the keys of one block, in Markdown."""

    def belongs(key):
        first, _, below = key.path.partition(".")
        return (block == first and below) or (block == "scene" and not below)

    return keys_of(key for key in rows() if belongs(key))


def keys_of(chosen):
    """The table of some keys, in Markdown."""
    lines = head("key", "default", "meaning")
    for key in chosen:
        of = f"of {', '.join(f'`{kind}`' for kind in key.kinds)}: " if key.kinds else ""
        default = f"`{key.default}`" if key.default else "*needed*" if key.needed else ""
        example = f", as `{key.example}`" if key.example else ""
        meaning = f"{of}{_cell(key.meaning)}<br>*{_cell(key.allowed)}{example}*"
        lines.append(f"| `{key.path}` | {default} | {meaning} |")
    return _text(lines)


# Materials, variables, tables of numbers.


def materials():
    """The table of the named materials."""
    numbers = {name: _numbers(material) for name, material in NAMED.items()}
    names = list(dict.fromkeys(key for known in numbers.values() for key in known))
    lines = head("", *(f"`{name}`" for name in numbers))
    for key in names:
        lines.append(row(f"`{key}`", *(str(known.get(key, "")) for known in numbers.values())))
    return _text(lines)


def _numbers(material):
    """The numbers of a named material as written in YAML."""
    given = material if isinstance(material, dict) else material.model_dump(mode="json")
    return {key: value for key, value in given.items() if value is not None and key != "name"}


def contact_numbers():
    """The table of the numbers that a contact stores for each law."""
    lines = head("effect", "law", "number", "unit", "meaning")
    for effect, law, name, unit, meaning in table_of_numbers():
        lines.append(row(effect, f"`{law}`", f"`{name}`", unit, _cell(meaning)))
    return _text(lines)


def built_in():
    """Families of numbers of the package itself."""
    return [family for family in families() if family not in NUMBERS.values()]


def bundled():
    """(families of the bundled extensions, family -> file that it is of)."""
    found = {}
    for path in shipped.extensions_named("*.py"):
        own = vars(extensions.module(path)).values()
        name = path.relative_to(shipped.folder()).as_posix()
        found |= {family.name: (family, name) for family in own if isinstance(family, Family)}
    return [family for family, _ in found.values()], {n: file for n, (_, file) in found.items()}


def numbers(chosen, files=None):
    """The table of the numbers of some families; files: family -> file that it is of."""
    lines = head("number", "unit", "meaning", "where")
    for family in chosen:
        where = f"{_cell(family.title)}: `{files[family.name]}`" if files else _cell(family.title)
        for own in family.numbers:
            unit = own.unit or ("text" if own.unit == "" else "")
            title = _cell(own.about or own.title.removeprefix("… "))
            lines.append(row(f"`{own.name}`", unit, title, where))
    return _text(lines)


def variables(group, declared):
    """The table of the variables of one group of the result file."""
    lines = head("variable", "dimensions", "unit", "meaning", "source")
    for variable in declared:
        if variable.group != group:
            continue
        dims = ", ".join(f"`{name}`" for name in variable.dims)
        needs = ", ".join(text for name, text in FEATURES.items() if name in variable.needs)
        there = f"<br>*{needs}*" if needs else ""
        meaning = f"{_cell(variable.long_name)}{there}"
        cells = (f"`{variable.name}`", dims, variable.units, meaning, _cell(variable.source))
        lines.append(row(*cells))
    return _text(lines)


def _tables():
    """The tables of numbers of the validation, small enough for a page."""
    return sorted(VALIDATION.glob("*.csv"))


def csv_table(path, most=60):
    """A CSV file as a table; of a long one its first rows, and how many there are."""
    with path.open(newline="", encoding="utf-8") as file:
        text = file.read().splitlines()
    notes = [line.removeprefix("#").strip() for line in text if line.startswith("#")]
    names, *lines = csv.reader(line for line in text if not line.startswith("#"))
    table = [*(note + "\n" for note in notes), ":::{div} numbers", ""]
    table += head(*map(_cell, names))
    table += [row(*(_cell(_short(one)) for one in cells)) for cells in lines[:most]]
    table += ["", ":::"]
    if len(lines) > most:
        table += ["", f"The first {most} of {len(lines)} rows."]
    return _text(table)


def _short(cell):
    """A number with no more digits than a reader takes in; anything else as it is."""
    try:
        return cell if re.fullmatch(r"[+-]?\d+", cell) else f"{float(cell):.4g}"
    except ValueError:
        return cell


if __name__ == "__main__":
    main()
