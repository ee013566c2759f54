"""The seal at the end of a result file: the SHA-256 of its bytes, and which records they hold.

HDF5 has a sum of each chunk of numbers, but none of its texts and of some of its tables. Where
those are damaged it may give other numbers, or never come to an end. So a file is opened only
where it has the bytes that were written. HDF5 does not look behind its own end, where the seal is:

    bytes of HDF5 | seal, a JSON text | SHA-256 of that text | its length, 8 bytes | MAGIC

A program that changes the file by HDF5 cuts the seal off; an attribute says that there was one.
Files from before there were seals have a digest of their texts.
"""

import hashlib
import json
import os
from contextlib import contextmanager
from pathlib import Path

import netCDF4

from dusttaichi.errors import DustError
from dusttaichi.files import BLOCK

DIGEST = "digest"  # global attribute: SHA-256 of the texts in a file without a seal
SEALED = "SHA-256 of the file, at its end"  # its value in a file that has one
MAGIC = b"dustseal"
END = 32 + 8 + len(MAGIC)  # bytes behind the JSON text
LARGEST = 4e9  # bytes up to which a file is read whole before it is opened

_checked = {}  # path -> identity of the file that was found whole


def sealed(blocks, about):
    """The blocks of bytes of a file, and behind them their seal.

    about: what it is to say besides, as JSON can hold.
    """
    digest, size = hashlib.sha256(), 0
    for block in blocks:
        digest.update(block)
        size += len(block)
        yield block
    yield _seal(digest, size, about)


def seal_file(path, about):
    """Put the seal behind the end of a file. OSError is let out."""
    size = os.path.getsize(path)
    with open(path, "r+b", buffering=0) as file:
        digest = _digest(file, size)
        file.seek(size)
        file.write(_seal(digest, size, about))


def remove(path):
    """Cut the seal off, so that HDF5 may go on behind its own end. OSError is let out."""
    if (about := seal_of(path)) is not None:
        os.truncate(path, about["size"])


def _seal(digest, size, about):
    text = json.dumps({"sha256": digest.hexdigest(), "size": size, **about}).encode()
    return b"".join((text, hashlib.sha256(text).digest(), len(text).to_bytes(8, "little"), MAGIC))


def seal_of(path):
    """Content of the seal of a file, None where there is none. The file may be damaged before it.

    OSError is let out; DustError where the seal itself is damaged.
    """
    with open(path, "rb") as file:
        size = file.seek(0, os.SEEK_END)
        end = _read(file, max(size - END, 0), END)
        if len(end) < END or not end.endswith(MAGIC):
            return None
        length = int.from_bytes(end[32:40], "little")
        if length > size - END:
            raise damaged(path)
        text = _read(file, size - END - length, length)
        if hashlib.sha256(text).digest() != end[:32]:
            raise damaged(path)
    about = json.loads(text)
    if about["size"] != size - END - length:
        raise damaged(path)
    return about


def check(path):
    """The seal of a file, None where there is none, after a look at whether its bytes are those
    that were sealed. A file is looked at once in a process, and again when it has changed.

    OSError is let out; DustError where it is damaged.
    """
    with open(path, "rb", buffering=0) as file:
        now = os.fstat(file.fileno())
        about = seal_of(path)
        identity = now.st_dev, now.st_ino, now.st_size, now.st_mtime_ns
        known = _checked.get(str(path)) == identity
        if about is None or known or about["size"] > LARGEST:
            return about
        if _digest(file, about["size"]).hexdigest() != about["sha256"]:
            # another file may have taken its place between the two looks
            if os.stat(path).st_ino != now.st_ino:
                return check(path)
            raise damaged(path)
    _checked[str(path)] = identity
    return about


@contextmanager
def opened(path):
    """A result file that is open for reading. OSError is let out; DustError where it is damaged."""
    about = check(path)
    with netCDF4.Dataset(path) as file:
        if about is None:
            _check_texts(path, file)
        yield file


def check_whole(path):
    """Raise DustError where a result file is damaged; OSError is let out."""
    if check(path) is None:
        with opened(path):
            pass


def damaged(path):
    """The DustError that says so."""
    path, what = Path(path), "Take it from a backup, or compute it anew (--force)"
    if path.parent.suffix == ".parts":
        what += "; where it and the parts after it are moved away, what is before it can be read"
    return DustError(f"{path} is damaged: it has not the bytes that were written. {what}.")


def _check_texts(path, file):
    """Raise DustError where an open file has lost its seal, or its texts have changed."""
    said = getattr(file, DIGEST, None)
    if said is None:
        return
    if said == SEALED:
        problem = "the sum of its bytes, which stood at its end, is gone"
    elif said != _digest_of_texts(file):
        problem = "its texts are not those that were written"
    else:
        return
    raise DustError(
        f"{path} is damaged, or another program has changed it: {problem}. If you have changed it "
        f"yourself, remove its attribute {DIGEST}, too; otherwise take it from a backup, or "
        "compute it anew (--force)."
    )


def _digest_of_texts(file):
    """Of all texts of an open file: its global attributes, and the names of entries."""
    attributes = {name: file.getncattr(name) for name in file.ncattrs()}
    texts = sorted((k, v) for k, v in attributes.items() if isinstance(v, str) and k != DIGEST)
    texts += [(n, v[:].tolist()) for n, v in file.variables.items() if v.dtype is str]
    return hashlib.sha256(json.dumps(texts).encode()).hexdigest()


def _digest(file, size):
    """SHA-256 of the first `size` bytes of an open file."""
    digest, buffer = hashlib.sha256(), memoryview(bytearray(BLOCK))
    file.seek(0)
    while size > 0 and (count := file.readinto(buffer[: min(BLOCK, size)])):
        digest.update(buffer[:count])
        size -= count
    return digest


def _read(file, start, size):
    file.seek(start)
    return file.read(size)
