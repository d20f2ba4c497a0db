"""Grids: any nodes, masks and coordinates give values that are missing exactly where nodes are, or an error."""

import numpy as np
from grids.grid_fields import Field
from hypothesis import given, note
from hypothesis import strategies as st

import symspline as ss
from fuzz.outcomes import Refusal, attempt

NAMES = ("r:2", "sphere:2", "so:3", "spd:2", "h:2", "gr:1,3", "u:2", "se:2", "rp:2", "sphere:3 x r:2")
WORDS = ("not-a-knot", "natural", "clamped", "periodic", ("natural", "clamped"))
ODD = (np.nan, np.inf, 1e300, -1e300, 5e-324, 0.0)


def there(mask, axes, x, conditions):
    """Whether the value at one coordinate of each axis has the nodes that it needs."""
    for t, own, condition in zip(axes, x, conditions, strict=True):
        if condition == "periodic":
            own = t[0] + (own - t[0]) % (t[-1] - t[0]) if not t[0] <= own <= t[-1] else own
        i = int(np.clip(np.searchsorted(t, own, side="right") - 1, 0, len(t) - 2))
        both = mask[i] & mask[i + 1]
        exact = (mask[i] & (own == t[i])) | (mask[i + 1] & (own == t[i + 1]))
        mask = both | exact
    return bool(mask)


@given(st.integers(0, 2**63), st.sampled_from(NAMES))
def test_grids(seed, name):
    rng, space = np.random.default_rng(seed), ss.space(name)
    dims = rng.choice([1, 2, 2, 2, 3])
    shape = tuple(rng.integers(2, {1: 70, 2: 9, 3: 5}[dims], dims))
    scale = 10.0 ** rng.choice([-9, -3, 0, 0, 0, 3, 9])
    axes = [np.cumsum(10.0 ** rng.uniform(-0.4, 0.4, n)) * scale for n in shape]
    conditions = [WORDS[rng.integers(len(WORDS))] for _ in range(dims)]
    points = Field(space, int(rng.integers(99)), size=10.0 ** rng.uniform(-8, -0.5)).on(
        *(np.linspace(0, 1, n) for n in shape)
    )
    parts = list(points) if isinstance(points, tuple) else [points]
    mask = rng.uniform(size=shape) >= rng.choice([0, 0, 0.1, 0.5])
    for k, condition in enumerate(conditions):
        if condition == "periodic":
            for array in (mask, *parts):
                np.moveaxis(array, k, 0)[-1] = np.moveaxis(array, k, 0)[0]
    for part in parts:
        part[~mask] = np.nan
    if rng.random() < 0.1:
        parts[0].flat[rng.integers(parts[0].size)] = rng.choice(ODD)
    if rng.random() < 0.1:
        broken = axes[rng.integers(dims)]
        broken[rng.integers(len(broken))] = rng.choice(ODD)
    points = tuple(parts) if isinstance(points, tuple) else parts[0]
    note(f"{shape} {conditions} {mask.astype(int).tolist()}")
    options = {"symmetric": bool(rng.random() < 0.2), "on_failure": rng.choice(["raise", "warn"])}
    grid = attempt(lambda: ss.GridSpline(axes, points, name, bc_type=conditions, **options), *axes, *parts)
    if isinstance(grid, Refusal):
        note(repr(grid.error))
        return
    sound = grid.report.converged
    x = [t[0] + (t[-1] - t[0]) * rng.uniform(0, 1, 4) for t in axes]
    x = [np.where(rng.random(4) < 0.2, rng.choice(t, 4), own) for t, own in zip(axes, x, strict=True)]
    if rng.random() < 0.1:
        x[0][0] = rng.choice(ODD)
    nu = None if rng.random() < 0.5 else tuple(rng.multinomial(rng.integers(0, 3), np.ones(dims) / dims).tolist())
    outer = rng.random() < 0.5
    policy = [None, True, False, "geodesic", "periodic"][rng.integers(5)]
    found = attempt(
        lambda: grid.grid(*x, nu=nu, extrapolate=policy) if outer else grid(tuple(x), nu, extrapolate=policy)
    )
    if isinstance(found, Refusal):
        note(repr(found.error))
        return
    lead = (4,) * dims if outer else (4,)
    sites = np.stack(np.meshgrid(*x, indexing="ij") if outer else x, axis=-1).reshape(-1, dims)
    inside = all(((own >= t[0]) & (own <= t[-1])).all() for own, t in zip(x, axes, strict=True))
    valid = np.array([there(mask, axes, site, conditions) for site in sites]).reshape(lead)
    for factor, value in zip(
        getattr(space, "factors", (space,)), found if isinstance(found, tuple) else (found,), strict=True
    ):
        assert value.shape == lead + factor.point_shape
        if (
            not sound
            or not inside
            or options["on_failure"] != "raise"
            or (parts and not np.isfinite(parts[0][mask]).all())
        ):
            continue
        own = np.isfinite(value).all(axis=tuple(range(len(lead), value.ndim)))
        # Of derivatives, isolated nodes have none.
        assert not (own & ~valid).any()
        assert (nu and sum(nu)) or np.array_equal(own, valid)
