"""Bundled scenes and their extensions: the folder configs, in a clone and in the wheel."""

import difflib
import itertools
import re
from pathlib import Path

import yaml

SUFFIXES = (".yaml", ".yml")
SCHEMA = "scene.schema.json"


def get_folder() -> Path:
    """Folder of the scenes: in the package of an installed wheel, otherwise in the clone."""
    package = Path(__file__).parents[1]
    inside = package / "configs"
    return inside if inside.is_dir() else package.parent / "configs"


def list_names() -> list[str]:
    """Names of all scenes, such as "seizinger2012/dynamic_5ms"; top-level ones come first."""
    root = get_folder()
    files = [p.relative_to(root).with_suffix("") for p in root.rglob("*.yaml")]
    return [f.as_posix() for f in sorted(files, key=lambda f: (len(f.parts), f.as_posix()))]


def find_scene(name: str | Path) -> Path | None:
    """File of the scene of that name, with or without ".yaml" and "configs/", or None."""
    text = Path(name).as_posix().removeprefix("configs/")
    for suffix in SUFFIXES:
        text = text.removesuffix(suffix)
    return get_folder() / f"{text}.yaml" if text in list_names() else None


def find_extension(name: str | Path) -> Path | None:
    """File of a bundled extension, such as "reissl2024/spin_up.py", with or without "configs/"."""
    text = Path(name).as_posix().removeprefix("configs/")
    paths_by_name = {
        path.relative_to(get_folder()).as_posix(): path for path in find_extensions("*.py")
    }
    return paths_by_name.get(text)


def find_extensions(name: str) -> list[Path]:
    """Files of the bundled extensions with a file name, of any folder."""
    return sorted(get_folder().rglob(name))


def find_similar_names(name: str | Path) -> list[str]:
    """Names of scenes that are similar to this one, the nearest first, with or without a folder."""
    text, all_names = Path(name).with_suffix("").as_posix(), list_names()
    by_stem = {scene_name.rpartition("/")[2]: scene_name for scene_name in reversed(all_names)}
    stems = difflib.get_close_matches(text, by_stem, cutoff=0.7)
    close = difflib.get_close_matches(text, all_names, cutoff=0.7)
    return list(dict.fromkeys([*close, *(by_stem[stem] for stem in stems)]))


def search_words(text: str) -> list[str]:
    """Names of the scenes in whose name or comment at the top each word is, in any case.

    Where there are none: those that have them anywhere in their text.
    """
    words = text.casefold().split()
    scenes = {
        name: (get_folder() / f"{name}.yaml").read_text(encoding="utf-8") for name in list_names()
    }
    for extract_text in (_read_comment, str):
        matches = [
            name
            for name, yaml_text in scenes.items()
            if all(word in f"{name}\n{extract_text(yaml_text)}".casefold() for word in words)
        ]
        if matches:
            return matches
    return []


def find_similar_word(text: str) -> str | None:
    """The word of the names and first comments of the scenes that is spelt most like a text."""
    texts = [
        f"{name} {_read_comment((get_folder() / f'{name}.yaml').read_text('utf-8'))}"
        for name in list_names()
    ]
    words = set(re.findall(r"[^\W\d_]{3,}", " ".join(texts).casefold()))
    return next(iter(difflib.get_close_matches(text.casefold(), sorted(words), 1, 0.82)), None)


def _read_comment(text: str) -> str:
    """The comment at the top of a scene file, in one line."""
    lines = itertools.takewhile(lambda line: line.startswith("#"), text.splitlines())
    return " ".join(line.lstrip("# ") for line in lines if "yaml-language-server" not in line)


def choose_command(path: Path) -> str:
    """The command for a bundled scene: "collide" where it has that block, "run" otherwise."""
    return "collide" if "collisions" in yaml.safe_load(path.read_text(encoding="utf-8")) else "run"


def read_summary(path: Path) -> str:
    """First sentence of the comment at the top of a scene file."""
    # a full stop ends a sentence where a word follows that begins with a capital
    return re.split(
        r"\.(?: (?=[A-Z`])|$)", _read_comment(path.read_text(encoding="utf-8")), maxsplit=1
    )[0].rstrip(":")


def copy_texts(path: Path) -> dict[str, str]:
    """Texts of a bundled scene and of its extensions, for new files, by their names.

    In the scene, editors find the schema.
    """
    text = path.read_text(encoding="utf-8")
    schema = (get_folder() / SCHEMA).resolve().as_uri()
    scene_text = re.sub(r"(?<=\$schema=)\S+", lambda _: schema, text, count=1)
    extension_paths = [path.parent / name for name in yaml.safe_load(text).get("extensions", [])]
    return {path.name: scene_text} | {
        extension_path.name: extension_path.read_text(encoding="utf-8")
        for extension_path in extension_paths
    }
