"""The built-in laws of dust, one a file; `physics.dust_laws` says what a law has."""
