"""Spaces as values: names, properties, and invalid spaces."""

import copy
import inspect
import pickle
import re

import numpy as np
import pytest
from cases import FAMILIES, INDEFINITE, LINEAR, SINGLE, SPACES, loop_over
from curves import every_space, points_on
from refused import INF, fit_error, raises

import symspline as ss

CLASSES = [
    cls
    for cls in vars(ss).values()
    if inspect.isclass(cls)
    and issubclass(cls, ss.Space)
    and cls not in (ss.Space, ss.Product, ss.Manifold, ss.Quotient)
]


def test_names_of_spaces():
    for name, space in [
        ("r:3", ss.Euclidean(3)),
        ("Sphere:2", ss.Sphere(np.int64(2))),
        ("h:4", ss.Hyperbolic(4)),
        ("sphere:3 x r:3", ss.Product(ss.Sphere(3), ss.Euclidean(3))),
        ("h:2 x sphere:2 x r:1", ss.Product(ss.Product("h:2", "sphere:2"), "r:1")),
    ]:
        assert ss.space(name) == space
        assert ss.CubicSpline(None, points_on(space, 3), name).space == space


@pytest.mark.parametrize("aliases", FAMILIES, ids=lambda aliases: aliases[0])
def test_names(aliases):
    short = aliases[0]
    names = [str(space) for space in SINGLE]
    sizes = [name.partition(":")[2] for name in names if name.partition(":")[0] == short]
    assert sizes
    for size in sizes:
        space = ss.space(f"{short}:{size}")
        assert str(space) == f"{short}:{size}"
        assert repr(space) == f"{type(space).__name__}({size.replace(',', ', ')})"
        for alias in aliases:
            for name in (f"{alias}:{size}", f" {alias.upper()} : {size.replace(',', ' , ')} "):
                assert ss.space(name) == space and hash(ss.space(name)) == hash(space)


@every_space
def test_spaces_as_values(space):
    assert ss.space(str(space)) == space and ss.space(space) is space
    assert eval(repr(space), vars(ss)) == space
    for made in (pickle.loads(pickle.dumps(space)), copy.copy(space), copy.deepcopy(space)):
        assert made == space and hash(made) == hash(space) and made.dim == space.dim
        assert type(made) is type(space) and repr(made) == repr(space)
    assert [other for other in SPACES if other == space] == [space]


def test_spaces_compare():
    assert len({*SPACES, *map(copy.copy, SPACES)}) == len(SPACES)
    assert ss.Sphere(2) != ss.Sphere(3)
    assert ss.Sphere(2) != ss.Hyperbolic(2)
    assert ss.Sphere(2) != "sphere:2"


def test_numbers_of_some_spaces():
    for space, point_shape, dtype, dim, radius, curvature in [
        (ss.Euclidean(3), (3,), float, 3, INF, 0),
        (ss.Sphere(2), (3,), float, 2, np.pi, 1),
        (ss.Hyperbolic(2), (3,), float, 2, INF, 1),
        (ss.Product(ss.Sphere(3), ss.Euclidean(2)), ((4,), (2,)), (float, float), 5, np.pi, 1),
        (ss.Product("h:2", "r:1", "h:3"), ((3,), (1,), (4,)), (float,) * 3, 6, INF, 1),
        (ss.space("u:2 x cp:1 x r:3"), ((2, 2), (2,), (3,)), (complex, complex, float), 9, np.pi / 2, 2),
        (ss.space("r:1 x se:2"), ((1,), (3, 3)), (float, float), 4, np.pi, np.nan),
    ]:
        assert (space.point_shape, space.dtype, space.dim) == (point_shape, dtype, dim)
        assert space.injectivity_radius == radius
        np.testing.assert_equal(space.curvature, curvature)


COMPLEX_FAMILIES = {"cp", "ch", "hp", "cgr", "u", "su", "hpd", "cgl"}


@pytest.mark.parametrize("space", SINGLE, ids=str)
def test_properties_of_spaces(space):
    family = str(space).partition(":")[0]
    p, rng = points_on(space), np.random.default_rng(0)
    assert p.shape[1:] == space.point_shape
    vectors = space.random_tangent(rng, np.broadcast_to(p[0], (2 * space.dim + 1, *p[0].shape)))
    assert np.linalg.matrix_rank(vectors.reshape(len(vectors), -1).view(float)) == space.dim
    assert space.dtype == (np.complex128 if family in COMPLEX_FAMILIES else np.float64)
    assert space.injectivity_radius > 0
    # Without an invariant metric that is positive definite there is no K.
    without = family == "se" or isinstance(space, (*LINEAR, *INDEFINITE))
    assert np.isnan(space.curvature) if without else space.curvature >= 0


