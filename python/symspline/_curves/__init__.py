"""Curves in a space: what a spline is made of, and how it is found from points.

`fit` computes them. The kinds of curves are in `core_curve` (computed by the compiled core), `reduced` (in the span of
the points) and `product` (one curve per factor). Curves on a `Manifold` are `manifolds._on_manifold.OnManifold`.
"""
