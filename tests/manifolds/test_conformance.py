"""The public conformance test: the spaces of the library pass it, and incorrect ones fail."""

import numpy as np
import pytest
from cases import SINGLE
from made import ELLIPSOID, flat, twin
from refused import raises

import symspline as ss
from symspline.testing import check


@pytest.mark.parametrize("space", [*SINGLE, ss.Stiefel(2, 5), ss.Stiefel(3, 4)], ids=str)
def test_a_space_of_the_library_conforms(space):
    found = check(space)
    assert found.space == space and found.deviations.keys() == found.allowed.keys()
    # Far below what is allowed of spaces of others: rounding, in second differences too.
    bent = found.deviations["acceleration is continuous"]
    assert bent <= 1e-10
    rest = {law: value for law, value in found.deviations.items() if not law.startswith(("acc", "the order", "vel"))}
    assert max(rest.values()) <= 2e-11, rest
    assert "log inverts exp" in str(found)


def test_surfaces_conform():
    # Geodesics are integrated to some 1e-13.
    check(ELLIPSOID, length=0.15, tol=1e-9)


def test_a_manifold_without_random_points_needs_one():
    raises("made without project=", check, flat(3))
    check(flat(3), point=[1.0, 2.0, 3.0])
    raises("check each factor", check, "sphere:2 x r:2")


S2, SO3 = ss.Sphere(2), ss.SpecialOrthogonal(3)


def retraction(p, v):
    return S2.project(p + v)


def heavy(p, u, v):
    """A rigid body with two moments of inertia, left-invariant."""
    a, b = (np.swapaxes(p, -1, -2) @ x for x in (u, v))
    return SO3.inner(p, u, v) + a[..., 0, 1] * b[..., 0, 1]


def test_broken_laws_are_reported():
    for changes, law in [
        ({"exp": retraction}, "log inverts exp"),
        ({"log": lambda p, q: S2.project_tangent(p, q - p)}, "log inverts exp"),
        ({"log": lambda p, q: 1.001 * S2.log(p, q)}, "log inverts exp"),
        # A retraction and its inverse do not give geodesics.
        (
            {"exp": retraction, "log": lambda p, q: q / np.sum(p * q, -1, keepdims=True) - p},
            "geodesics go on as geodesics",
        ),
        ({"inner": lambda p, u, v: S2.inner(p, u, v) + 0.3 * u[..., 0] * v[..., 1]}, "inner is symmetric"),
        # Great circles are not geodesics of another metric.
        ({"inner": lambda p, u, v: S2.inner(p, u, v) + 0.3 * u[..., 0] * v[..., 0]}, "distance is symmetric"),
        ({"dlog": lambda p, q, w: S2.transport(q, p, w)}, "dlog is the derivative of log"),
        ({"project_tangent": lambda p, v: 0.9 * S2.project_tangent(p, v)}, "project_tangent is a projection"),
    ]:
        raises(rf"breaks the law that {law}.*: off by .*, allowed", check, twin(S2, **changes), error=AssertionError)


def test_geodesics_are_those_of_the_inner_product():
    """Free rotations of such a body have no constant axis."""
    raises("breaks the law that distance has its first variation", check, twin(SO3, inner=heavy), error=AssertionError)
    raises("inner must be positive", check, twin(S2, inner=lambda p, u, v: -S2.inner(p, u, v)))


def test_short_steps_are_looked_at():
    """A cut-off that takes short vectors for none is seen, and points that no spline joins break a law, too."""

    def exp(p, v):
        short = np.linalg.norm(v, axis=-1, keepdims=True) < 1e-8
        return np.where(short, p, S2.exp(p, v))

    raises("log inverts exp", check, twin(S2, exp=exp), error=AssertionError)
    noise = np.random.default_rng(0)

    def log(p, q):
        return S2.project_tangent(p, S2.log(p, q) + 1e-10 * noise.standard_normal(np.shape(p)))

    raises("breaks the law that", check, twin(S2, log=log), error=AssertionError, tol=1e-9)
