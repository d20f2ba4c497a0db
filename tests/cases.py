"""The spaces and the end conditions that tests run over, and data on them. A new space joins with one line."""

import copy
import functools
import inspect
import re
from dataclasses import dataclass

import numpy as np
import pytest

import symspline as ss

EPS = np.finfo(float).eps


@dataclass(frozen=True)
class Case:
    """A space, and the scale of data on it.

    Attributes:
        name: the space's name.
        far: the longest step between neighbours that the solver laws use.
        smooth: whether to run the laws on smooth curves (needs dimension 2 or more).
        few: whether to run the long laws on few of their cases: for further sizes of a family.
        interface: whether it stands for its family where formulas do not matter.
    """

    name: str
    far: float = 2.5
    smooth: bool = True
    few: bool = False
    interface: bool = False

    @property
    def space(self):
        return ss.space(self.name)


CASES = [
    Case("euclidean:1", smooth=False),
    Case("euclidean:3", interface=True),
    Case("torus:1", smooth=False, few=True),
    Case("torus:3", interface=True),
    Case("sphere:1", smooth=False),
    Case("sphere:2", interface=True),
    Case("sphere:3"),
    Case("sphere:7"),
    Case("hyperbolic:1", far=1.5, smooth=False),
    Case("hyperbolic:2", far=1.5, interface=True),
    Case("hyperbolic:5", far=1.5),
    Case("ds:2", far=1.2),
    Case("ds:3", far=1.5, few=True, interface=True),
    Case("ads:2", far=1.5, few=True),
    Case("ads:4", far=1.5, interface=True),
    Case("rp:1", far=1.2, smooth=False, few=True),
    Case("rp:2", far=1.2, interface=True),
    Case("rp:7", far=1.2, few=True, interface=True),
    Case("cp:1", far=1.0, few=True, interface=True),
    Case("cp:2", far=1.0),
    Case("cp:7", far=1.0, few=True, interface=True),
    Case("ch:1", far=0.75, few=True),
    Case("ch:2", far=0.75, interface=True),
    Case("hp:1", far=1.4, few=True),
    Case("hp:2", far=1.4, few=True, interface=True),
    Case("gr:1,3", far=1.2, few=True, interface=True),
    Case("gr:2,3", far=1.2, few=True),
    Case("gr:2,5", far=1.2, interface=True),
    Case("gr:3,8", far=1.2, few=True),
    Case("gr:7,8", far=1.2, few=True),
    Case("cgr:1,2", far=1.0, few=True, interface=True),
    Case("cgr:2,4", far=1.0, interface=True),
    Case("cgr:3,8", far=1.0, few=True),
    Case("so:2", smooth=False, few=True, interface=True),
    Case("so:3", interface=True),
    Case("so:5", few=True, interface=True),
    Case("o:2", smooth=False, few=True, interface=True),
    Case("o:3", few=True, interface=True),
    Case("u:1", smooth=False, few=True, interface=True),
    Case("u:2", interface=True),
    Case("u:5", few=True),
    Case("su:2", interface=True),
    Case("su:3", few=True, interface=True),
    Case("spd:1", far=1.5, smooth=False, few=True),
    Case("spd:2", far=1.5, interface=True),
    Case("spd:3", far=1.5),
    Case("sspd:3", far=1.5, few=True, interface=True),
    Case("logspd:1", far=1.5, smooth=False, few=True),
    Case("logspd:3", far=1.5, interface=True),
    Case("siegel:1", far=1.5, few=True),
    Case("siegel:2", far=1.5, few=True, interface=True),
    Case("hpd:1", far=1.5, smooth=False, few=True, interface=True),
    Case("hpd:2", far=1.5, interface=True),
    Case("hpd:5", far=1.5, few=True),
    Case("se:2", far=1.5, interface=True),
    Case("se:3", far=1.5, interface=True),
    Case("gl:2", far=1.5, interface=True),
    Case("gl:3", far=1.5, few=True),
    Case("cgl:2", far=1.5, few=True, interface=True),
    Case("aff:2", far=1.5, few=True, interface=True),
    Case("sim:3", far=1.5, few=True, interface=True),
    Case("sl:3", far=1.5, few=True, interface=True),
    Case("sp:4", far=1.5, few=True, interface=True),
    Case("lorentz:3", far=1.5, few=True, interface=True),
    Case("igr:0,1,1,2", far=1.5, few=True),
    Case("igr:1,1,2,2", far=1.5, few=True, interface=True),
]

# Matrices so long that a law takes seconds: they obey three, of the space, of the curve and of its derivatives.
LARGE = [Case("so:8", few=True), Case("u:8", few=True), Case("su:8", few=True), Case("spd:8", far=1.5, few=True)]

