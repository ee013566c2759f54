"""The seal at the end of a result file: the SHA-256 of its bytes, and its records.

HDF5 has a checksum of each chunk of numbers, but none of its texts and of some of its tables. If
those are damaged it may return wrong numbers or hang. A file is therefore opened only if it has the
bytes that were written. HDF5 ignores the bytes behind its end, where the seal is:

    bytes of HDF5 | seal, a JSON text | SHA-256 of that text | its length, 8 bytes | MAGIC

A program that changes the file by HDF5 removes the seal; an attribute shows that there was one.
Files of older versions without seals have a digest of their texts.
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
LARGEST = 4e9  # bytes up to which a file is verified before it is opened

_checked = {}  # path -> identity of the verified file


def sealed(blocks, about):
    """The blocks of bytes of a file, followed by their seal.

    about: further content of the seal, for JSON.
    """
    digest, size = hashlib.sha256(), 0
    for block in blocks:
        digest.update(block)
        size += len(block)
        yield block
    yield _seal(digest, size, about)


def seal_file(path, about):
    """Append the seal to a file. Raises OSError."""
    size = os.path.getsize(path)
    with open(path, "r+b", buffering=0) as file:
        digest = _digest(file, size)
        file.seek(size)
        file.write(_seal(digest, size, about))


def remove(path):
    """Remove the seal, so that HDF5 may append to the file. Raises OSError."""
    if (about := seal_of(path)) is not None:
        os.truncate(path, about["size"])


def _seal(digest, size, about):
    text = json.dumps({"sha256": digest.hexdigest(), "size": size, **about}).encode()
    return b"".join((text, hashlib.sha256(text).digest(), len(text).to_bytes(8, "little"), MAGIC))


def seal_of(path):
    """Content of the seal of a file, or None. The rest of the file may be damaged.

    Raises OSError; DustError where the seal itself is damaged.
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
    """The seal of a file, or None, after verification of its bytes.

    A file is verified once in a process, and again after a change. Raises OSError; DustError where
    it is damaged.
    """
    with open(path, "rb", buffering=0) as file:
        now = os.fstat(file.fileno())
        about = seal_of(path)
        identity = now.st_dev, now.st_ino, now.st_size, now.st_mtime_ns
        known = _checked.get(str(path)) == identity
        if about is None or known or about["size"] > LARGEST:
            return about
        if _digest(file, about["size"]).hexdigest() != about["sha256"]:
            # another file may have replaced it in between
            if os.stat(path).st_ino != now.st_ino:
                return check(path)
            raise damaged(path)
    _checked[str(path)] = identity
    return about


@contextmanager
def opened(path):
    """A result file that is open for reading.

    Raises
    ------
    OSError
        The file cannot be read.
    DustError
        The file is damaged.
    """
    about = check(path)
    with netCDF4.Dataset(path) as file:
        if about is None:
            _check_texts(path, file)
        yield file


def check_whole(path):
    """Verify a result file. Raises OSError; DustError where it is damaged."""
    if check(path) is None:
        with opened(path):
            pass


def damaged(path):
    """The DustError of a damaged file."""
    path, advice = Path(path), "Take it from a backup, or compute it again (--force)"
    if path.parent.suffix == ".parts":
        advice += "; without it and the parts after it the earlier records can be read"
    return DustError(f"{path} is damaged: its bytes are not those that were written. {advice}.")


def _check_texts(path, file):
    """Raise DustError where an open file has lost its seal, or its texts have changed."""
    digest = getattr(file, DIGEST, None)
    if digest is None:
        return
    if digest == SEALED:
        problem = "the checksum at its end is missing"
    elif digest != _digest_of_texts(file):
        problem = "its texts are not those that were written"
    else:
        return
    raise DustError(
        f"{path} is damaged, or another program has changed it: {problem}. If you have changed it "
        f"yourself, remove its attribute {DIGEST}, too; otherwise take it from a backup, or "
        "compute it again (--force)."
    )


def _digest_of_texts(file):
    """Digest of the texts of an open file: global attributes and names of entries."""
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
