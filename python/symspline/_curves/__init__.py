"""Curves in a space: knots, points and velocities in arrays, and fits through points.

`fit` computes them. The kinds of curves are in `curve` (computed by the compiled core, and products with one curve per
factor) and `reduced` (in the span of the points). Curves on a `Manifold` are `on_manifold.on_manifold.OnManifold`.
"""
