"""Curves on manifolds that consist of Python functions."""
