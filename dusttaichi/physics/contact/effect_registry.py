"""Registry of the contact laws by effect and name, and the contact model of a scene.

A law is a module (or any object) with

- ``NUMBERS``: name -> Constant, the constants of a contact that it needs;
- ``numbers(c, block)``: a `ti.pyfunc` that returns their values as a dict. c: the contact
  (`constants.ContactConstants` by name), block: the keys of the law's block in the YAML; both in SI
  on the host, in internal units in a kernel;
- ``HISTORY``: name -> History, what a contact stores for it beside xi and zeta; ``CHANNEL``: name
  of the channel of the ledger for its losses;
- ``update(motion, history, constants, dt)``: brings the history to the present, limits it, and
  returns the energy dissipated; no force. motion: Motion (physics.contact.kinematics), constants:
  struct of the numbers of all effects;
- ``evaluate(motion, history, constants, load)``: adds the forces and torques of the configuration
  to a Load and returns the energy stored; no time step, no side effect.

It may have ``MATERIAL``: name -> Property, properties of the grains' material that it brings into
the YAML; c has them by name, mixed from those of the two materials.

It may have ``STIFFNESS``: "k_n", "k_s", "k_r" or "k_t" -> its number that adds to this spring, for
the choice of the time step.

A normal law has ``response`` and a damping law ``coefficient`` in place of the last three, see
NEEDED and the built-in laws. A law along the normal (``RADIAL``) may have ``form``, called for a
contact that has just formed, ``pending`` and ``push``, see physics.contact.asperities.

This module imports no Taichi: a law is imported on first use.
"""

from collections.abc import Iterable
from importlib import import_module
from typing import TYPE_CHECKING, Any

from dusttaichi.physics.contact.effect_numbers import Property
from dusttaichi.physics.registry import Registry

if TYPE_CHECKING:
    from dusttaichi.physics.contact.model import ContactModel
_EFFECT = ("HISTORY", "CHANNEL", "update", "evaluate")
NEEDED = {
    "normal": ("response", "rest", "curve"),
    "asperities": ("HISTORY", "CHANNEL", "update", "form", "pending"),
    "damping": ("coefficient",),
    "rolling": (*_EFFECT, "energy"),
    "sliding": (*_EFFECT, "energy"),
    "twisting": (*_EFFECT, "energy"),
    "effects": _EFFECT,
}
"""Parts that a law of each kind has beside NUMBERS and numbers, in the order in which they act.
`effects` are those that are registered beside the built-in kinds."""

EFFECTS = tuple(name for name in NEEDED if name != "effects")
DEFAULT = {
    "normal": "jkr",
    "rolling": "linear",
    "sliding": "linear",
    "twisting": "linear",
    "asperities": "pd08",
}
_HERE = "dusttaichi.physics.contact"
_BUILT_IN = {
    ("normal", "jkr"): f"{_HERE}.jkr",
    ("rolling", "linear"): f"{_HERE}.rolling",
    ("sliding", "linear"): f"{_HERE}.sliding",
    ("twisting", "linear"): f"{_HERE}.twisting",
    ("damping", "viscous"): f"{_HERE}.damping.viscous",
    ("damping", "scaled"): f"{_HERE}.damping.scaled",
    ("damping", "viscoelastic"): f"{_HERE}.damping.viscoelastic",
    ("asperities", "pd08"): f"{_HERE}.asperities",
}
LAWS: Registry[tuple[str, str], Any] = Registry(
    "law", _BUILT_IN, lambda law: import_module(law) if isinstance(law, str) else law
)
BLOCKS: Registry[tuple[str, str], type[Any] | None] = Registry("block of the law")


