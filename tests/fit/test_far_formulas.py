"""Formulas at arguments that other tests leave out: points far apart, poles, and the neighbourhood of cut loci."""

import numpy as np
import pytest
from cases import EPS, Case, closed_walk, condition, jumps, steep_tangent, unit_tangent, walk
from scipy.interpolate import BSpline as FlatBSpline
from test_derivatives import by_differences, data, inside, motion, moved
from test_solvers import zigzag

import symspline as ss


@pytest.fixture
def rng():
    return np.random.default_rng(1815)


# ---- derivatives beyond the power series ----

FAR = [
    *(
        ("sphere:2", 2.2),
        ("hyperbolic:2", 2.2),
        ("so:3", 2.4),
        ("rp:2", 1.3),
        ("gr:2,5", 1.3),
        ("cgr:2,4", 1.3),
    ),
    *(("so:5", 2.2), ("o:4", 2.2), ("u:1", 2.2), ("u:2", 2.2), ("u:5", 2.2), ("su:2", 2.8), ("su:3", 2.8)),
    *(("spd:2", 3.0), ("spd:3", 3.0), ("hpd:2", 3.0), ("hpd:5", 3.0), ("se:2", 2.6), ("se:3", 2.6)),
]


def far_control_points(space, step, rng):
    """Three points with steps in the direction of the nearest cut locus, and a turn of about 30°."""
    p = space.random_point(rng) if np.isfinite(space.injectivity_radius) else walk(space, 0.1, 1, rng)[0]
    v = steep_tangent(space, p, rng)
    if isinstance(space, ss.SpecialEuclidean):
        v = v.copy()
        # Mostly a rotation.
        v[:-1, -1] *= 0.3
        v /= space.norm(p, v)
    q = space.project(space.exp(p, step * v))
    w = space.project_tangent(q, space.transport(p, q, v) + 0.5 * unit_tangent(space, q, rng))
    return np.array([p, q, space.project(space.exp(q, step * w / space.norm(q, w)))])


@pytest.mark.parametrize(("name", "step"), FAR)
def test_derivatives_far_apart(name, step, rng):
    space = ss.space(name)
    for _ in range(5):
        curve = ss.BezierCurve(far_control_points(space, step, rng), space)
        x = np.array([0.05, 0.15, 0.3, 0.7, 0.85, 0.95])
        y = curve(x)

        def differences(h, curve=curve, x=x, y=y):
            plus, minus = (space.log(y, curve(x + s * h)) for s in (1, -1))
            return (plus - minus) / (2 * h), (plus + minus) / h**2

        (d1, d2), (half1, half2) = differences(0.01), differences(0.005)
        velocity, acceleration = curve(x, 1), curve(x, 2)
        scale = np.abs(acceleration).max() + np.abs(velocity).max()
        assert np.abs((4 * half1 - d1) / 3 - velocity).max() <= 1e-5 * scale
        assert np.abs((4 * half2 - d2) / 3 - acceleration).max() <= 1e-4 * scale


# ---- poles and cut loci ----


@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("gap", [0.0, 1e-15, 1e-12, 1e-8, 1e-4, 1e-2])
def test_a_curve_that_starts_at_the_far_pole(n, gap, rng):
    """Frames start at either pole: what is there is a reflection of what is elsewhere."""
    space = ss.Sphere(n)
    p = walk(space, 0.5, 8, rng)
    pole = np.zeros(n + 1)
    pole[:2] = -np.cos(gap), np.sin(gap)
    mirror = (p[0] - pole) / np.linalg.norm(p[0] - pole)

    def reflected(x):
        return x - 2 * np.multiply.outer(x @ mirror, mirror)

    there = space.project(reflected(p))
    there[0] = pole
    one, other = (ss.CubicSpline(None, points, space) for points in (p, there))
    x = np.linspace(0, 7, 50)
    for nu in range(3):
        assert np.abs(reflected(one(x, nu)) - other(x, nu)).max() <= 100 * 10**nu * EPS


@pytest.mark.parametrize("gap", [10.0**e for e in range(-7, 0)])
def test_geodesics_between_nearly_opposite_points(gap, rng):
    space = ss.Sphere(3)
    p = space.random_point(rng)
    q = space.exp(p, (np.pi - gap) * unit_tangent(space, p, rng))
    t = np.array([-0.2, 0.1, 0.5, 0.8, 1.0])
    ray = space.exp(p, t[:, None] * space.log(p, q))
    # Between opposite points every direction is as good.
    assert np.abs(space.geodesic(p, q, t) - ray).max() <= 20 * EPS / gap


