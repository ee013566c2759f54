"""The scenes that come with the program: the folder configs, in a clone and in the wheel."""

import difflib
import re
from pathlib import Path

SUFFIXES = (".yaml", ".yml")
SCHEMA = "scene.schema.json"


def folder() -> Path:
    """Where the scenes are: in the package where a wheel was installed, else in the clone."""
    package = Path(__file__).parents[1]
    inside = package / "configs"
    return inside if inside.is_dir() else package.parent / "configs"


def names() -> list[str]:
    """Names of all scenes, as "omni_static" or "seizinger2012/dynamic_5ms"; those on top first."""
    files = [p.relative_to(folder()).with_suffix("") for p in folder().rglob("*.yaml")]
    return [f.as_posix() for f in sorted(files, key=lambda f: (len(f.parts), f.as_posix()))]


def find(name: str | Path) -> Path | None:
    """The file of the scene of that name, with or without ".yaml" and "configs/"; None without."""
    text = Path(name).as_posix().removeprefix("configs/")
    for suffix in SUFFIXES:
        text = text.removesuffix(suffix)
    return folder() / f"{text}.yaml" if text in names() else None


def resembling(name: str | Path) -> list[str]:
    """Names of scenes that look like this one, the nearest first."""
    return difflib.get_close_matches(Path(name).with_suffix("").as_posix(), names(), cutoff=0.7)


def about(path: Path) -> str:
    """The first sentence of the comment that a scene file begins with."""
    lines = []
    for line in path.read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            break
        if "yaml-language-server" not in line:
            lines.append(line.lstrip("# "))
    # a full stop ends a sentence where a word follows that begins with a capital
    return re.split(r"\.(?: (?=[A-Z`])|$)", " ".join(lines), maxsplit=1)[0].rstrip(":")


def copy_of(path: Path) -> str:
    """The text of a shipped scene for a file of its own, in which editors find the schema."""
    text = path.read_text(encoding="utf-8")
    return re.sub(
        r"(?<=\$schema=)\S+", lambda _: (folder() / SCHEMA).resolve().as_uri(), text, count=1
    )
