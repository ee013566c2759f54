"""`dust extremes`: where runs are stable, refused, or stopped, cell by cell."""
