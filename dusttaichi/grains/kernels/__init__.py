"""Thin loops: gather, call the physics, scatter. No formula of physics stands here."""
