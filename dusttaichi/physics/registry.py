"""Registries: values by name, those of the package and those that a process adds to them.

Laws of contacts, kinds of samples, methods, numbers and figures are each in one. A file among the
`extensions` of a scene adds to them when it is imported.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Any, ClassVar, TypeVar

K = TypeVar("K")
V = TypeVar("V")


class Registry(Mapping[K, V]):
    """Values by name: the built-in ones, and then those that are `added`.

    word: for one of them in errors, such as "figure"; no two registries have the same. load: called
    with a built-in value when it is first looked up, and returns the value to use: values that are
    named, "module:attribute", are imported then.
    """

    registries: ClassVar[list["Registry[Any, Any]"]] = []

    def __init__(
        self,
        word: str,
        built_in: Mapping[K, Any] | None = None,
        load: Callable[[Any], V] = lambda value: value,
    ) -> None:
        self.word, self.load = word, load
        self.built_in: dict[K, Any] = dict(built_in or {})
        self.added: dict[K, V] = {}
        Registry.registries.append(self)

    def __getitem__(self, name: K) -> V:
        if name in self.added:
            return self.added[name]
        value = self.load(self.built_in[name])
        self.built_in[name] = value
        return value

    def __contains__(self, name: object) -> bool:
        return name in self.built_in or name in self.added

    def __iter__(self) -> Iterator[K]:
        yield from self.built_in
        yield from self.added

    def __len__(self) -> int:
        return len(self.built_in) + len(self.added)

    def replace(self, name: K, value: V) -> None:
        """Add a value, or put it in the place of the one that was added under the name.

        Raises ValueError for the name of a built-in one.
        """
        if name in self.built_in:
            raise ValueError(f"{name} is a {self.word} of this package; another name is needed")
        self.added[name] = value

    def add(self, name: K, value: V) -> None:
        """Add a value; the same one may be added again.

        Raises ValueError for the name of another one.
        """
        if name in self and self[name] != value:
            raise ValueError(f"there is a {self.word} {name}; another name is needed")
        if name not in self.built_in:
            self.added[name] = value

    def restore(self, added: Mapping[K, V]) -> None:
        """Return to the values that were `added` at an earlier time."""
        values = dict(added)
        self.added.clear()
        self.added.update(values)


def copy_added() -> dict[str, dict[Any, Any]]:
    """Copy the values `added` to each Registry, by its word."""
    return {registry.word: dict(registry.added) for registry in Registry.registries}


def restore_added(added: Mapping[str, Mapping[Any, Any]]) -> None:
    """Return to an earlier result of `copy_added`; a Registry that is new has nothing added."""
    for registry in Registry.registries:
        registry.restore(added.get(registry.word, {}))
