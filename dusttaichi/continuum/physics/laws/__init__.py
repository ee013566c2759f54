"""The built-in laws of dust, one a file; `physics.registry` says what a law has."""