@pytest.mark.parametrize("n", [8, 9, 12])
@pytest.mark.parametrize("gap", [1.0, 1e-2, 1e-6])
def test_special_unitary_phases_that_are_all_small(n, gap, rng):
    """n phases of 2π/n add up to 2π: however small they are, one of them is a turn off."""
    space = ss.SpecialUnitary(n)
    p, turn = space.random_point(rng), ss.Unitary(n).random_point(rng)
    part = (2 * np.pi - gap) / n
    phases = np.array([(n - 1) * part, *[-part] * (n - 1)])
    v = space.project_tangent(p, p @ (turn * (1j * phases)) @ turn.conj().T)
    q = space.exp(p, v)
    assert np.abs(space.log(p, q) - v).max() <= 50 * EPS * n / min(1.0, gap)
    assert abs(space.distance(p, q) - np.linalg.norm(phases)) <= 50 * EPS * n


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("gap", [1e-2, 1e-6, 1e-10, 1e-14])
@pytest.mark.parametrize("name", ["so:3", "se:3"])
def test_half_turns_about_each_axis(name, axis, gap, rng):
    """Of the four formulas for the quaternion of a matrix only one keeps its digits there."""
    space = ss.space(name)
    omega = np.cross(np.eye(3), -(np.pi - gap) * np.eye(3)[axis])
    p = np.eye(space.point_shape[0])
    v = np.zeros_like(p)
    v[:3, :3] = omega
    if name == "se:3":
        v[:3, 3] = rng.standard_normal(3)
    q = space.exp(p, v)
    assert np.abs(space.log(p, q) - v).max() <= 50 * EPS
    assert np.abs(space.exp(p, space.log(p, q)) - q).max() <= 50 * EPS


# ---- loops: frames come back turned, unlike there and back ----

LOOPS = [
    "sphere:2",
    "hyperbolic:2",
    "so:3",
    "rp:2",
    "cp:2",
    "gr:2,5",
    "su:2",
    "u:2",
    "spd:2",
    "hpd:2",
    "se:3",
]


def loop(space, n, rng, size=0.5):
    """Points around a circle, and times."""
    o = walk(space, 0.1, 1, rng)[0]
    a = unit_tangent(space, o, rng)
    b = unit_tangent(space, o, rng)
    b = b - space.inner(o, a, b) * a
    angle = 2 * np.pi * np.arange(n) / n
    v = np.multiply.outer(np.cos(angle), a) + np.multiply.outer(np.sin(angle), b / space.norm(o, b))
    p = space.project(space.exp(o, size * v))
    return np.cumsum(rng.uniform(0.7, 1.3, n + 1)), np.concatenate([p, p[:1]])


@pytest.mark.parametrize("method", ["fixed-point", "quasi-newton", "newton"])
@pytest.mark.parametrize("n", [3, 4, 5, 9])
@pytest.mark.parametrize("name", LOOPS)
def test_a_loop_is_c2(name, n, method, rng):
    space = ss.space(name)
    t, p = loop(space, n, rng)
    spline = ss.CubicSpline(t, p, space, bc_type="periodic", method=method, tol=0.0)
    assert max(jumps(spline)) <= 1.0
    if method == "newton":
        # Quadratic convergence, across the seam too.
        assert ss.CubicSpline(t, p, space, bc_type="periodic", method=method).report.iterations <= 7


@pytest.mark.parametrize("nu", [0, 1])
@pytest.mark.parametrize("name", LOOPS)
def test_derivatives_of_a_loop(name, nu, rng):
    space = ss.space(name)
    t, p = loop(space, 6, rng)
    change = motion(space, t, p, "periodic", rng)
    x = inside(t, rng)
    spline = ss.CubicSpline(t, p, space, bc_type="periodic")
    found = spline.jvp(x, *change, nu)
    expected = by_differences(space, t, p, "periodic", change, x, nu)
    assert np.abs(found - expected).max() <= 1e-8 * max(1.0, np.abs(expected).max())
    cotangent = rng.normal(size=found.shape) + (
        1j * rng.normal(size=found.shape) if found.dtype == complex else 0
    )
    gradient = spline.vjp(x, cotangent, nu)
    left, *right = (
        np.vdot(a, b).real
        for a, b in ((cotangent, found), (gradient.points, change[0]), (gradient.t, change[1]))
    )
    assert abs(left - sum(right)) <= 1e-12 * np.linalg.norm(cotangent) * np.linalg.norm(found)


