"""Conversions: other coordinates of points, or an error."""

import inspect

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import symspline as ss
from fuzz.outcomes import Refusal, attempt
from fuzz.places import points
from fuzz.values import GOOD, ODD, array_like, moods, nonsense, rarely, seeds

# What they take: points of a space, or arrays made of these.
TAKEN = {
    "hyperboloid_to_ball": "h:3", "hyperboloid_to_half_space": "h:3", "ball_to_hyperboloid": "ball",
    "ball_to_half_space": "ball", "half_space_to_ball": "half", "half_space_to_hyperboloid": "half",
    "basis_to_projector": "cgr:2,4", "projector_to_basis": "projector", "state_to_density": "cp:2",
    "density_to_state": "density", "matrix_to_quaternion": "so:3", "quaternion_to_matrix": "s:3",
}  # fmt: skip


def test_all_are_here():
    # Totally geodesic parts and indefinite spaces have tests of their own.
    parts = {name for name in ss.convert.__all__ if any(word in name for word in ("siegel", "subspace", "reflection"))}
    assert set(TAKEN) | parts == set(ss.convert.__all__)


@st.composite
def taken(draw, what, shape):
    if ":" in what:
        return draw(points(ss.space(what), shape))
    if what == "projector":
        y = draw(points(ss.space(draw(st.sampled_from(["gr:1,3", "cgr:2,4"]))), shape))
        return y @ np.swapaxes(y, -1, -2).conj()
    if what == "density":
        y = draw(points(ss.space("cp:2"), shape))
        return y[..., :, None] * y[..., None, :].conj()
    rng = np.random.default_rng(draw(seeds))
    y = rng.standard_normal((*shape, 3)) * 10.0 ** draw(st.integers(-300, 300))
    if what == "half":
        return np.concatenate([y[..., :-1], np.abs(y[..., -1:])], axis=-1)
    return y / np.linalg.norm(y, axis=-1, keepdims=True) * draw(st.sampled_from([0.0, 0.3, 0.999999, 1 - 2**-53, 1.0]))


@given(st.data())
def test_convert(data):
    draw = data.draw
    mood, name = draw(moods), draw(st.sampled_from(sorted(TAKEN)))
    shape = draw(st.sampled_from([(), (1,), (3,), (2, 2), (0,)]))
    with np.errstate(all="ignore"):
        value = draw(array_like(draw(taken(TAKEN[name], shape)), mood))
    function, more = getattr(ss.convert, name), {}
    if "scalar_first" in inspect.signature(function).parameters:
        more["scalar_first"] = draw(nonsense if mood == ODD and rarely(draw) else st.booleans())
    with np.errstate(**draw(st.sampled_from([{}, {"all": "raise"}]))):
        result = attempt(lambda: function(value, **more), value, wrong_types=mood == ODD)
    if isinstance(result, Refusal):
        return
    assert np.isfinite(result).all()
    if mood == GOOD:
        assert result.shape[: len(shape)] == shape