# Every family, for operations and names; and products.
SINGLE = [case.space for case in CASES if case.interface]
SPACES = SINGLE + [ss.space(name) for name in ("sphere:3 x r:2", "u:2 x r:3", "cp:1 x so:3", "gr:2,5 x hpd:2 x se:3")]
# One of each kind, for what does not depend on the formulas of a space: flat, of positive, negative and indefinite
# curvature, real and complex, vectors and matrices, points of one array and of many, groups, products.
REPRESENTATIVE = [
    ss.space(name)
    for name in (
        *("euclidean:3", "sphere:2", "hyperbolic:2", "ads:4", "cp:2", "gr:2,5", "so:3", "u:2", "hpd:2", "se:3"),
        *("sphere:3 x r:2", "gr:2,5 x hpd:2 x se:3"),
    )
]
# Where a vector space, a positively and a negatively curved space and a product are enough.
COMMON = [ss.space(name) for name in ("euclidean:3", "sphere:2", "hyperbolic:2", "sphere:3 x r:2")]

# End conditions by name; `end_conditions` makes the arguments.
ENDS = ["natural", "clamped", "not-a-knot", "periodic", "velocity", "acceleration", "mixed"]
WORDS = ENDS[:4]


def end_conditions(kind, first, last):
    """The argument `bc_type` for such ends, with a vector for either end."""
    return {
        "velocity": ((1, first), (1, last)),
        "acceleration": ((2, first), (2, last)),
        "mixed": ("not-a-knot", (1, last)),
        "turned": ((2, first), "not-a-knot"),
    }.get(kind, kind)


# Small ones of which K of (22) is not 0. Loops on these, and on that of poses, turn frames.
CURVED = ["sphere:2", "hyperbolic:2", "rp:2", "cp:2", "gr:2,5", "so:3", "su:2", "u:2", "spd:2", "hpd:2"]
LOOPS = [*CURVED, "se:3"]


def _repeat(test, names, values, arguments):
    """Run a test for each of these values, every time with the same random numbers. A failure names its values."""
    for value in values:
        generators = {k: copy.deepcopy(v) for k, v in arguments.items() if isinstance(v, np.random.Generator)}
        chosen = dict(zip(names, value if len(names) > 1 else [value], strict=True))
        try:
            test(**arguments | generators | chosen)
        except BaseException as error:
            error.add_note("with " + ", ".join(f"{name} = {value}" for name, value in chosen.items()))
            raise


def _with_parameters(run, test, added, removed):
    """`run` as pytest sees it: with the parameters of the test, but for those that it chooses itself."""
    run = functools.wraps(test)(run)
    kept = [p for name, p in inspect.signature(test).parameters.items() if name not in removed]
    first = [inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD) for name in added]
    run.__signature__ = inspect.Signature([*first, *kept])
    return run


def _listed(names):
    return [name.strip() for name in names.split(",")] if isinstance(names, str) else names


def loop_over(names, values):
    """As `pytest.mark.parametrize`, but within one case: for values that hardly matter to which code runs."""
    names = _listed(names)

    def decorate(test):
        return _with_parameters(lambda **given: _repeat(test, names, values, given), test, (), names)

    return decorate


def grouped(names, groups):
    """As `pytest.mark.parametrize`, with one case for each of these named groups of values."""
    names = _listed(names)

    def decorate(test):
        def run(group, **given):
            _repeat(test, names, groups[group], given)

        return pytest.mark.parametrize("group", groups)(_with_parameters(run, test, ("group",), names))

    return decorate


def by_family(cases):
    """A law of spaces: one case per family, which loops over its sizes."""
    families = {}
    for case in cases:
        families.setdefault(case.name.partition(":")[0], []).append(case)
    return grouped("case", families)


every_family = by_family(CASES)


def some_families(*names):
    """A law of spaces on these spaces alone: for what does not depend on their formulas."""
    return by_family([case for case in CASES if case.name in names])


def _families():
    """The names of every symmetric space in the library, one row per family, from the message that lists them."""
    try:
        ss.space("unknown:1")
    except ss.ValidationError as error:
        listed = re.search(r"known names are (.*), as in", str(error))[1]
    return [row.split(" or ") for row in listed.split(", ") if not row.startswith("stiefel")]