@pytest.mark.parametrize("name", ["rp:2", "cp:2", "gr:2,5", "cgr:2,4"])
def test_derivatives_of_a_loop_that_ends_in_another_array(name, rng):
    space = ss.space(name)
    t, p = loop(space, 5, rng)
    vectors, knots, _ = motion(space, t, p, "periodic", rng)
    turn = ss.space("u:2" if name.startswith("cgr") else "o:2").random_point(rng)
    turn = {"rp:2": -1.0, "cp:2": np.exp(0.7j)}.get(name, turn)

    def other(x):
        return np.concatenate([x[:-1], [x[-1] @ turn if np.ndim(turn) else x[-1] * turn]])

    x = inside(t, rng)
    one, two = (ss.CubicSpline(t, points, space, bc_type="periodic") for points in (p, other(p)))
    for nu in (0, 1):
        here, there = one.jvp(x, vectors, knots, nu=nu), two.jvp(x, other(vectors), knots, nu=nu)
        assert np.abs(space.transport(two(x), one(x), there) - here).max() <= 1e-12 * np.abs(here).max()


# ---- solvers ----


@pytest.mark.parametrize("ends", ["natural", "clamped", "not-a-knot", "periodic", "mixed"])
@pytest.mark.parametrize("n", [4, 5, 12])
def test_quasi_newton_takes_one_step_in_flat_space(n, ends, rng):
    t, p = np.cumsum(rng.uniform(0.2, 2, n)), rng.standard_normal((n, 2))
    if ends == "periodic":
        p[-1] = p[0]
    bc = ("not-a-knot", (1, p[0])) if ends == "mixed" else ends
    spline = ss.CubicSpline(t, p, "r:2", bc_type=bc, method="quasi-newton")
    assert spline.report.iterations == 2


def test_the_rate_is_the_mean_contraction(rng):
    p = walk(ss.Sphere(2), 0.4, 20, rng)
    options = {"method": "fixed-point", "on_failure": "ignore"}
    done = ss.CubicSpline(None, p, "sphere:2", **options).report
    second = ss.CubicSpline(None, p, "sphere:2", max_iter=2, **options).report.residual
    assert done.rate == pytest.approx((done.residual / second) ** (1 / (done.iterations - 2)), rel=1e-12)


# ---- what is beside a space ----


@pytest.mark.parametrize(
    "name", ["so:2", "so:3", "so:5", "o:4", "u:3", "su:3", "gr:2,5", "cgr:2,4", "rp:3", "cp:2"]
)
def test_projection_is_the_nearest_point(name, rng):
    space = ss.space(name)
    for size in (1e-6, 1e-2, 0.15):
        p = space.random_point(rng)
        noise = rng.standard_normal(p.shape)
        if p.dtype.kind == "c":
            noise = noise + 1j * rng.standard_normal(p.shape)
        x = (1.2 if size > 0.1 else 1.0) * p + size * noise
        u, _, w = np.linalg.svd(x.reshape(len(x), -1), full_matrices=False)
        nearest = (u @ w).reshape(p.shape)
        if name.startswith("su"):
            nearest = nearest * np.exp(-1j * np.angle(np.linalg.det(nearest)) / len(p))
        assert np.abs(space.project(x) - nearest).max() <= 20 * EPS


@pytest.mark.parametrize("r", [0.5, 5.0, 12.0])
def test_tangent_vectors_of_hyperbolic_space_may_be_rounded(r):
    """Where numbers are large, so is the rounding of ⟨p, v⟩."""
    p, v = np.array([np.cosh(r), np.sinh(r), 0.0]), [np.sinh(r), np.cosh(r), 0.3]
    ss.Hyperbolic(2).check_tangent(p, np.array([float(f"{x:.10g}") for x in v]))


@pytest.mark.parametrize(
    ("name", "angles", "most"),
    [
        # A plane turns by its largest angle, whatever the others.
        ("gr:2,5", [1.0, 1.0], np.pi / 2),
        ("cgr:2,4", [1.0, 0.9], np.pi / 2),
        # Eigenvalues meet when their phases are 2π apart.
        ("su:3", [1.0, -1.0, 0.0], np.pi),
        ("su:3", [1.0, -0.5, -0.5], 4 * np.pi / 3),
        ("u:3", [1.0, -1.0, 0.9], np.pi),
    ],
)
def test_end_velocities_are_too_fast_from_the_cut_locus_on(name, angles, most, rng):
    space = ss.space(name)
    p = walk(space, 0.1, 4, rng)
    k = len(angles)
    if name[0] in "gc":
        u, _, w = np.linalg.svd(space.random_tangent(rng, p[0]), full_matrices=False)
        v = (u * angles) @ w
    else:
        turn = ss.Unitary(k).random_point(rng)
        v = p[0] @ (turn * (1j * np.array(angles))) @ turn.conj().T
    v = space.project_tangent(p[0], v)
    # The leg is a third of the velocity.
    ss.CubicSpline(None, p, space, bc_type=((1, 3 * 0.98 * most * v), "natural"), on_failure="ignore")
    with pytest.raises(ss.ValidationError, match="too fast"):
        ss.CubicSpline(None, p, space, bc_type=((1, 3 * 1.02 * most * v), "natural"), on_failure="ignore")


