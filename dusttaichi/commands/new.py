"""`dust new`: a copy of a bundled scene, or their list."""

from pathlib import Path
from typing import Annotated

import typer

from dusttaichi.commands import completion
from dusttaichi.commands.console import say, say_table, say_written
from dusttaichi.commands.options import flag, output_option
from dusttaichi.errors import DustError

NAMED = 3  # scenes that an error suggests


def new(
    name: Annotated[
        str | None,
        typer.Argument(
            help="one of the bundled scenes, or a word that those to be listed have",
            metavar="[NAME]",
            autocompletion=completion.complete_bundled_scenes,
        ),
    ] = None,
    output: output_option("the file, by default NAME.yaml in the current directory") = None,
    force: flag("--force", "overwrite an existing file") = False,
):
    """Copy a bundled scene to edit; without a name, list them; with a word, those that have it.

    Its extensions go with it.
    """
    from dusttaichi.scene import shipped

    if name is None:
        return _show(shipped.list_names())
    source = shipped.find_scene(name)
    if source is None:
        matches = shipped.search_words(name)
        if not matches or output is not None or force:
            raise DustError(
                f"There is no scene {name}: {_hint(name, matches)}`dust new` lists all."
            )
        return _show(matches)
    path = Path(source.name) if output is None else output
    path = path / source.name if path.is_dir() else path
    texts = shipped.copy_texts(source)
    copies = {path: texts.pop(source.name)}
    copies |= {path.with_name(name): text for name, text in texts.items()}
    try:
        for copy in [] if force else copies:
            if copy.exists() and (copy == path or copy.read_bytes() != copies[copy].encode()):
                raise DustError(f"{copy} exists; --force overwrites it, --output names another.")
        path.parent.mkdir(parents=True, exist_ok=True)
        for copy, text in copies.items():
            copy.write_text(text, encoding="utf-8")
    except OSError as error:
        from dusttaichi.results.files import explain

        raise DustError(f"{path} cannot be written: {explain(error, path)}.") from None
    say_written(copies)
    say(f"next: dust check {path}")
    say(f"      dust {shipped.choose_command(source)} {path}")


def _hint(text, matches):
    """A question that suggests scenes or a word; matches: scenes whose text has the word."""
    from dusttaichi.scene import shipped

    suggestions = [*(matches or shipped.find_similar_names(text))[:NAMED]]
    word = None if matches else shipped.find_similar_word(text)
    suggestions += [f"the word {word} (`dust new {word}`)"] if word else []
    return f"do you mean {' or '.join(suggestions)}? " if suggestions else ""


def _show(names):
    """Print names and descriptions of scenes."""
    from dusttaichi.scene import shipped

    say_table(
        ((name, shipped.read_summary(shipped.get_folder() / f"{name}.yaml")) for name in names),
        {"header": "scene", "no_wrap": True, "min_width": max(map(len, names))},
        {"header": "description"},
        wrap=True,
    )
    say("\ndust run NAME runs one; dust new NAME copies it to a file to edit; dust new WORD lists "
        "those with a word, such as shear.")  # fmt: skip
