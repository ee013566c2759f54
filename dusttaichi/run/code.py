"""Identity of the code of a run, which its checkpoints require."""

import hashlib
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from dusttaichi import compiler, method
from dusttaichi.run.same_scene import input_hashes
from dusttaichi.scene import extensions


@lru_cache(maxsize=1)
def package_hash():
    """Hash of the source of this package, and of its compiler and that one's version."""
    root, digest = Path(__file__).parents[1], hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    digest.update(compiler.label().encode())
    return digest.hexdigest()


def code_hash(scene):
    """Hash of all code that determines the numbers of a scene.

    The package, external code of its method, such as laws of the user, and the extensions.
    """
    digest = hashlib.sha256(package_hash().encode())
    own = [(extensions.imported(path), path) for path in method.of(scene).code(scene)]
    # as imported, even if the files have changed since
    known = {*scene.imported, *(extension for extension, _ in own if extension is not None)}
    for content in sorted({extension.digest for extension in known}):
        digest.update(content.encode())
    for path in (path for extension, path in own if extension is None):
        digest.update(Path(path).read_bytes())
    return digest.hexdigest()


class Origin(NamedTuple):
    """Hashes of the code of a run and of its input files, when it was opened."""

    code: str
    inputs: list[str]

    @classmethod
    def of(cls, scene):
        return cls(code_hash(scene), input_hashes(scene))
