"""Bundled scenes and their extensions: the folder configs, in a clone and in the wheel."""

import difflib
import re
from pathlib import Path

import yaml

SUFFIXES = (".yaml", ".yml")
SCHEMA = "scene.schema.json"


def folder() -> Path:
    """Folder of the scenes: in the package of an installed wheel, otherwise in the clone."""
    package = Path(__file__).parents[1]
    inside = package / "configs"
    return inside if inside.is_dir() else package.parent / "configs"


def names() -> list[str]:
    """Names of all scenes, such as "seizinger2012/dynamic_5ms"; top-level ones come first."""
    root = folder()
    files = [p.relative_to(root).with_suffix("") for p in root.rglob("*.yaml")]
    return [f.as_posix() for f in sorted(files, key=lambda f: (len(f.parts), f.as_posix()))]


def find(name: str | Path) -> Path | None:
    """File of the scene of that name, with or without ".yaml" and "configs/", or None."""
    text = Path(name).as_posix().removeprefix("configs/")
    for suffix in SUFFIXES:
        text = text.removesuffix(suffix)
    return folder() / f"{text}.yaml" if text in names() else None


def extension(name: str | Path) -> Path | None:
    """File of a bundled extension, such as "reissl2024/spin_up.py", with or without "configs/"."""
    text = Path(name).as_posix().removeprefix("configs/")
    found = {path.relative_to(folder()).as_posix(): path for path in extensions_named("*.py")}
    return found.get(text)


def extensions_named(name: str) -> list[Path]:
    """Files of the bundled extensions with a file name, of any folder."""
    return sorted(folder().rglob(name))


def resembling(name: str | Path) -> list[str]:
    """Names of scenes that are similar to this one, the nearest first."""
    return difflib.get_close_matches(Path(name).with_suffix("").as_posix(), names(), cutoff=0.7)


def about(path: Path) -> str:
    """First sentence of the comment at the top of a scene file."""
    lines = []
    for line in path.read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            break
        if "yaml-language-server" not in line:
            lines.append(line.lstrip("# "))
    # a full stop ends a sentence where a word follows that begins with a capital
    return re.split(r"\.(?: (?=[A-Z`])|$)", " ".join(lines), maxsplit=1)[0].rstrip(":")


def copies_of(path: Path) -> dict[str, str]:
    """Texts of a bundled scene and of the extensions that it names, for new files, by their names.

    In the scene, editors find the schema.
    """
    text = path.read_text(encoding="utf-8")
    schema = (folder() / SCHEMA).resolve().as_uri()
    own = re.sub(r"(?<=\$schema=)\S+", lambda _: schema, text, count=1)
    named = [path.parent / name for name in yaml.safe_load(text).get("extensions", [])]
    return {path.name: own} | {one.name: one.read_text(encoding="utf-8") for one in named}
