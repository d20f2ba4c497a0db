"""Block tridiagonal systems, solved in few operations on whole arrays, which suits GPUs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def cyclic_reduction(xp: Any, solve: Callable[..., Any], below: Any, diagonal: Any, above: Any, rows: Any) -> Any:
    """Solve block tridiagonal systems by eliminating every second unknown, again and again.

    Golub & Van Loan, *Matrix Computations* (4th edition), §4.5.4. It needs O(log n) operations on arrays, without
    pivoting between blocks: those of the C² condition are diagonally dominant for points that are not far apart.

    Parameters
    ----------
    xp : module
        ``jax.numpy`` or ``torch``.
    solve : callable
        ``solve(diagonal, *columns)`` returns the solutions of every block for several arrays of columns.
    below, diagonal, above : array, shape (n, ..., k, k)
        Blocks; below[0] and above[-1] must be zero.
    rows : array, shape (n, ..., k, m)
    """
    n = len(rows)
    if n == 1:
        return solve(diagonal, rows)[0]
    # For odd i, x_i = r − L x_{i−1} − U x_{i+1} with these three.
    odd = left, right, rest = solve(diagonal[1::2], below[1::2], above[1::2], rows[1::2])
    # Those before and after each even i; there is none before the first, and none after the last of an odd number.
    before, after = [], []
    for a in odd:
        zero = xp.zeros_like(a[:1])
        before.append(xp.concatenate([zero, a])[: (n + 1) // 2])
        after.append(xp.concatenate([a, zero])[: (n + 1) // 2])
    low, high = below[::2], above[::2]
    even = cyclic_reduction(
        xp,
        solve,
        -low @ before[0],
        diagonal[::2] - low @ before[1] - high @ after[0],
        -high @ after[1],
        rows[::2] - low @ before[2] - high @ after[2],
    )
    next_even = xp.concatenate([even[1:], xp.zeros_like(even[:1])])[: n // 2]
    found = rest - left @ even[: n // 2] - right @ next_even
    pairs = xp.stack([even[: n // 2], found], 1).reshape(2 * (n // 2), *even.shape[1:])
    return xp.concatenate([pairs, even[n // 2 :]])
