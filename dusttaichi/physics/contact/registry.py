"""The laws that there are, by effect and name, and those that a scene has chosen.

A law is a module (or any object) with

- ``NUMBERS``: name -> Number, what a contact stores for the law;
- ``numbers(c, own)``: a `ti.pyfunc` that returns their values as a dict. c: the contact
  (`constants.ContactConstants` by name), own: the keys of the law's block in the YAML; both in SI
  on the host, in internal units in a kernel;
- the functions of its effect, see NEEDED. What they are given is told in the file of the built-in
  law; p holds all numbers of the contact.

This module imports no Taichi: a law is imported when it is first asked for.
"""

from dataclasses import dataclass
from importlib import import_module

NEEDED = {
    "normal": ("force", "energy", "contact_radius"),
    "rolling": ("displacement", "energy", "stiffness", "correct"),
    "sliding": ("displacement", "energy", "stiffness", "correct"),
    "twisting": ("energy", "stiffness", "correct"),
    "damping": ("coefficient",),
    "asperities": ("impulse",),
}
"""Functions that a law of each effect has."""

EFFECTS = tuple(NEEDED)
DEFAULT = {"rolling": "linear", "sliding": "linear", "twisting": "linear", "asperities": "pd08"}
_HERE = "dusttaichi.physics.contact"
LAWS = {
    ("normal", "jkr"): f"{_HERE}.normal",
    ("rolling", "linear"): f"{_HERE}.rolling",
    ("sliding", "linear"): f"{_HERE}.sliding",
    ("twisting", "linear"): f"{_HERE}.twisting",
    ("damping", "viscous"): f"{_HERE}.damping.viscous",
    ("damping", "scaled"): f"{_HERE}.damping.scaled",
    ("damping", "viscoelastic"): f"{_HERE}.damping.viscoelastic",
    ("asperities", "pd08"): f"{_HERE}.asperities",
}
BLOCKS = {}


def register(effect, name, law, block=None):
    """Add a law under a name that the YAML may give: `interaction: {rolling: {law: NAME}}`.

    law: module or other object as described above. block: a class derived from the effect's block
    (`scene.interaction.Effect` for rolling, sliding and twisting, `scene.interaction.Damping`) with
    the keys of the law; that class itself if the law has none of its own. A law that is registered
    again under its name replaces the former one; the built-in ones cannot be replaced.
    Raises ValueError for an effect that there is not, a built-in name or a law that lacks a part.
    """
    if effect not in NEEDED or effect == "normal":
        raise ValueError(f"effect = {effect!r}: one of {', '.join(EFFECTS[1:])} is needed")
    if isinstance(LAWS.get((effect, name)), str):
        raise ValueError(f"name = {name!r}: {effect} has a built-in law of that name")
    parts = ("NUMBERS", "numbers", *NEEDED[effect])
    missing = [part for part in parts if not hasattr(law, part)]
    if missing:
        raise ValueError(f"the law {name!r} of {effect} lacks {', '.join(missing)}")
    LAWS[effect, name] = law
    BLOCKS[effect, name] = block


def names(effect):
    """Names of the laws of an effect."""
    return tuple(name for own, name in LAWS if own == effect)


def block_of(effect, name):
    """Class of the YAML block of a registered law; None for a built-in one."""
    return BLOCKS.get((effect, name))


def law_of(effect, name):
    """The law; KeyError where there is none of that name."""
    law = LAWS[effect, name]
    return import_module(law) if isinstance(law, str) else law


@dataclass(frozen=True)
class ContactLaws:
    """The laws that the contacts of a scene are made of, None for an effect that is off."""

    normal: object
    rolling: object
    sliding: object
    twisting: object
    damping: object
    asperities: object
    newton_steps: int = 2  # of the contact radius

    @property
    def on(self):
        """(effect, law) of those that there are."""
        return tuple((e, getattr(self, e)) for e in EFFECTS if getattr(self, e) is not None)

    @property
    def numbers(self):
        """Name -> Number of all that a contact stores."""
        return {name: number for _, law in self.on for name, number in law.NUMBERS.items()}


def chosen_laws(interaction, newton_steps=2):
    """ContactLaws of a scene's interaction."""
    chosen = {"normal": law_of("normal", "jkr")}
    for effect in EFFECTS[1:]:
        name = law_name(interaction, effect)
        chosen[effect] = None if name is None else law_of(effect, name)
    return ContactLaws(**chosen, newton_steps=newton_steps)


def law_name(interaction, effect):
    """Name of the law of an effect that the interaction has; None where it is off."""
    block = getattr(interaction, effect)
    if effect == "damping":
        return None if block.model == "none" else block.model
    return None if block is None else getattr(block, "law", DEFAULT[effect])


def numbers_of(laws, contact):
    """Values of all numbers of a contact by name, SI; contact: ContactConstants."""
    out = {}
    for effect, law in laws.on:
        own = None if effect == "normal" else getattr(contact.interaction, effect)
        out |= law.numbers(contact, own)
    return out


def table_of_numbers():
    """Rows (effect, law, name, SI unit, meaning) of the numbers of all laws that there are."""
    return [
        (effect, name, number, declared.unit, declared.meaning)
        for effect, name in LAWS
        for number, declared in law_of(effect, name).NUMBERS.items()
    ]
