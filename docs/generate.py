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
import verdicts
from tables import VALIDATION, markdown, read

from dusttaichi.analysis.numbers import Family, families
from dusttaichi.continuum.continuum_variables import VARIABLES as OF_CONTINUUM
from dusttaichi.grains.grain_variables import VARIABLES
from dusttaichi.physics.contact.effect_registry import table_of_numbers
from dusttaichi.results.shown import NUMBERS
from dusttaichi.scene import NAMED, extensions, shipped
from dusttaichi.scene.keys import list_keys

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
    "tube": "in a tube",
    "stress": "with `output.stress`",
    "stages": "with stages",
    "stiffness": "with stages of different `stiffness_scaling`",
    "push": "with pushes",
    "gravity": "with gravity",
    "surfaces": "with `surfaces` or a tube",
    "outside": "with `forces`",
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
        "keys_continuum.md": keys_of(
            key for key in list_keys("continuum") if key not in list_keys()
        ),
        "scenes.md": scenes(),
        "materials.md": materials(),
        "contact_numbers.md": contact_numbers(),
        "numbers.md": numbers(family for family in built_in() if not family.compared),
        "numbers_compared.md": numbers(family for family in built_in() if family.compared),
        "numbers_bundled.md": numbers(*list_bundled()),
        **{f"variables_{group}.md": variables(group, VARIABLES.values()) for group in GROUPS},
        "variables_continuum.md": variables("series", OF_CONTINUUM),
        "variables_continuum_snapshots.md": variables("snapshots", OF_CONTINUUM),
        "commands.md": interface.commands(),
        "exit_codes.md": interface.exit_codes(),
        **{
            f"{file.stem}.md": csv_table(file)
            for file in VALIDATION.glob("*.csv")
            if file.stem != "verdicts"
        },
        **{f"{file.stem}.md": page_table(file) for file in VALIDATION.glob("pages/*.csv")},
        **softening.pages(),
        **verdicts.pages(),
        "sample_size_table.md": sample_size.page(),
        "api/index.md": interface.api_index(),
        **{f"api/{name}.md": interface.api_page(name, line) for name, line in packages},
    }
    expected_paths = {OUTPUT / name for name in pages}
    for path in set(OUTPUT.rglob("*.md")) - expected_paths:
        path.unlink()
    for name, text in pages.items():
        path = OUTPUT / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


# The keys of a scene.


def blocks():
    """Names of the tables of keys: `scene` for the top level, and every block of it."""
    return [
        "scene",
        *dict.fromkeys(key.path.split(".")[0] for key in list_keys() if "." in key.path),
    ]


def keys(block):
    """The table of the keys of one block, in Markdown."""

    def belongs(key):
        first, _, below = key.path.partition(".")
        return (block == first and below) or (block == "scene" and not below)

    return keys_of(key for key in list_keys() if belongs(key))


def keys_of(selected_keys):
    """The table of some keys, in Markdown."""

    def row(key):
        of = f"of {', '.join(f'`{kind_name}`' for kind_name in key.kinds)}: " if key.kinds else ""
        example = f", as `{key.example}`" if key.example else ""
        return {
            "key": f"`{key.path}`",
            "default": f"`{key.default}`" if key.default else "*needed*" if key.required else "",
            "meaning": f"{of}{key.meaning}<br>*{key.allowed}{example}*",
        }

    return markdown(map(row, selected_keys))


# Scenes, materials, variables, tables of numbers.


def scenes():
    """The table of the bundled scenes with the summaries that they begin with."""
    folder = shipped.get_folder()
    return markdown(
        {
            "scene": f"`configs/{name}.yaml`",
            "command": f"`dust {shipped.choose_command(folder / f'{name}.yaml')}`",
            "content": shipped.read_summary(folder / f"{name}.yaml"),
        }
        for name in shipped.list_names()
    )


def materials():
    """The table of the named materials."""
    numbers = {name: _numbers(material) for name, material in NAMED.items()}
    keys = dict.fromkeys(
        key for values_of_material in numbers.values() for key in values_of_material
    )
    return markdown(
        {"": f"`{key}`"}
        | {f"`{name}`": f"{values.get(key, '')}" for name, values in numbers.items()}
        for key in keys
    )


def _numbers(material):
    """The numbers of a named material as written in YAML."""
    values = material if isinstance(material, dict) else material.model_dump(mode="json")
    return {key: value for key, value in values.items() if value is not None and key != "name"}


def contact_numbers():
    """The table of the numbers that a contact stores for each law."""
    return markdown(
        {"effect": effect, "law": f"`{law}`", "number": f"`{name}`", "unit": unit, "meaning": text}
        for effect, law, name, unit, text in table_of_numbers()
    )


def built_in():
    """Families of numbers of the package itself."""
    return [family for family in families() if family not in NUMBERS.values()]


def list_bundled():
    """(families of the bundled extensions, family -> file that it is of)."""
    families_by_name = {}
    for path in shipped.find_extensions("*.py"):
        members = vars(extensions.import_extension(path)).values()
        name = path.relative_to(shipped.get_folder()).as_posix()
        families_by_name |= {
            family.name: (family, name) for family in members if isinstance(family, Family)
        }
    return [family for family, _ in families_by_name.values()], {
        n: file for n, (_, file) in families_by_name.items()
    }


def numbers(selected, files=None):
    """The table of the numbers of some families; files: family -> file that it is of."""
    return markdown(
        {
            "number": f"`{number.name}`",
            "unit": number.unit or ("text" if number.unit == "" else ""),
            "meaning": number.about or number.title.removeprefix("… "),
            "where": f"{family.title}: `{files[family.name]}`" if files else family.title,
        }
        for family in selected
        for number in family.numbers
    )


def variables(group, declared):
    """The table of the variables of one group of the result file."""

    def row(variable):
        needs = ", ".join(text for name, text in FEATURES.items() if name in variable.needs)
        return {
            "variable": f"`{variable.name}`",
            "dimensions": ", ".join(f"`{name}`" for name in variable.dims),
            "unit": variable.units,
            "meaning": variable.long_name + (f"<br>*{needs}*" if needs else ""),
            "source": variable.source,
        }

    return markdown(row(variable) for variable in declared if variable.group == group)


def csv_table(path, max_rows=60):
    """A CSV file as a table; of a long one its first rows, and how many there are."""
    lines = path.read_text(encoding="utf-8").splitlines()
    notes = [line.removeprefix("#").strip() + "\n" for line in lines if line.startswith("#")]
    table = read(path, dtype=str, keep_default_na=False)
    shown = table.head(max_rows).apply(lambda column: column.map(_short))
    texts = [*notes, ":::{div} numbers\n", markdown(shown.to_dict("records")), ":::\n"]
    if len(table) > max_rows:
        texts.append(f"The first {max_rows} of {len(table)} rows.\n")
    return "\n".join(texts)


def page_table(path):
    """A table of a page, with its cells as they are and the command that gave them below."""
    lines = path.read_text(encoding="utf-8").splitlines()
    notes = " ".join(line.removeprefix("# ") for line in lines if line.startswith("# "))
    rows = csv.DictReader(line for line in lines if not line.startswith("# "))
    return f"{markdown(rows)}\n*{notes}*\n"


def _short(cell):
    """A number with no more digits than a reader takes in; anything else as it is."""
    try:
        return cell if re.fullmatch(r"[+-]?\d+", cell) else f"{float(cell):.4g}"
    except ValueError:
        return cell


if __name__ == "__main__":
    main()
