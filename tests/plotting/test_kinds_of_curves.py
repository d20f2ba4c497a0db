"""Plots of all classes of curves, of gaps, of times far from zero, and of batches."""

import numpy as np
import pytest
from drawn import axes_named, has_title, lines_of, points_around, rate_axes, rendered, role, spline_on, texts_of

import symspline as ss

NAMES = ["euclidean:1", "euclidean:2", "sphere:2", "so:3", "spd:2", "gr:2,5"]
T = np.array([0.0, 1.1, 1.9, 3.2, 4.0, 5.3])


def bezier(name):
    space = ss.space(name)
    return ss.BezierCurve(points_around(space, np.random.default_rng(1), (5,)), space)


CURVES = {
    "B-spline": lambda name: ss.BSpline([0, 0, 0, 0, 1, 2, 2, 2, 2], bezier(name).control_points, 3, name),
    "Bézier curve": bezier,
    "Piecewise geodesic": lambda name: ss.PiecewiseGeodesic(T, spline_on(name, t=T).points, name),
    "Retimed curve": lambda name: spline_on(name, t=T).restrict(0.5, 3.5),
    "Segmented curve": lambda name: ss.SegmentedCurve([spline_on(name, t=T), spline_on(name, t=T + 15)]),
    "C¹ Hermite spline": lambda name: spline_on(name, t=T).restrict(1.1, 4.0),
}


@pytest.mark.parametrize(("kind", "name"), list(zip(CURVES, NAMES, strict=True)))
def test_every_kind_of_curve_is_drawn(kind, name):
    curve = CURVES[kind](name)
    figure = rendered(curve.plot())
    assert has_title(figure, kind, curve.space)
    for axes, nu in zip([own[0] for own in rate_axes(figure)], (1, 2), strict=True):
        line = np.concatenate(lines_of(axes))
        x = line[::7, 0]
        norm = curve.space.norm(curve(x), curve(x, nu))
        np.testing.assert_allclose(np.abs(line[::7, 1]), norm, atol=1e-6)


@pytest.mark.parametrize("name", ["r:2", "se:3", "sphere:2 x r:1"])
def test_gaps_between_segments_are_shaded_and_lines_stop(name):
    if " x " in name:
        space, rng = ss.space(name), np.random.default_rng(0)
        points = tuple(points_around(own, rng, (6,)) for own in space.factors)
        segments = [ss.CubicSpline(T + shift, points, space) for shift in (0, 15)]
    else:
        segments = [spline_on(name, t=T), spline_on(name, t=T + 15)]
    figure = rendered(ss.SegmentedCurve(segments).plot())
    assert "2 segments (C² spline), 1 gap" in texts_of(figure)
    axes = rate_axes(figure)[0][0]
    (band,) = [own for own in axes.collections if role(own) == "gap"]
    assert sorted(set(band.get_paths()[0].vertices[:, 0])) == [5.3, 15.0]
    assert [line[[0, -1], 0].tolist() for line in lines_of(axes)] == [[0.0, 5.3], [15.0, 20.3]]


@pytest.mark.parametrize("name", ["euclidean:1", "sphere:1"])
def test_quantiles_of_a_batch(name):
    space, rng = ss.space(name), np.random.default_rng(4)
    middle = space.random_point(rng)
    points = space.exp(middle, 0.3 * space.random_tangent(rng, np.broadcast_to(middle, (40, 6, *space.point_shape))))
    batch = ss.CubicSpline(T, points, space)
    figure = rendered(batch.plot())
    assert "5–95 % of 40 curves" in texts_of(figure)
    for axes in figure.axes:
        assert len(lines_of(axes)) == 3
    axes = axes_named(figure, "velocity")
    (band,) = [own for own in axes.collections if role(own) == "5–95 %"]
    corners = band.get_paths()[0].vertices
    x = np.unique(corners[:, 0])[100:200:20]
    velocities, at = batch(x, 1), batch(x)
    # The sign is that of the increasing angle or number.
    signed = velocities[..., 0]
    if name == "sphere:1":
        signed = np.degrees(at[..., 0] * velocities[..., 1] - at[..., 1] * velocities[..., 0])
    for time, values in zip(x, signed.T, strict=True):
        drawn = corners[corners[:, 0] == time, 1]
        expected = np.quantile(values, [0.05, 0.95])
        np.testing.assert_allclose([drawn.min(), drawn.max()], expected, atol=1e-9)


@pytest.mark.parametrize("name", ["r:2", "r:3"])
def test_control_polygons(name):
    curve = ss.BezierCurve(points_around(ss.space(name), np.random.default_rng(2), (4,)), name)
    axes = rendered(curve.plot()).axes[0]
    (control,) = [line for line in axes.lines if role(line) == "control points"]
    drawn = np.stack(control.get_data_3d() if name == "r:3" else control.get_data(), axis=1)
    np.testing.assert_allclose(drawn, curve.control_points)
    assert "control points" not in texts_of(spline_on(name).plot())


@pytest.mark.parametrize("name", ["r:1", "sphere:2", "torus:2", "se:3"])
def test_batches_close_to_their_mean_show_it(name):
    """No curve is named then, and the line of rates is the median."""
    space, rng = ss.space(name), np.random.default_rng(8)
    path = points_around(space, rng, (7,))
    points = np.broadcast_to(path, (12, *path.shape))
    batch = ss.CubicSpline(None, space.exp(points, 0.02 * space.random_tangent(rng, points)), space)
    figure = rendered(batch.plot())
    texts = texts_of(figure)
    assert {"median of 12 curves", "5–95 % of 12 curves"} <= set(texts) and "curve 0" not in texts
    assert any(text.replace("\n", " ") == "mean curve" for text in texts) and "given points" not in texts
    label = {"r:1": "velocity", "torus:2": "speed"}.get(name, "speed")
    (median,) = (line.get_xydata() for line in axes_named(figure, label).lines if role(line) == "median")
    velocities = batch(median[:, 0], 1)
    rates = {
        "r:1": lambda: velocities[..., 0],
        "se:3": lambda: np.linalg.norm(velocities[..., :3, 3], axis=-1),
        "torus:2": lambda: np.degrees(batch.speed(median[:, 0])),
    }.get(name, lambda: batch.speed(median[:, 0]))()
    np.testing.assert_allclose(median[:, 1], np.median(rates, axis=0), atol=1e-9)
    # Far from each other, some of the curves have their names instead.
    centres = space.exp(path[0], 0.4 * space.random_tangent(rng, np.broadcast_to(path[0], (12, 1, *space.point_shape))))
    around = np.broadcast_to(centres, points.shape)
    apart = space.exp(around, 0.05 * space.random_tangent(rng, around))
    assert {"curve 0", "other curves, 9 of 11"} & set(texts_of(ss.CubicSpline(None, apart, space).plot()))
