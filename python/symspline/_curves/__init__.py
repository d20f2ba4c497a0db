"""Curves in a space: knots, points and velocities in arrays, and fits through points.

`fit` computes them. Curves that the compiled core evaluates are `curve.CurveArrays`; those on a `Manifold`, and in
products with one, are in `on_manifold`, and their solver is in `manifold_fit`.
"""