FAMILIES = _families()
POSITIVE = (ss.SymmetricPositiveDefinite, ss.HermitianPositiveDefinite, ss.SpecialPositiveDefinite, ss.Siegel)
HYPERBOLIC = (ss.Hyperbolic, ss.ComplexHyperbolic)
LINEAR = (
    ss.GeneralLinear,
    ss.ComplexGeneralLinear,
    ss.Affine,
    ss.Similarity,
    ss.SpecialLinear,
    ss.Symplectic,
    ss.Lorentz,
)
QUADRICS = (ss.DeSitter, ss.AntiDeSitter)
INDEFINITE = (*QUADRICS, ss.IndefiniteGrassmannian)
QUOTIENTS = (
    ss.RealProjective,
    ss.ComplexProjective,
    ss.ComplexHyperbolic,
    ss.QuaternionicProjective,
    ss.Grassmannian,
    ss.ComplexGrassmannian,
)


def condition(space, points):
    """By how much rounding of points near these counts: |p|² on quadrics, |p| cond(p) for positive definite and for
    invertible matrices, |p| otherwise."""
    if isinstance(space, (*HYPERBOLIC, *QUADRICS)):
        return float(np.max(np.sum(np.square(np.abs(points)), axis=-1)))
    if len(space.point_shape) == 2:
        largest = max(1.0, float(np.max(np.linalg.norm(points, axis=(-2, -1)))))
    else:
        largest = max(1.0, float(np.max(np.abs(points))))
    if isinstance(space, (*POSITIVE, *LINEAR, ss.IndefiniteGrassmannian)):
        return largest * float(np.max(np.linalg.cond(np.asarray(points))))
    return largest


def apart(space, p, q):
    """How far points are from each other: distance where one point has many arrays, and the largest
    difference of arrays elsewhere."""
    if isinstance(space, QUOTIENTS):
        return float(np.max(space.distance(p, q)))
    return float(np.abs(np.asarray(p) - q).max())


def has_metric(space):
    """Whether lengths mean anything; K is NaN where no metric, or none that is definite, belongs to the space."""
    return not np.isnan(space.curvature)


def compact(space):
    return np.isfinite(space.injectivity_radius) and has_metric(space)


def centre_of(space):
    """A point of whole numbers."""
    if isinstance(space, ss.IndefiniteGrassmannian):
        a, b, p, q = (int(x) for x in str(space).partition(":")[2].split(","))
        return np.diag(np.repeat([-1, 1, -1, 1], [p - a, a, q - b, b]))
    if len(space.point_shape) == 2:
        return np.eye(*space.point_shape, dtype=int)
    return np.eye(*space.point_shape, dtype=int)[1 if isinstance(space, QUADRICS) else 0]


def base_point(space, rng):
    """A random point that is not far from the middle of a non-compact space."""
    p = space.random_point(rng)
    if compact(space):
        return p
    if isinstance(space, INDEFINITE):
        # Not every two points are joined by a geodesic.
        return space.exp(centre_of(space), 0.2 * space.random_tangent(rng, centre_of(space)))
    centre = np.zeros(space.point_shape)
    if isinstance(space, HYPERBOLIC):
        centre[0] = 1.0
    if len(space.point_shape) == 2:
        centre = np.eye(space.point_shape[0])
    return space.exp(centre, 0.3 * space.log(centre, p))


def unit_tangent(space, p, rng):
    v = space.random_tangent(rng, p)
    return v / space.norm(p, v)


def steep_tangent(space, p, rng):
    """A unit tangent vector whose deciding angle is as large as its length allows: the geodesic in its
    direction is the first to meet the cut locus."""
    v = unit_tangent(space, p, rng)
    if isinstance(space, (ss.Grassmannian, ss.ComplexGrassmannian)):
        u, _, w = np.linalg.svd(v, full_matrices=False)
        return space.project_tangent(p, np.outer(u[:, 0], w[0]))
    groups = (ss.SpecialOrthogonal, ss.Orthogonal, ss.Unitary, ss.SpecialUnitary)
    if isinstance(space, groups):
        z = np.linalg.eigh(-1j * (p.conj().T @ v))[1]
        first, last = (np.outer(z[:, i], z[:, i].conj()) for i in (-1, 0))
        v = p @ (1j * first if isinstance(space, ss.Unitary) else 1j * (first - last))
        v = space.project_tangent(p, v if np.iscomplexobj(p) else v.real)
    return v / space.norm(p, v)


WALKS = {}
"""Those made so far, and the generator after them: most tests begin with the same seed, and making the points
takes longer than fitting them."""


def walk(space, step, n, rng, turn=0.5):
    """Points with equal steps whose direction changes by about `turn` radians a step.

    On spaces without a cut locus the walk turns back when it has gone far: rounding grows with the
    distance there, in units of the curvature.
    """
    generator = rng.bit_generator
    key = str(space), float(step), n, turn, str(generator.state)
    if key not in WALKS:
        WALKS[key] = _walk(space, step, n, rng, turn), generator.state
    points, generator.state = WALKS[key]
    return points.copy()


