"""Curves in a space: knots, points and velocities in arrays, and fits through points.

`fit` fits curves. `core_curve`, `reduced` and `product` have the classes of curves.
"""
