"""Curves in a space: what a spline is made of, and how it is found from points.

`fit` finds them; `plain`, `in_span` and `together` are their kinds.
"""
