"""The method `grains`: every grain is a sphere that is moved on its own, its contacts after JKR."""