@pytest.mark.parametrize(
    "space, match",
    [
        ("spere:2", r"unknown space 'spere:2'; did you mean 'sphere:2'\? known names are .*sphere.*, as in 'sphere:2'"),
        ("", r"unknown space ''"),
        ("sphere:2 x klein:2", r"unknown space 'klein:2'"),
        *((family, r"is a family of spaces; give its dimension, such as Sphere\(2\) or 'sphere:2'")
          for family in (ss.Sphere, "Sphere", "sphere", "sphere:")),
        (ss.Grassmannian, r"Grassmannian\(2, 4\) or 'gr:2,4'"),
        (ss.Product, "Product is a family of spaces"),
        (None, r"a space or its name is needed, not None"),
        (2, r"a space or its name is needed, not 2"),
        *((name, r"the parameters after the colon must be integers")
          for name in ("sphere:-1", "sphere:2.0", "gr:2.0,5", "gr:2;5", "cp:1xso:3", "sphere:٢")),
        *((name, r"put ' x ' between the factors of a product, as in 'so:3 x r:3'$")
          for name in ("so:3x r:3", "so:3 × r:3", "so:3*r:3")),
        ("sphere:2,3", r"'sphere:2,3': Sphere does not take 2 parameters"),
        ("gr:2", r"'gr:2': Grassmannian does not take 1 parameters"),
        ("so:2,3", r"'so:2,3': SpecialOrthogonal does not take 2 parameters"),
        ("gr:5,2", r"asks for subspaces larger than the space; did you mean Grassmannian\(2, 5\)\?"),
        ("cgr:5,2", r"did you mean ComplexGrassmannian\(2, 5\)\?"),
        ("gr:3,3", r"Grassmannian\(k, n\) needs 1 <= k < n; Grassmannian\(3, 3\) is a single point"),
        ("cgr:1,1", r"needs 1 <= k < n; ComplexGrassmannian\(1, 1\) is a single point"),
        ("gr:0,3", r"needs 1 <= k < n"),
        ("se:4", r"SpecialEuclidean\(n\) needs n = 2 or 3, not 4"),
        ("se:1", r"needs n = 2 or 3, not 1"),
        *((f"{name}:1", r"\(n\) needs n >= 2") for name in ("o", "so", "su")),
        *((f"{name}:0", r"\(n\) needs n >= ")
          for name in ("sphere", "rp", "cp", "o", "so", "u", "su", "spd", "hpd", "r", "h")),
        ("sp:3", r"Symplectic\(n\) needs an even n, not 3"),
        *((name, r"needs n") for name in ("sim:1", "sl:1", "lorentz:0", "aff:0", "ch:0")),
        ("ds:1", r"DeSitter\(n\) needs n >= 2, not 1"),
        ("ads:1", r"AntiDeSitter\(n\) needs n >= 2, not 1"),
        ("igr:2,0,1,2", r"needs a <= p, b <= q and 0 < a \+ b < p \+ q, not \(2, 0, 1, 2\)"),
        *((name, "0 < a") for name in ("igr:1,2,1,2", "igr:0,0,1,2")),
        ("cp:1 x ", r"unknown space"),
        *((name, r"too large") for name in ("so:99999999999", "gr:3,99999999999999999999", f"sphere:{2**64 - 1}")),
        ("sphere:" + "9" * 30, "too large"),
        *((wrong, f"did you mean '{meant}'\\?") for wrong, meant in (
            ("spher:2", "sphere:2"), ("SpecialOrthogonal:3", "so:3"), ("special_orthogonal:3", "so:3"),
            ("SO3", "so:3"), ("SPD(3)", "spd:3"), ("grasmannian:2,4", "grassmannian:2,4"),
            ("sphere:2 x euclid:3", "euclidean:3"), ("Spheres", "sphere"))),
    ],
    ids=str,
)  # fmt: skip
def test_invalid_spaces_raise(space, match):
    fit_error(match, space=space)
    raises(match, ss.space, space)


@loop_over("value", [-1, 2.0, "2", None, True])
@pytest.mark.parametrize("kind", [
    "Sphere", "Hyperbolic", "Euclidean", "Grassmannian", "SpecialOrthogonal", "Unitary", "SpecialEuclidean",
    "ComplexProjective"])  # fmt: skip
def test_invalid_sizes_raise(kind, value):
    cls = getattr(ss, kind)
    with pytest.raises(ss.ValidationError, match=rf"the parameters of {kind} must be integers >= 0, not {value!r}"):
        cls(value, 5) if kind == "Grassmannian" else cls(value)


@pytest.mark.parametrize("cls", CLASSES, ids=lambda cls: cls.__name__)
def test_missing_sizes_raise(cls):
    names = [*inspect.signature(cls).parameters]
    for numbers in ((), (2, 4, 5)):
        with pytest.raises(TypeError, match=rf"^{cls.__name__} takes {' and '.join(names)}, such as ") as caught:
            cls(*numbers)
    call, name = re.search(r"such as (.*) or '(.*)': \w.* \S", str(caught.value)).groups()
    made = ss.space(name)
    assert type(made) is cls and repr(made) == call
    # Names of numbers are taken, as before.
    numbers = map(int, str(made).partition(":")[2].split(","))
    assert cls(**dict(zip(names, numbers, strict=True))) == made
