"""Method 2: dust as a continuum, smoothed particle hydrodynamics with a porosity model."""
