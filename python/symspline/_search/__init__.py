"""Searches along curves: nearest points, extrema, and times at which functions have given values."""
