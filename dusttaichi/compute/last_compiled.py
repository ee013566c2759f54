"""Cache of the last compile configuration of this process, for scenes that need the same."""

from dusttaichi.compute.engine import program
from dusttaichi.compute.memory import FieldAccess


class LastCompiled:
    """The last compile configuration of this process, reused if the next scene needs the same.

    Taichi has one program at a time: a simulation is unusable once another one is built, whether
    that compiles its own kernels or reuses the fields.
    """

    def __init__(self):
        self._compiled, self._access, self._program = None, None, None

    def of(self, compile_key):
        """The Compiled of that key; None if it has another key, or Taichi was restarted."""
        if self._compiled is None or self._compiled.compile_key != compile_key:
            return None
        return self._compiled if program() is self._program else None

    def tables(self, compiled, particles):
        """Tables of a Compiled for that many particles; earlier tables become unusable."""
        if self._access is not None:
            self._access.end()
        self._compiled, self._access = compiled, FieldAccess()
        self._program = program()
        return compiled.tables(particles, self._access)
