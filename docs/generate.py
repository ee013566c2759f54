"""Parts of these pages that the program itself knows: written at each build to `generated/`.

The keys of a scene come from its JSON Schema, the variables of a result from their declaration, the
commands from the command line itself, the named materials from the scene, and the pages of the
interface from the packages. So none of these tables can be out of date.
"""

import csv
import json
import re
from pathlib import Path

import reference
from markdown import cell as _cell
from markdown import text as _text

from dusttaichi.results.variables import VARIABLES
from dusttaichi.scene import NAMED, json_schema

HERE = Path(__file__).parent
OUTPUT = HERE / "generated"

GROUPS = ("series", "profiles", "snapshots", "contacts", "wall_contacts")
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
    "push": "with pushes",
    "unlike": "with grains that are not all alike",
}


def main():
    """Write every generated part; files that would not change are left as they are."""
    pages = {
        **{f"keys_{block}.md": keys(block) for block in blocks()},
        "materials.md": materials(),
        **{f"variables_{group}.md": variables(group) for group in GROUPS},
        "commands.md": reference.commands(),
        **{f"{csv_file.stem}.md": csv_table(csv_file) for csv_file in _tables()},
        "api/index.md": reference.api_index(),
        **{f"api/{room}.md": reference.api_page(room, line) for room, line in reference.ROOMS},
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
    """Names of the tables of keys: `scene` for what stands at the top, and every block of it."""
    schema = json_schema()
    inner = [
        name
        for name, entry in schema["properties"].items()
        if _variants(schema, entry) and name != "materials"
    ]
    return ["scene", *inner]


def rows(block):
    """(path, default as YAML or "", kinds that have it, meaning) for each key of a block.

    Keys that several kinds of a block share stand once, with the kinds that have them.
    """
    schema = json_schema()
    if block == "scene":
        found = [
            (name, _default(entry), (), entry.get("description", ""))
            for name, entry in schema["properties"].items()
        ]
        return found
    return list(_merged(_walk(schema, block, schema["properties"][block], ())))


def _walk(schema, path, entry, seen):
    """All keys below an entry of the schema, depth first, as rows()."""
    for kind, variant in _variants(schema, entry):
        if variant in seen:
            continue
        for name, value in schema["$defs"][variant].get("properties", {}).items():
            here = f"{path}.{name}"
            kinds = (kind,) if kind and name != "kind" and name != "model" else ()
            text = value.get("description", "")
            if "const" not in value:
                yield here, _default(value), kinds, text
            yield from (
                (inner, default, kinds or deeper, words)
                for inner, default, deeper, words in _walk(schema, here, value, (*seen, variant))
            )


def _merged(found):
    """Rows of the same path, default and meaning as one, with all their kinds."""
    merged = {}
    for path, default, kinds, text in found:
        merged.setdefault((path, default, text), []).extend(kinds)
    for (path, default, text), kinds in merged.items():
        yield path, default, tuple(dict.fromkeys(kinds)), text


def _variants(schema, entry):
    """(kind or "", name of the definition) of every block that may stand at an entry."""
    options = [entry, *entry.get("anyOf", []), *entry.get("oneOf", [])]
    options += [option for one in list(options) for option in one.get("oneOf", [])]
    options += [option for one in list(options) for option in one.get("anyOf", [])]
    options += [one["items"] for one in list(options) if isinstance(one.get("items"), dict)]
    found = []
    for option in options:
        name = option.get("$ref", "").removeprefix("#/$defs/")
        if not name or name in {known for _, known in found}:
            continue
        properties = schema["$defs"][name].get("properties", {})
        kind = next(
            (properties[k]["const"] for k in ("kind", "model") if "const" in properties.get(k, {})),
            "",
        )
        found.append((kind, name))
    return found


def _default(entry):
    """The default of a key as it is written in YAML, "" where there is none."""
    value = entry.get("default")
    if value is None or value == "":
        return ""
    return value if isinstance(value, str) else _yaml(value)


def _yaml(value):
    """A value in YAML's flow style, on one line."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_yaml(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(_yaml(inner) for inner in value) + "]"
    if isinstance(value, float):
        return f"{value:.12g}"
    return value if isinstance(value, str) else json.dumps(value)


def keys(block):
    """The table of the keys of one block, in Markdown."""
    lines = ["| key | default | meaning |", "| --- | --- | --- |"]
    for path, default, kinds, text in rows(block):
        of = f"of {', '.join(f'`{kind}`' for kind in kinds)}: " if kinds else ""
        shown = f"`{default}`" if default else ""
        lines.append(f"| `{path}` | {shown} | {of}{_cell(text)} |")
    return _text(lines)


# Materials, variables, tables of numbers.


def materials():
    """The table of the named materials."""
    numbers = {name: _numbers(material) for name, material in NAMED.items()}
    names = list(dict.fromkeys(key for known in numbers.values() for key in known))
    lines = [
        "| | " + " | ".join(f"`{name}`" for name in numbers) + " |",
        "| --- |" + " --- |" * len(numbers),
    ]
    for key in names:
        cells = [str(known.get(key, "")) for known in numbers.values()]
        lines.append(f"| `{key}` | " + " | ".join(cells) + " |")
    return _text(lines)


def _numbers(material):
    """The numbers of a named material as they stand in YAML."""
    given = material if isinstance(material, dict) else material.model_dump(mode="json")
    return {key: value for key, value in given.items() if value is not None and key != "name"}


def variables(group):
    """The table of the variables of one group of the result file."""
    lines = [
        "| variable | dimensions | unit | meaning | there | source |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for variable in VARIABLES.values():
        if variable.group != group:
            continue
        dims = ", ".join(f"`{name}`" for name in variable.dims)
        needs = ", ".join(text for name, text in FEATURES.items() if name in variable.needs)
        lines.append(
            f"| `{variable.name}` | {dims} | {variable.units} | {_cell(variable.long_name)} "
            f"| {needs or 'always'} | {_cell(variable.source)} |"
        )
    return _text(lines)


def _tables():
    """The tables of numbers of the validation, small enough for a page."""
    return sorted((HERE / "validation").glob("*.csv"))


def csv_table(path, most=60):
    """A CSV file as a table; of a long one its first rows, and how many there are."""
    with path.open(newline="", encoding="utf-8") as file:
        text = file.read().splitlines()
    notes = [line.removeprefix("#").strip() for line in text if line.startswith("#")]
    head, *lines = csv.reader(line for line in text if not line.startswith("#"))
    table = [note + "\n" for note in notes]
    table += ["| " + " | ".join(_cell(name) for name in head) + " |", "| --- " * len(head) + "|"]
    table += ["| " + " | ".join(_cell(_short(cell)) for cell in row) + " |" for row in lines[:most]]
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
