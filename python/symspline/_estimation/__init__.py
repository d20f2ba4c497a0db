"""Estimation of curves from measurements of any kind."""

from .make import estimate

__all__ = ["estimate"]