@pytest.mark.parametrize("ends", ["periodic", "clamped"])
@pytest.mark.parametrize("name", ["r:2", "sphere:2", "so:3", "su:2", "spd:2", "gr:2,5", "hyperbolic:2"])
def test_there_and_back_stands_still_at_every_knot(name, ends, rng):
    """All velocities are rounding errors then, and so is their defect."""
    space = ss.space(name)
    for step in (1e-3, 0.3, 1.0):
        p = walk(space, step, 2, rng)[[0, 1, 0]]
        report = ss.CubicSpline(None, p, space, bc_type=ends).report
        assert report.converged and report.residual <= 1e-12


@pytest.mark.parametrize("part", [0.5, 0.93, 0.97, 0.995])
def test_given_velocities_stay_near_the_cut_locus(part, rng):
    p = walk(ss.Sphere(2), 0.3, 5, rng)
    v = 3 * part * np.pi * unit_tangent(ss.Sphere(2), p[0], rng)
    spline = ss.CubicSpline(None, p, "sphere:2", bc_type=((1, v), "natural"), on_failure="ignore")
    assert np.abs(spline.velocities[0] - v).max() <= 1e-12 * np.abs(v).max()


@pytest.mark.parametrize(("name", "step"), [("hyperbolic:2", 12.0), ("spd:3", 14.0)])
def test_very_far_points_converge_to_their_rounding(name, step):
    """What rounding does to a residual grows with the length of chords, and is no failure."""
    space = ss.space(name)
    origin = np.eye(*(3,) * 2) if name == "spd:3" else np.array([1.0, 0, 0])
    for seed in range(20):
        rng = np.random.default_rng(seed)
        p = [space.exp(origin, step / 2 * unit_tangent(space, origin, rng)) for _ in range(5)]
        assert ss.CubicSpline(None, np.array(p), space).report.converged


def test_legs_that_doubles_cannot_hold():
    p = [np.eye(2), np.diag([2.0, 0.5])]
    with pytest.raises(ss.ConvergenceError, match=r"control leg at points\[0\] has length 21\.2"):
        ss.CubicSpline(None, p, "spd:2", bc_type=((1, np.diag([45.0, -45.0])), "natural"))
    assert ss.CubicSpline(None, p, "spd:2", bc_type=((1, np.diag([30.0, -30.0])), "natural")).report.converged


@pytest.mark.parametrize("step", [1.3, 1.5, 1.8])
def test_pieces_of_a_long_zigzag_agree(step):
    """What happens at a knot fades slowly along a zigzag: the first overlap of the pieces is too short."""
    spline = ss.CubicSpline(None, zigzag(step, 1301, 0.001), "sphere:2")
    assert max(jumps(spline)) <= 1.0


@pytest.mark.parametrize("name", ["gr:3,8", "cgr:3,8", "so:8", "u:8", "su:8", "rp:7"])
def test_random_points_are_on_the_space_to_rounding(name, rng):
    space = ss.space(name)
    x = space.random_point(rng, 200)
    x = x[..., None] if x.ndim == 2 else x
    assert np.abs(x.conj().swapaxes(-1, -2) @ x - np.eye(x.shape[-1])).max() <= 20 * EPS


@pytest.mark.parametrize("method", ["fixed-point", "quasi-newton", "newton"])
def test_it_does_not_matter_where_a_closed_curve_starts(method, rng):
    """The residual of an unfinished curve is the largest of all knots, that of the seam among them."""
    h, p = rng.uniform(0.7, 1.3, 6), walk(ss.Sphere(2), 0.7, 6, rng)
    found = []
    for k in range(6):
        points, steps = np.roll(p, -k, axis=0), np.roll(h, -k)
        t = np.concatenate([[0.0], np.cumsum(steps)])
        closed = np.concatenate([points, points[:1]])
        options = {"method": method, "bc_type": "periodic", "max_iter": 2, "on_failure": "ignore"}
        found.append(ss.CubicSpline(t, closed, "sphere:2", **options).report.residual)
    assert np.ptp(found) <= 1e-12 * found[0]


