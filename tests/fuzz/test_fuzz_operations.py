"""The operations of spaces: any input gives valid numbers or an error."""

import pickle

import numpy as np
from cases import FAMILIES
from hypothesis import given
from hypothesis import strategies as st

import symspline as ss
from fuzz.outcomes import Refusal, attempt
from fuzz.places import joined, parts, points, spaces, vectors
from fuzz.values import GOOD, ODD, array_like, moods, nonsense, rarely, seeds

# Names of operations, and what they take: points, vectors at the first point, a number.
OPERATIONS = {
    "exp": "pv", "log": "pp", "geodesic": "ppt", "distance": "pp", "transvection": "pvp", "transport": "ppv",
    "inner": "pvv", "norm": "pv", "project": "p", "project_tangent": "pv", "check_point": "p", "check_tangent": "pv",
}  # fmt: skip
SCALARS, NOTHING = ("distance", "inner", "norm"), ("check_point", "check_tangent")
SHAPES = [(), (), (1,), (4,), (3, 1), (2, 3), (9,), (0,), (2, 0)]


@given(st.data())
def test_operations(data):
    draw = data.draw
    mood, space, name = draw(moods), draw(spaces), draw(st.sampled_from(sorted(OPERATIONS)))
    lead = draw(st.sampled_from(SHAPES))
    arguments, leads = [], []
    base = None
    for kind in OPERATIONS[name]:
        own = draw(st.sampled_from([lead, lead, lead[1:], ()]))
        if kind == "t":
            value = draw(array_like(np.random.default_rng(draw(seeds)).uniform(-2, 3, own), mood))
        else:
            arrays = []
            for i, factor in enumerate(parts(space)):
                if kind == "p":
                    arrays.append(draw(points(factor, own)))
                else:
                    own = leads[0]
                    arrays.append(draw(vectors(factor, base[i])))
            base = arrays if base is None else base
            value = joined(space, [draw(array_like(array, mood)) for array in arrays])
        arguments.append(value)
        leads.append(own)
    with np.errstate(**draw(st.sampled_from([{}, {"all": "raise"}]))):
        result = attempt(lambda: getattr(space, name)(*arguments), *arguments, wrong_types=mood == ODD)
    if isinstance(result, Refusal) or name in NOTHING:
        assert isinstance(result, Refusal) or result is None
        return
    arrays = (result,) if name in SCALARS else parts(result)
    for factor, array in zip(parts(space), arrays, strict=False):
        assert np.isfinite(array).all()
        assert array.dtype == (np.float64 if name in SCALARS else factor.dtype)
        if mood == GOOD:
            shape = np.broadcast_shapes(*leads)
            assert array.shape == (shape if name in SCALARS else shape + factor.point_shape)
    if name in ("distance", "norm"):
        assert (np.asarray(result) >= 0).all()
    if name == "project":
        for factor, array in zip(parts(space), arrays, strict=True):
            assert_on(factor, array)


def assert_on(space, array):
    """What is said to be points are points."""
    found = attempt(lambda: space.check_point(array))
    assert not isinstance(found, Refusal), f"{array} of {space}: {found.error}"


@given(st.data())
def test_random_points(data):
    draw = data.draw
    space, odd = draw(spaces), rarely(draw, 3)
    shape = draw(nonsense if odd else st.sampled_from([(), 0, 3, (2,), (2, 0), [2, 2], np.int64(4), (-1,), (2**62,)]))
    rng = draw(nonsense) if odd and rarely(draw, 3) else np.random.default_rng(0)
    p = attempt(lambda: space.random_point(rng, shape), wrong_types=odd)
    if isinstance(p, Refusal):
        return
    v = attempt(lambda: space.random_tangent(rng, p))
    assert not isinstance(v, Refusal)
    for factor, q, w in zip(*map(parts, (space, p, v)), strict=True):
        assert_on(factor, q)
        assert w.shape == q.shape and np.isfinite(w).all()


NAMES = [name for row in FAMILIES for name in row]
NUMBERS = [
    0, 1, 2, 3, 4, 10**6, 2**31, 2**32, 2**33, 10**12, 2**53, 2**62, 2**63 - 1, 2**63, 2**64 - 1, 2**64, 10**30,
]  # fmt: skip
STRANGE = ["s:" + "9" * 5000, "s:2 x ", "s:٢"]


@given(st.data())
def test_names(data):
    draw = data.draw
    if rarely(draw, 3):
        name = draw(st.one_of(nonsense, st.text(max_size=20), st.sampled_from(STRANGE)))
    else:
        numbers = draw(st.lists(st.one_of(st.sampled_from(NUMBERS), st.integers(-5, 9)), max_size=3))
        kind, colon = draw(st.sampled_from(NAMES)), draw(st.sampled_from([":", ": ", "", "::"]))
        one = kind + colon + ",".join(map(str, numbers))
        forms = [one, one.upper(), f" {one} ", f"{one} x {one}", f"{one}x{one}", f"{one} x s:2"]
        name = draw(st.sampled_from(forms))
    space = attempt(lambda: ss.space(name))
    if isinstance(space, Refusal):
        assert len(str(space.error)) < 2000
        return
    again = ss.space(name)
    assert space == again == ss.space(str(space)) == pickle.loads(pickle.dumps(space)) == eval(repr(space), vars(ss))
    assert hash(space) == hash(again)
    assert space.dim >= 1 and space.injectivity_radius > 0 and not space.curvature < 0
    shapes = [factor.point_shape for factor in parts(space)]
    assert all(n >= 1 for shape in shapes for n in shape)
    assert space.point_shape == (tuple(shapes) if isinstance(space, ss.Product) else shapes[0])
    for factor in parts(space):
        if np.prod(factor.point_shape, dtype=float) < 2**40:
            none = np.empty((0, *factor.point_shape))
            result = attempt(lambda factor=factor, none=none: factor.exp(none, none))
            assert isinstance(result, Refusal) or result.shape == none.shape
