"""Curves and times under `jax.vmap`: which of its axes are axes of curves, and which only of times."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

Shape = tuple[int, ...]


class Layout(NamedTuple):
    """Where arrays of the core have the axes of `jax.vmap`.

    Those along which curves differ stand before the batch axes of the points. Along the others all times belong to
    the same curves, so that they are axes of the times.

    Attributes:
        curves: sizes of the axes along which curves differ, 1 along the others.
        times: sizes of the axes along which times differ, 1 along the others.
        batch: batch axes of the points passed to `symspline.jax.curve`.
    """

    curves: Shape
    times: Shape
    batch: Shape

    @property
    def full(self) -> Shape:
        """Sizes of all axes of `jax.vmap`."""
        return np.broadcast_shapes(self.curves, self.times)

    @property
    def _own(self) -> list[int]:
        return [i for i, size in enumerate(self.curves) if size != 1]

    @property
    def _shared(self) -> list[int]:
        return [i for i, size in enumerate(self.curves) if size == 1]

    def data(self, array: Any, core: int) -> Any:
        """Points, vectors or knots, one for every curve.

        Args:
            core: the number of axes behind the batch axes, of which there may be none.
        """
        lead = len(self.curves)
        missing = len(self.batch) - (array.ndim - lead - core)
        padded = array.reshape(*array.shape[:lead], *(1,) * missing, *array.shape[lead:])
        full = np.broadcast_to(padded, (*self.curves, *self.batch, *padded.shape[lead + len(self.batch) :]))
        return np.squeeze(full, axis=tuple(self._shared))

    def knots(self, t: Any) -> Any:
        """Knots, one row that all curves share where they do."""
        lead = len(self.curves)
        if t.ndim == lead + 1 and all(size == 1 for size in t.shape[:lead]):
            return t.reshape(-1)
        return self.data(t, 1)

    def sample_times(self, x: Any) -> tuple[Any, bool]:
        """Times, and whether every curve has its own."""
        own, shared, lead = self._own, self._shared, len(self.curves)
        x = np.transpose(x, (*own, *shared, *range(lead, x.ndim)))
        if all(self.times[i] == 1 for i in own):
            return x.reshape(x.shape[len(own) :]), False
        x = x.reshape(*x.shape[: len(own)], *(1,) * len(self.batch), *x.shape[len(own) :])
        curves = [self.curves[i] for i in own]
        return np.broadcast_to(x, (*curves, *self.batch, *x.shape[len(curves) + len(self.batch) :])), True

    def outward(self, values: Any) -> Any:
        """Values of the core with the axes of `jax.vmap` in front."""
        return np.transpose(values, np.argsort(self._order(values.ndim)))

    def inward(self, cotangent: Any) -> Any:
        """The inverse of `outward`."""
        return np.transpose(cotangent, self._order(cotangent.ndim))

    def _order(self, axes: int) -> list[int]:
        lead = len(self.curves)
        behind = lead + len(self.batch)
        return [*self._own, *range(lead, behind), *self._shared, *range(behind, axes)]

    def gradient(self, array: Any, core: int, kept: Shape, shape: Shape) -> Any:
        """The transpose of `data`: an array per curve, summed along the axes that curves share.

        Args:
            kept: sizes of the axes of `jax.vmap` that the sum keeps.
            shape: of the array without those axes.
        """
        array = np.expand_dims(array, tuple(self._shared))
        missing = len(self.batch) + core - len(shape)
        wanted = (*kept, *(1,) * missing, *shape)
        axes = tuple(i for i, (n, m) in enumerate(zip(array.shape, wanted, strict=True)) if n != m)
        return array.sum(axis=axes, keepdims=True).reshape(*kept, *shape)
