"""The method `grains`: every grain is a sphere with its own motion and JKR contacts."""
