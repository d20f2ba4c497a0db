"""Functions of the user and their derivatives: by a function of the user, or by JAX."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .._base.arrays import as_array
from .._core import ValidationError
from .._spaces import Array, Doubles
from ..measure import Function

# Points, velocities or accelerations as the function receives them: one array, or one per factor.
Arrays = Array | tuple[Array, ...]

_NAMES = ("the points", "the velocities", "the accelerations")
# Derivatives are wrong if they differ from differences by more than the first fraction of their size and the second one
# of the largest.
_WRONG, _SMALL = 0.05, 1e-3


class Arguments(NamedTuple):
    """Arguments of the function.

    Attributes
    ----------
    motion : list
        Points, then velocities and accelerations if the function needs them.
    parameters : dict
        Values of the parameters.
    """

    motion: list[Any]
    parameters: dict[str, Doubles]

    def all(self) -> list[Any]:
        """Return the arguments in the order of the function."""
        return [*self.motion, self.parameters] if self.parameters else [*self.motion]

    def moved(self, direction: list[Any], step: float) -> Arguments:
        """Return the arguments after a step along a direction of the motion."""
        motion = []
        for arrays, changes in zip(self.motion, direction, strict=True):
            both = zip(_factors(arrays), _factors(changes), strict=True)
            moved = tuple(array + step * change for array, change in both)
            motion.append(moved if isinstance(arrays, tuple) else moved[0])
        return self._replace(motion=motion)

    def with_parameter(self, name: str, at: int, step: float) -> Arguments:
        """Return the arguments after a step of one entry of a parameter."""
        values = self.parameters[name].copy()
        values[at] += step
        return self._replace(parameters=self.parameters | {name: values})


class UserFunction:
    """A function of the user, with derivatives along directions of the motion."""

    def __init__(self, label: str, given: Function) -> None:
        self.label, self.given, self._is_checked = label, given, False

    def __call__(self, arguments: Arguments) -> Any:
        """Return the residuals, in double precision also if the function uses JAX."""
        if self.given.jacobian != "jax":
            return self.given.residual(*arguments.all())
        import jax

        with jax.enable_x64(True):
            return np.asarray(self.given.residual(*arguments.all()))

    def derivatives(self, arguments: Arguments, directions: list[list[Any]]) -> Doubles:
        """Return the derivatives along directions, and with respect to all parameters, shape (n, k, columns)."""
        if self.given.jacobian == "jax":
            return self._by_jax(arguments, directions)
        residuals = np.asarray(self(arguments))
        found = self._by_function(arguments, directions, residuals)
        if not self._is_checked:
            self._check(arguments, directions, residuals, found)
            self._is_checked = True
        return found

    # ---- derivatives by a function of the user ----

    def _by_function(self, arguments: Arguments, directions: list[list[Any]], residuals: Array) -> Doubles:
        assert callable(self.given.jacobian)
        given, every = self.given.jacobian(*arguments.all()), arguments.all()
        if len(every) == 1:
            given = (given,)
        if not isinstance(given, (tuple, list)) or len(given) != len(every):
            raise ValidationError(
                f"{self.label}.jacobian must return a tuple of {len(every)} derivatives, one per argument"
            )
        rows = residuals.reshape(len(residuals), -1)
        columns = np.zeros((*rows.shape, len(directions)))
        for nu, (arrays, derivatives) in enumerate(zip(arguments.motion, given, strict=False)):
            if derivatives is None:
                continue
            of_factors = derivatives if isinstance(arrays, tuple) else (derivatives,)
            if len(of_factors) != len(_factors(arrays)):
                raise ValidationError(
                    f"{self.label}.jacobian must return {len(_factors(arrays))} arrays for {_NAMES[nu]}, one per factor"
                )
            for factor, (array, derivative) in enumerate(zip(_factors(arrays), of_factors, strict=True)):
                if derivative is not None:
                    flat = self._read(derivative, residuals, array.shape[1:], _NAMES[nu])
                    moves = [_factors(direction[nu])[factor].reshape(len(rows), -1) for direction in directions]
                    columns += (np.conj(flat) @ np.stack(moves, axis=-1)).real
        if not arguments.parameters:
            return columns
        of_parameters = {} if given[-1] is None else given[-1]
        if not isinstance(of_parameters, dict) or not of_parameters.keys() <= arguments.parameters.keys():
            raise ValidationError(
                f"{self.label}.jacobian must return a dict with some of {[*arguments.parameters]} for the parameters"
            )
        blocks = [columns]
        for name, values in arguments.parameters.items():
            derivative = of_parameters.get(name)
            absent = np.zeros((*rows.shape, len(values)))
            blocks.append(absent if derivative is None else self._read(derivative, residuals, values.shape, repr(name)))
        return np.concatenate(blocks, axis=-1)

    def _read(self, derivative: ArrayLike, residuals: Array, shape: tuple[int, ...], what: str) -> Array:
        """Return derivatives, shape (n, k, numbers)."""
        name = f"{self.label}.jacobian: the derivative with respect to {what}"
        array, wanted = as_array(derivative, name), (*residuals.shape, *shape)
        if array.shape != wanted or array.dtype.kind not in "iufbc":
            raise ValidationError(
                f"{name} is {array.dtype} of shape {array.shape}, but numbers of shape {wanted} are needed"
            )
        bad = np.argwhere(~np.isfinite(array))
        if len(bad):
            at = tuple(map(int, bad[0]))
            raise ValidationError(
                f"{self.label}.jacobian: entry {list(at)} of the derivative with respect to {what} is {array[at]}. "
                "Return finite derivatives."
            )
        return array.reshape(*residuals.reshape(len(residuals), -1).shape, -1)

    def _check(self, arguments: Arguments, directions: list[list[Any]], residuals: Array, found: Doubles) -> None:
        """Raise an error if derivatives are far from central differences."""
        for column, (what, differences) in enumerate(self._differences(arguments, directions, residuals)):
            own = found[..., column]
            apart = np.abs(own - differences)
            least = _SMALL * (np.abs(differences).max() + np.abs(own).max()) + np.finfo(float).tiny
            bad = np.argwhere(apart > _WRONG * np.maximum(np.abs(own), np.abs(differences)) + least)
            if len(bad):
                i, j = map(int, bad[0])
                raise ValidationError(
                    f"{self.label}.jacobian is wrong: the derivative of residual [{i}, {j}] with respect to {what(i)} "
                    f"is {own[i, j]:.6g}, but {differences[i, j]:.6g} by differences of the function. Correct it, or "
                    "omit jacobian."
                )

    def _differences(
        self, arguments: Arguments, directions: list[list[Any]], residuals: Array
    ) -> Iterator[tuple[Callable[[int], str], Doubles]]:
        """Yield central differences and descriptions of what changes in a sample."""
        precision = residuals.dtype if residuals.dtype.kind == "f" else np.float64
        unit = float(np.finfo(precision).eps) ** (1 / 3)

        def difference(moved: Callable[[float], Arguments], size: float) -> Doubles:
            step = unit * (1 + size)
            after, before = (np.asarray(self(moved(side)), np.float64) for side in (step, -step))
            columns: Doubles = (after - before) / (2 * step)
            return columns.reshape(len(residuals), -1)

        for direction in directions:
            nu = next(nu for nu, arrays in enumerate(direction) if any(np.any(x) for x in _factors(arrays)))
            size = max(float(np.sqrt(np.mean(np.abs(x) ** 2))) for x in _factors(arguments.motion[nu]))

            def described(i: int, arrays: Any = direction[nu], name: str = _NAMES[nu]) -> str:
                entries = [np.round(x[i], 3).tolist() for x in _factors(arrays)]
                return f"{name} along {entries if isinstance(arrays, tuple) else entries[0]}"

            yield described, difference(partial(arguments.moved, direction), size)
        for name, values in arguments.parameters.items():
            for at, value in enumerate(values):
                what = f"entry {at} of {name!r}"
                moved = partial(arguments.with_parameter, name, at)
                yield partial(_constant, what), difference(moved, abs(float(value)))

    # ---- derivatives by JAX ----

    @cached_property
    def _differentiated(self) -> Callable[..., Any]:
        """The compiled derivative of the residuals with respect to numbers that multiply the directions."""
        import jax
        import jax.numpy as jnp

        def along(x: Any, motion: list[Any], directions: list[Any], parameters: dict[str, Any]) -> Any:
            count = jax.tree.leaves(directions)[0].shape[0]
            motion = jax.tree.map(lambda a, moves: a + jnp.tensordot(x[:count], moves, 1), motion, directions)
            moved, start = {}, count
            for name, values in parameters.items():
                moved[name] = values + x[start : start + len(values)]
                start += len(values)
            return jnp.asarray(self.given.residual(*Arguments(motion, moved).all()))

        return jax.jit(jax.jacfwd(along))

    def _by_jax(self, arguments: Arguments, directions: list[list[Any]]) -> Doubles:
        import jax

        with jax.enable_x64(True):
            stacked = jax.tree.map(lambda *moves: np.stack(moves), *directions)
            count = len(directions) + sum(map(len, arguments.parameters.values()))
            try:
                found = self._differentiated(np.zeros(count), arguments.motion, stacked, arguments.parameters)
            except jax.errors.JAXTypeError as error:
                reason = str(error).partition("\n")[0]
                raise ValidationError(
                    f"{self.label}: JAX cannot differentiate the function. Write it with jax.numpy, or pass "
                    f"jacobian as a function. JAX reports: {reason}"
                ) from error
        derivatives = np.asarray(found, np.float64)
        bad = np.argwhere(~np.isfinite(derivatives))
        if len(bad):
            raise ValidationError(
                f"{self.label}: the derivative of residual {bad[0][:-1].tolist()} by JAX is not finite. Rewrite the "
                "function there, or omit jacobian for central differences."
            )
        return derivatives.reshape(len(derivatives), -1, count)


def _constant(what: str, _: int) -> str:
    return what


def _factors(arrays: Any) -> tuple[Array, ...]:
    return arrays if isinstance(arrays, tuple) else (arrays,)