def register(effect: str, name: str, law: Any, block: type[Any] | None = None) -> None:
    """Add a law under a name that the YAML may give: `interaction: {rolling: {law: NAME}}`.

    law: module or other object as described above. block: a class derived from the effect's block
    (`scene.interaction.Effect` for rolling, sliding and twisting, `scene.interaction.NormalLaw`,
    `scene.interaction.Damping`) with the keys of the law; that class itself if the law has none of
    its own. A law that is registered again under its name replaces the former one; the built-in
    ones cannot be replaced. With effect = "effects" it acts beside the other effects, in YAML
    `interaction: {effects: {NAME: {...}}}`, with a block derived from `scene.fields.Block`. Raises
    ValueError for an unknown effect, a built-in name or a law that lacks a part.
    """
    if effect not in NEEDED:
        raise ValueError(f"effect = {effect!r}: one of {', '.join(NEEDED)} is needed")
    if effect == "effects" and (name in EFFECTS or block is None):
        raise ValueError(f"name = {name!r}: a name of its own is needed, and a block")
    if (effect, name) in LAWS.built_in:
        raise ValueError(f"name = {name!r}: {effect} has a built-in law of that name")
    required = ("NUMBERS", "numbers", *NEEDED[effect])
    missing = [attribute for attribute in required if not hasattr(law, attribute)]
    if missing:
        raise ValueError(f"the law {name!r} of {effect} lacks {', '.join(missing)}")
    LAWS.replace((effect, name), law)
    BLOCKS.replace((effect, name), block)


def names(effect: str) -> tuple[str, ...]:
    """Names of the laws of an effect."""
    return tuple(name for owner, name in LAWS if owner == effect)


def block_of(effect: str, name: str) -> type[Any] | None:
    """Class of the YAML block of a registered law; None for a built-in one."""
    return BLOCKS.get((effect, name))


def law_of(effect: str, name: str) -> Any:
    """The law; KeyError where there is none of that name."""
    return LAWS[effect, name]


def chosen_model(interaction: Any, newton_steps: int = 2) -> "ContactModel":
    """ContactModel of a scene's interaction."""
    from dusttaichi.physics.contact.damping import damping_of
    from dusttaichi.physics.contact.model import ContactModel

    effects = []
    for effect in EFFECTS:
        name = law_name(interaction, effect)
        if name is not None:
            law = law_of(effect, name)
            effects.append((effect, damping_of(law) if effect == "damping" else law))
    effects += [(name, law_of("effects", name)) for name in interaction.effects]
    return ContactModel(tuple(effects), newton_steps)


def properties() -> dict[str, Property]:
    """Name -> Property of the material that the registered laws bring in."""
    return _material_properties(LAWS.added.values())


def _material_properties(laws: Iterable[Any]) -> dict[str, Property]:
    """Name -> Property of registered laws; built-in ones have none."""
    return {name: p for law in laws for name, p in getattr(law, "MATERIAL", {}).items()}


def properties_of(interaction: Any) -> dict[str, Property]:
    """Name -> Property of the material that the laws of an interaction bring in."""
    laws_by_effect = [(effect, law_name(interaction, effect)) for effect in EFFECTS]
    laws_by_effect += [("effects", name) for name in interaction.effects]
    return _material_properties(LAWS.added[key] for key in laws_by_effect if key in LAWS.added)


def block_in(interaction: Any, effect: str) -> Any:
    """The block of an effect in the YAML: of a built-in kind, or of a registered effect by name."""
    return getattr(interaction, effect) if effect in EFFECTS else interaction.effects[effect]


def normal_law(interaction: Any) -> Any:
    """The normal law of an interaction."""
    return law_of("normal", law_name(interaction, "normal"))


def law_name(interaction: Any, effect: str) -> str | None:
    """Name of the law of an effect that the interaction has; None where it is off."""
    block = getattr(interaction, effect)
    if effect == "damping":
        return None if block.model == "none" else block.model
    return None if block is None else getattr(block, "law", DEFAULT[effect])


def numbers_of(model: "ContactModel", contact: Any) -> dict[str, float]:
    """Values of all numbers of a contact by name, SI; contact: ContactConstants."""
    out = {}
    for effect, law in model.effects:
        out |= law.numbers(contact, block_in(contact.interaction, effect))
    return out


def table_of_numbers() -> list[tuple[str, str, str, str, str]]:
    """Rows (effect, law, name, SI unit, meaning) of the numbers of all laws."""
    return [
        (effect, name, number, declared.unit, declared.meaning)
        for effect, name in LAWS
        for number, declared in law_of(effect, name).NUMBERS.items()
    ]