def _walk(space, step, n, rng, turn):
    p = [base_point(space, rng)]
    direction = unit_tangent(space, p[0], rng)
    for _ in range(n - 1):
        q = space.project(space.exp(p[-1], step * direction))
        direction = space.project_tangent(q, space.transport(p[-1], q, direction))
        direction = direction + turn * unit_tangent(space, q, rng)
        if isinstance(space, INDEFINITE):
            if np.linalg.norm(q - p[0]) > 2.0:
                direction = space.project_tangent(q, p[0] - q) + 0.5 * direction
        elif not compact(space) and space.distance(p[0], q) * max(1.0, space.curvature) > 2.0:
            direction = space.log(q, p[0]) + 0.5 * direction
        size = space.norm(q, direction)
        direction = direction / size if size > 0.1 else unit_tangent(space, q, rng)
        p.append(q)
    return np.array(p)


def closed_walk(space, step, n, rng):
    """A walk there and back."""
    there = walk(space, step, n // 2 + 1, rng)
    return np.concatenate([there, there[-2::-1]])


def zigzag(step, n=20, rise=0.1):
    """Points on S² whose longitude alternates between 0 and `step`, one above the other."""
    i = np.arange(n)
    lon, lat = step * (i % 2), rise * (i - (n - 1) / 2)
    return np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=-1)


def zigzag_on(space, step, n, rng):
    """Points to either side of a geodesic, in the direction of the nearest cut locus."""
    o = space.random_point(rng)
    side, along = steep_tangent(space, o, rng), unit_tangent(space, o, rng)
    centres = space.exp(o, np.multiply.outer(0.1 * (np.arange(n) - (n - 1) / 2), along))
    across = np.array([space.project_tangent(c, space.transport(o, c, side)) for c in centres])
    signs = np.reshape(0.5 * (-1.0) ** np.arange(n), (n, *[1] * len(space.point_shape)))
    return space.project(space.exp(centres, step * signs * across))


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


def one_sided(spline, nu):
    """γ⁽ᵛ⁾ at both ends of every segment, from that segment alone: shapes (N, *point_shape)."""
    t, p, u = np.asarray(spline.t, float), spline.points, spline.velocities
    h = np.diff(t)
    pairs = np.stack([p[:-1], p[1:]], axis=1), np.stack([u[:-1], u[1:]], axis=1)
    knots = np.stack([0 * h, h], axis=1)
    values = ss.evaluate(knots, *pairs, spline.space, knots, nu=nu, per_curve=True)
    return values[:, 0], values[:, 1]


def jumps(spline):
    """Largest jump of γ, γ', ∇γ' at a knot, as multiples of what the C² law allows.

    Vectors at one point that has many arrays are compared at the same one.
    """
    space, p = spline.space, spline.points
    h = np.diff(np.asarray(spline.t, float))
    found = []
    starts, ends = one_sided(spline, 0)
    closed = isinstance(spline.bc_type, str) and spline.bc_type == "periodic"
    for nu in range(3):
        start, end = one_sided(spline, nu)
        shorter = np.minimum(h[:-1], h[1:])
        pairs = [(a[:-1], b[1:]) for a, b in ((ends, starts), (end, start))]
        if closed:
            pairs = [
                (np.concatenate([left, a[-1:]]), np.concatenate([right, b[:1]]))
                for (left, right), (a, b) in zip(pairs, ((ends, starts), (end, start)), strict=True)
            ]
            shorter = np.append(shorter, min(h[0], h[-1]))
        (from_, to), (left, right) = pairs
        largest = max(np.abs(start).max(), np.abs(end).max())
        # 50 ε for the rounding of either side.
        allowed = 1e-12 * largest + 2 * 50 * EPS * condition(space, p) / shorter**nu
        if nu == 0:
            difference = np.array([apart(space, a, b) for a, b in zip(left, right, strict=True)])
        else:
            if isinstance(space, QUOTIENTS) and len(left):
                left = space.transport(from_, to, left)
            difference = np.abs(left - right).reshape(len(left), -1).max(axis=1, initial=0.0)
        found.append(float((difference / allowed).max(initial=0.0)))
    return found


def by_differences(space, curve, x, h):
    """Velocity and covariant acceleration, by Richardson's extrapolation of central differences at h and h/2."""
    y = curve(x)

    def differences(h):
        plus, minus = (space.log(y, curve(x + s * h)) for s in (1, -1))
        return (plus - minus) / (2 * h), (plus + minus) / h**2

    return tuple((4 * half - whole) / 3 for whole, half in zip(differences(h), differences(h / 2), strict=True))
