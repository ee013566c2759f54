"""Version of the program. With that of the compiler it is written to all results."""

__version__ = "1.0.0"
