"""Formulas of geodesics and of the C² condition, written once for the arrays of JAX and of PyTorch.

A `library.Library` holds the functions that differ between the two. All of them have derivatives,
also where points coincide.
"""
