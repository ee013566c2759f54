"""Rules for output paths: no file of the user is overwritten without --force, no input at all.

A file counts as made by this program where it holds the mark of its format, so that a figure or a
table that is drawn again takes the place of the former one.
"""

from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from dusttaichi.errors import DustError

MARK = "written by dusttaichi"  # in the metadata of figures and films
NETCDF = "dusttaichi"  # in the attribute `source` of data sets
SEEN = 1 << 20  # bytes at the beginning and at the end of a file that are searched for the mark

_force = ContextVar("force", default=False)
_inputs = ContextVar("inputs", default=())


@contextmanager
def writing(*, force=False, inputs=()):
    """Inside, files of others are overwritten where `force` is true, and these inputs never.

    inputs: paths of what is read: files, or run directories, whose result counts.
    """
    read = [Path(path) / "result.nc" if Path(path).is_dir() else Path(path) for path in inputs]
    tokens = _force.set(force), _inputs.set((*_inputs.get(), *read))
    try:
        yield
    finally:
        _force.reset(tokens[0])
        _inputs.reset(tokens[1])


def check(path, mark=MARK):
    """`path`, if it may be written. Raises DustError where it is an input, or somebody else's.

    mark: text that such a file of our own holds.
    """
    path = Path(path)
    refuse_inputs(path, _inputs.get())
    if path.is_dir():
        raise DustError(f"{path} is a directory, and a file is to be written there.")
    if not _force.get() and path.exists() and not (_empty(path) or made(path, mark)):
        raise DustError(
            f"{path} exists, and dusttaichi has not made it. --force overwrites it, --output names "
            "another place."
        )
    return path


def refuse_inputs(path, inputs):
    """Raises DustError where `path` is one of the files that are read."""
    for given in inputs:
        if given.exists() and path.exists() and path.samefile(given):
            raise DustError(
                f"{path} is read by this command and would be overwritten by it. Choose another "
                "--output."
            )


def _empty(path):
    return path.is_file() and path.stat().st_size == 0


def made(path, mark=MARK):
    """True of a regular file that holds the mark, near its beginning or its end."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        head = file.read(SEEN)
        file.seek(max(len(head), path.stat().st_size - SEEN))
        return mark.encode() in head or mark.encode() in file.read(SEEN)