def test_a_linear_solver_stops_well_below_the_tolerance(rng):
    """A residual of the tolerance would be a jump of twelve times that."""
    for _ in range(5):
        p = walk(ss.Sphere(2), 0.5, 20, rng)
        spline = ss.CubicSpline(None, p, "sphere:2", method="fixed-point")
        assert max(jumps(spline)) <= 1.0


# ---- few points, large matrices ----


@pytest.mark.parametrize("nu", [0, 1])
@pytest.mark.parametrize("n", [2, 3, 4])
@pytest.mark.parametrize("end", ["not-a-knot", "mixed", "turned", "natural", "accelerations"])
@pytest.mark.parametrize("name", ["r:1", "sphere:2", "so:3", "gr:2,5", "se:3", "spd:2"])
def test_derivatives_of_curves_of_few_points(name, end, n, nu):
    case = Case(name)
    rng = np.random.default_rng(14)
    space, t, p, bc = data(case, end, n=n)
    change = motion(space, t, p, bc, rng)
    x = inside(t, rng)
    found = moved(space, t, p, bc, change, 0.0).jvp(x, *change, nu)
    expected = by_differences(space, t, p, bc, change, x, nu)
    assert np.abs(found - expected).max() <= 1e-8 * max(1.0, np.abs(expected).max())


@pytest.mark.parametrize("length", [1e-6, 0.3, 1.4])
@pytest.mark.parametrize(
    "name", ["so:11", "u:11", "su:13", "spd:11", "hpd:11", "gr:11,23", "cgr:11,22", "gr:5,31"]
)
def test_large_matrices_of_odd_size(name, length, rng):
    """Products of large matrices go by blocks of columns, which need not divide their number."""
    space = ss.space(name)
    p = walk(space, 0.1, 1, rng)[0]
    v = length * unit_tangent(space, p, rng)
    q = space.exp(p, v)
    space.check_point(q)
    allowed = 200 * EPS * condition(space, [p, q])
    assert np.abs(space.log(p, q) - v).max() <= allowed
    assert abs(space.distance(p, q) - length) <= allowed
    assert abs(space.norm(q, space.transport(p, q, v)) - length) <= allowed


# ---- times ----


@pytest.mark.parametrize("start", [-2.75, 0.0, 1.25])
def test_time_wraps_around_from_any_first_knot(start, rng):
    p = walk(ss.Sphere(2), 0.5, 5, rng)
    t = start + np.array([0.0, 1.0, 1.5, 3.0, 4.0])
    spline = ss.CubicSpline(t, [*p[:4], p[0]], "sphere:2", bc_type="periodic", extrapolate="periodic")
    x = start + np.array([0.25, 1.75, 3.5])
    for turns in (-2, -1, 1, 3):
        assert np.array_equal(spline(x + 4.0 * turns), spline(x))


def test_a_leg_is_measured_by_the_longer_of_its_segments():
    """On the hyperbolic line the spline is that of flat space: a short segment makes the next one overshoot."""
    space, x = ss.Hyperbolic(1), 0.8 * np.arange(5)
    p = np.stack([np.cosh(x), np.sinh(x)], axis=-1)
    with pytest.raises(ss.ConvergenceError, match=r"control leg at points\[[12]\] has length"):
        ss.CubicSpline([0, 1, 1.05, 5.05, 6.05], p, space)


def test_a_fault_of_a_long_closed_curve_is_named_where_it_is(rng):
    p = closed_walk(ss.Sphere(2), 0.1, 1300, rng)
    p[6] = -p[5]
    with pytest.raises(ss.CutLocusError, match=r"points\[5\] and points\[6\]"):
        ss.CubicSpline(None, p, "sphere:2", bc_type="periodic")


def test_a_bspline_that_ends_at_a_knot_that_repeats(rng):
    """Knots go on beyond the end, where intervals are empty."""
    knots, points = np.array([0.0, 1, 2, 3, 3, 3, 4, 5]), rng.standard_normal((5, 2))
    curve, x = ss.BSpline(knots, points, 2, "r:2"), np.array([2.0, 2.5, 3.0])
    assert curve.domain == (2.0, 3.0)
    # From the left; SciPy takes the end from the right.
    expected = FlatBSpline(knots, points, 2)(np.minimum(x, np.nextafter(3.0, 0.0)))
    assert np.abs(curve(x) - expected).max() <= 20 * EPS
