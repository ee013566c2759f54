"""Thin loops: gather, call the physics, scatter. They contain no formula of physics."""
