"""Shell completion: names of scenes, run directories, keys of the YAML.

Nothing here may print or raise: after an empty list the shell completes file names.
"""

from pathlib import Path

from dusttaichi.scene.paths import user_path

MOST = 200  # examined entries of a folder


def complete_scenes(incomplete: str):
    """Names of bundled scenes, and YAML files."""
    return complete_bundled_scenes(incomplete) + _files(
        incomplete, lambda path: path.suffix in (".yaml", ".yml")
    )


def complete_bundled_scenes(incomplete: str):
    """Names of bundled scenes."""
    from dusttaichi.scene.shipped import list_names

    return [name for name in list_names() if name.startswith(incomplete)]


def complete_runs(incomplete: str):
    """Run directories, and result files."""
    return _files(incomplete, lambda path: path.suffix == ".nc")


def complete_keys(incomplete: str):
    """Keys of the YAML, with the equals sign that --set needs."""
    from dusttaichi.scene.keys import list_keys

    return [f"{row.path}=" for row in list_keys() if row.path.startswith(incomplete)]


def _files(incomplete, fits):
    """Paths that begin with `incomplete`: folders, and files that fit."""
    folder = Path(incomplete) if incomplete.endswith("/") else Path(incomplete).parent
    try:
        entries = sorted(user_path(folder).iterdir())[:MOST]
    except OSError:
        return []
    completions = []
    for path in entries:
        text = (folder / path.name).as_posix()  # as typed, with ~
        if text.startswith(incomplete) and (path.is_dir() or fits(path)):
            completions.append(text)
    return completions
