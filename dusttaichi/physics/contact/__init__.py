"""The laws of a contact, one effect a file; `register` adds a law of your own."""

from dusttaichi.physics.contact.effect_registry import register

__all__ = ["register"]
