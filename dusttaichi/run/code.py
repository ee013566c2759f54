"""Which code computes a run: what it leaves behind fits no other."""

import hashlib
from functools import lru_cache
from importlib import metadata
from pathlib import Path

from dusttaichi import method


@lru_cache
def code_hash(name=method.DEFAULT):
    """Hash of the source of this package, of Taichi's version, and of a method's own files."""
    root, digest = Path(__file__).parents[1], hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    digest.update(metadata.version("taichi").encode())
    for path in method.named(name).code:
        digest.update(Path(path).read_bytes())
    return digest.hexdigest()
