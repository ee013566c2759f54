"""Which code computes a run: what it leaves behind fits no other."""

import hashlib
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import NamedTuple

from dusttaichi import method
from dusttaichi.run.same_scene import input_hashes
from dusttaichi.scene import extensions


@lru_cache(maxsize=1)
def package_hash():
    """Hash of the source of this package and of Taichi's version."""
    root, digest = Path(__file__).parents[1], hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    digest.update(metadata.version("taichi").encode())
    return digest.hexdigest()


def code_hash(scene):
    """Hash of all code that decides the numbers of a scene: the package, and what its method says
    that comes from outside, such as a law of the user's own, and the scene's extensions."""
    digest = hashlib.sha256(package_hash().encode())
    own = [(extensions.imported(path), path) for path in method.of(scene).code(scene)]
    # as they were imported, whatever has become of the files
    known = {*scene.imported, *(extension for extension, _ in own if extension is not None)}
    for content in sorted({extension.digest for extension in known}):
        digest.update(content.encode())
    for path in (path for extension, path in own if extension is None):
        digest.update(Path(path).read_bytes())
    return digest.hexdigest()


class Origin(NamedTuple):
    """Provenance of a run: the hash of its code, those of the files that it reads.

    Taken once, where a run is opened, whatever becomes of the files afterwards.
    """

    code: str
    inputs: list[str]

    @classmethod
    def of(cls, scene):
        return cls(code_hash(scene), input_hashes(scene))
