"""Two problems of convection and diffusion with two parameters, and their reduced bases."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

import symspline as ss

Array = NDArray[np.float64]


class Problem(NamedTuple):
    """u' = A(μ)u from one initial state, and subspaces that contain nearly all of its path."""

    operator: Callable[[float, float], Array]
    """A of the logarithm of the diffusivity and a second parameter."""
    start: Array
    """The initial state, shape (n,)."""
    duration: float
    ranges: tuple[tuple[float, float], tuple[float, float]]
    """The ranges of both parameters."""
    bc_type: tuple[str, str]
    """End conditions of splines in both parameters."""
    rank: int
    """Dimension of the subspaces."""

    def path(self, operator: Array, start: Array, steps: int = 25) -> Array:
        """States at equidistant times in columns, for the whole operator or a reduced one."""
        step, states = expm(self.duration / steps * operator), [start]
        for _ in range(steps):
            states.append(step @ states[-1])
        return np.stack(states, axis=-1)

    def bases(self, *parameters: Array) -> Array:
        """The basis of a simulation for every pair of parameters, which broadcast."""
        pairs = np.broadcast(*parameters)
        snapshots = [self.path(self.operator(*pair), self.start) for pair in pairs]
        found = ss.subspaces.from_snapshots(snapshots, self.rank)
        return found.reshape(*pairs.shape, *found.shape[1:])


class Unseen:
    """Random parameters without nodes, with the whole solutions and the bases of their own simulations."""

    def __init__(self, problem: Problem, count: int) -> None:
        rng = np.random.default_rng(0)
        self.problem = problem
        self.parameters = np.stack([rng.uniform(*ends, count) for ends in problem.ranges])

    @cached_property
    def paths(self) -> list[Array]:
        """The solutions."""
        return [self.problem.path(self.problem.operator(*mu), self.problem.start) for mu in self.parameters.T]

    @cached_property
    def own(self) -> Array:
        """The bases of these solutions."""
        return ss.subspaces.from_snapshots(self.paths, self.problem.rank)

    def distances(self, bases: Array) -> Array:
        """Distance of each subspace from that of the simulation, in radians."""
        n, k = bases.shape[-2:]
        return np.asarray(ss.Grassmannian(k, n).distance(bases, self.own))

    def model_errors(self, bases: Array) -> Array:
        """Relative error of the solution of each reduced model."""
        errors = []
        for basis, mu, path in zip(bases, self.parameters.T, self.paths, strict=True):
            small = basis.T @ self.problem.operator(*mu) @ basis
            found = basis @ self.problem.path(small, basis.T @ self.problem.start)
            errors.append(np.linalg.norm(found - path) / np.linalg.norm(path))
        return np.array(errors)


def drift(n: int = 100) -> Problem:
    """A pulse on an interval: diffusivity 0.1 to 1, drift velocity 0 to 10."""
    z = np.linspace(0, 1, n + 2)[1:-1]
    first, second = _differences(n)
    return Problem(
        operator=lambda nu, c: np.exp(nu) * second - c * first,
        start=np.exp(-100 * (z - 0.4) ** 2),
        duration=0.1,
        ranges=((np.log(0.1), 0.0), (0.0, 10.0)),
        bc_type=("not-a-knot", "not-a-knot"),
        rank=4,
    )


def wind(n: int = 13) -> Problem:
    """A cloud on a square: diffusivity 0.2 to 1, wind of speed 10 from every direction."""
    z = np.linspace(0, 1, n + 2)[1:-1]
    first, second = _differences(n)
    one = np.eye(n)
    laplace = np.kron(second, one) + np.kron(one, second)
    x, y = np.kron(first, one), np.kron(one, first)
    return Problem(
        operator=lambda nu, angle: np.exp(nu) * laplace - 10 * (np.cos(angle) * x + np.sin(angle) * y),
        start=np.exp(-60 * ((z[:, None] - 0.5) ** 2 + (z - 0.5) ** 2)).ravel(),
        duration=0.04,
        ranges=((np.log(0.2), 0.0), (0.0, 2 * np.pi)),
        bc_type=("not-a-knot", "periodic"),
        rank=3,
    )


def _differences(n: int) -> tuple[Array, Array]:
    """Matrices of the first and second derivative between n inner nodes, with zero at both ends."""
    ahead, behind = np.eye(n, k=1), np.eye(n, k=-1)
    return (ahead - behind) * (n + 1) / 2, (ahead - 2 * np.eye(n) + behind) * (n + 1) ** 2
