"""Paths that a user writes, in the YAML, on the command line and in Python."""

import os
from pathlib import Path


def user_path(path: str | Path) -> Path:
    """The path with the home folder in place of a leading ~ or ~USER."""
    return Path(os.path.expanduser(path))


def path_in(folder: str | Path | None, path: str | Path) -> Path:
    """A path of the YAML, relative to the folder of the scene."""
    return Path(folder or "") / user_path(path)
