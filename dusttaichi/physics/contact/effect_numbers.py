"""Declarations of an effect: constants, history and material properties of a contact."""

from dataclasses import dataclass

SPRINGS = ("normal", "rolling", "sliding", "twisting")
CHANNELS = ("forming", "breaking", "damping", "rolling", "sliding", "twisting")
"""Springs of every contact, and channels of the ledger."""
EXTRA_CHANNELS = ("asperities",)  # of some scenes only


@dataclass(frozen=True)
class Constant:
    """A constant of a contact: its SI unit, such as "N/m", and its meaning."""

    unit: str
    meaning: str


@dataclass(frozen=True)
class Property:
    """A property of the grains' material that a law brings into the YAML: `material: {NAME: ...}`.

    dimension: name of a dimension of scene.quantities, such as "pressure". mixing: name of the rule
    (interface.MIXING) by which two materials have one value in their contact.
    """

    dimension: str
    meaning: str
    mixing: str = "arithmetic"


@dataclass(frozen=True)
class History:
    """A number that a contact keeps from step to step: SI unit, meaning, components (1 or 3).

    result: name of the variable under which /contacts of the result has it, from where samples take
    it along; "" for none. sign: -1 where the result has the opposite sign. odd: it changes sign
    where the two bodies change places, as a displacement of the first against the second does.
    """

    unit: str
    meaning: str
    components: int = 1
    result: str = ""
    sign: int = 1
    odd: bool = False
