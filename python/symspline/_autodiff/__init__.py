"""Curves with derivatives, written once for the arrays of JAX and of PyTorch.

A `library.Library` holds the functions that differ between the two. All of them have derivatives, also where points
coincide. `compiled` is what both need for derivatives of the compiled core.
"""
