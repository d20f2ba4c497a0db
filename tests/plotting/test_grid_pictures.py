"""Pictures of grids: the content of images, symbols and nodes, of missing nodes, sections and dates."""

import numpy as np
import pytest
from drawn import axes_named, has_title, rendered, texts_of
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.dates import date2num, num2date
from matplotlib.figure import Figure
from matplotlib.quiver import Quiver
from refused import raises

import symspline as ss

# Spaces with a picture of their own, with some of the others.
SPACES = "r:1 r:2 r:3 sphere:1 sphere:2 sphere:3 rp:1 gr:1,2 so:2 o:2 u:1 so:3 su:2 spd:2 spd:3 cp:1 cgr:1,2 se:3"
OTHERS = "gr:2,5 hpd:2 se:2"
U, V = np.array([0.0, 0.7, 1.1, 2.0, 3.2, 3.6, 4.5]), np.array([-1.0, -0.6, 0.1, 0.4, 1.5])


def smooth_field(name, u=U, v=V):
    """A smooth field, whose grid meets no cut locus."""
    space, rng = ss.space(name), np.random.default_rng(2)
    middle = space.random_point(rng)
    around = np.broadcast_to(middle, (len(u), len(v), *space.point_shape))
    tangents = [space.random_tangent(rng, middle) for _ in range(2)]
    first, second = (0.6 * v / space.norm(middle, v) for v in tangents)
    extra = (1,) * len(space.point_shape)
    x, y = (part.reshape(part.shape + extra) for part in np.meshgrid(u / np.ptp(u), v / np.ptp(v), indexing="ij"))
    return space.project(space.exp(around, x * first + np.sin(2 * y) * second))


def grid_on(name, points=None, axes=(U, V), **options):
    return ss.GridSpline(axes, smooth_field(name) if points is None else points, name, **options)


def image_of(figure, label="field"):
    """The image of the picture with its pixels' coordinates, and values of shape (m, n); axis 0 is vertical."""
    axes = axes_named(figure, label)
    (image,) = axes.images
    left, right, low, high = image.get_extent()
    shown = image.get_array()
    m, n = shown.shape[:2]
    x, y = low + (high - low) * (np.arange(m) + 0.5) / m, left + (right - left) * (np.arange(n) + 0.5) / n
    return x, y, shown


def nodes_of(figure, label="nodes"):
    (line,) = [line for axes in figure.axes for line in axes.lines if line.get_label() == label]
    # In the order of the axes of the grid.
    positions = line.get_xydata()[:, ::-1]
    return positions[np.lexsort(positions.T[::-1])]


@pytest.mark.parametrize("name", f"{SPACES} {OTHERS}".split()[::2])
def test_every_space_is_drawn(name):
    figure = rendered(grid_on(name).plot())
    assert isinstance(figure, Figure)
    assert has_title(figure, "C² grid", ss.space(name))
    assert "7 × 5 nodes" in texts_of(figure)
    if name in ("r:3", "se:3"):
        return
    dots = nodes_of(figure)
    np.testing.assert_allclose(dots, np.stack(np.meshgrid(U, V, indexing="ij"), axis=-1).reshape(-1, 2))
    assert (name in OTHERS.split()) == ("distance to the ringed node" in texts_of(figure))


def test_numbers_and_distances_are_those_of_the_grid():
    grid = grid_on("r:1")
    x, y, shown = image_of(grid.plot())
    np.testing.assert_allclose(shown, grid.grid(x, y)[..., 0], atol=1e-12)
    assert len(x) > 200 and abs(len(y) - len(x) * np.ptp(V) / np.ptp(U)) < 1
    grid = grid_on("gr:2,5")
    figure = grid.plot()
    x, y, shown = image_of(figure)
    ((a, b),) = nodes_of(figure, "ringed node")
    np.testing.assert_allclose((a, b), (U[3], V[2]))
    np.testing.assert_allclose(shown, grid.space.distance(grid((a, b)), grid.grid(x, y)), atol=1e-7)


@pytest.mark.parametrize(
    ("name", "turn"), [("sphere:1", 360), ("so:2", 360), ("u:1", 360), ("rp:1", 180), ("gr:1,2", 180)]
)
def test_angles(name, turn):
    """Angles are those of the points, modulo their period; small ranges have colours of their own."""
    for size in (1.0, 0.05):
        angle = np.radians(turn) * (size * (0.12 * U[:, None] + 0.1 * V) + 0.45)
        vectors = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        points = {
            "so:2": np.stack([vectors, vectors[..., ::-1] * [-1, 1]], axis=-1),
            "u:1": np.exp(1j * angle)[..., None, None],
            "gr:1,2": vectors[..., None],
        }.get(name, vectors)
        figure = rendered(grid_on(name, points).plot())
        x, y, shown = image_of(figure)
        flat = ss.GridSpline((U, V), np.degrees(angle)[..., None], "r:1").grid(x, y)[..., 0]
        np.testing.assert_allclose((shown - flat + turn / 2) % turn, turn / 2, atol=1e-6)
        low, high = axes_named(figure, "angle, degrees").get_ylim()
        assert ((low, high) == (-turn / 2, turn / 2)) == (size == 1)


def test_arrows_are_directions_over_the_polar_angle():
    grid = grid_on("sphere:2")
    figure = rendered(grid.plot())
    x, y, shown = image_of(figure)
    np.testing.assert_allclose(shown, np.degrees(np.arccos(grid.grid(x, y)[..., 2])), atol=1e-6)
    (arrows,) = [each for each in axes_named(figure, "field").collections if isinstance(each, Quiver)]
    assert len(arrows.U) == 35
    np.testing.assert_allclose(np.stack([arrows.U, arrows.V], axis=-1), grid(arrows.XY[:, ::-1])[:, :2], atol=1e-9)
    # States have the Bloch vector, whose third component is the difference of the probabilities.
    states = grid_on("cp:1")
    x, y, shown = image_of(states.plot())
    found = states.grid(x, y)
    np.testing.assert_allclose(np.cos(np.radians(shown)), np.abs(found[..., 0]) ** 2 - np.abs(found[..., 1]) ** 2)


@pytest.mark.parametrize("name", ["spd:2", "spd:3"])
def test_ellipses_are_those_of_the_tensors(name):
    grid = grid_on(name)
    figure = rendered(grid.plot())
    (ellipses,) = [each for each in axes_named(figure, "field").collections if isinstance(each, PolyCollection)]
    tensors = grid(np.asarray(ellipses.get_offsets())[:, ::-1])[:, :2, :2]
    rings = np.array([path.vertices[:97] for path in ellipses.get_paths()])
    solved = np.linalg.solve(tensors, rings.swapaxes(1, 2))
    np.testing.assert_allclose(np.sum(rings.swapaxes(1, 2) * solved, axis=1), 1, atol=1e-9)
    x, y, shown = image_of(figure)
    if name == "spd:2":
        values = np.linalg.eigvalsh(grid.grid(x, y))
        anisotropy = np.abs(values[..., 1] - values[..., 0]) / np.linalg.norm(values, axis=-1)
        np.testing.assert_allclose(shown, anisotropy)
    else:
        # Red, green and blue for the axis along which the tensor is longest.
        diagonal = np.diagonal(np.linalg.matrix_power(grid.grid(x, y), 3), axis1=-2, axis2=-1)
        assert (shown[..., :3].argmax(axis=-1) == diagonal.argmax(axis=-1)).mean() > 0.99


@pytest.mark.parametrize("name", ["r:1", "sphere:2", "spd:3", "se:3"])
def test_missing_nodes_are_blank(name):
    u = np.linspace(0, 1, 12)
    points = np.array(smooth_field(name, u, u))
    points[:4, 6:] = np.nan
    points[8, 3] = np.nan
    grid = grid_on(name, points, (u, u))
    figure = rendered(grid.plot())
    assert "12 × 12 nodes, 25 missing" in texts_of(figure)
    if name in ("r:3", "se:3"):
        return
    assert len(nodes_of(figure)) == 144 - 25
    x, y, shown = image_of(figure)
    values = grid.grid(x, y)
    present = np.isfinite(values).all(axis=tuple(range(2, values.ndim)))
    assert 0.5 < present.mean() < 0.9
    drawn = shown[..., 3] == 1 if shown.ndim > 2 else ~np.ma.getmaskarray(shown)
    np.testing.assert_array_equal(drawn, present)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", ["r:2", "sphere:1", "spd:3"])
def test_fields_without_extent(name):
    """All points are equal, or there is one node only, which has no values around it."""
    points = np.broadcast_to(smooth_field(name)[3, 2], smooth_field(name).shape).copy()
    rendered(grid_on(name, points).plot())
    points[:3] = points[4:] = points[:, :2] = points[:, 3:] = np.nan
    rendered(grid_on(name, points).plot())


@pytest.mark.slow
def test_products_have_a_panel_per_factor():
    points = smooth_field("so:3"), smooth_field("r:3"), smooth_field("r:1")
    grid = ss.GridSpline((U, V), points, "so:3 x r:3 x r:1")
    figure = rendered(grid.plot())
    title = "C² grid of rotations and vectors on so:3 x r:3 x r:1"
    first_lines = {text.split("\n")[0] for text in texts_of(figure)}
    assert {"so:3, rotations", "r:3, vectors", title} <= first_lines
    maps = [axes for axes in figure.axes if axes.get_label() == "field"]
    assert len(maps) == 2
    (image,) = maps[1].images
    assert image.get_array().min() >= points[2].min() - 0.1
    seven = ss.GridSpline((U, V), (smooth_field("r:1"),) * 7, " x ".join(["r:1"] * 7))
    figure = rendered(seven.plot())
    assert "7 × 5 nodes, 6 of 7 factors" in texts_of(figure)
    assert len([axes for axes in figure.axes if axes.get_label() == "field"]) == 6


def test_further_axes_are_fixed_at_their_middle_nodes():
    w, days = np.array([0.0, 0.123456, 1.0]), np.datetime64("2024-02-27") + np.array([0, 1, 3, 4])
    x, y, z, s = np.meshgrid(U, V, w, np.arange(4.0), indexing="ij")
    grid = ss.GridSpline((U, V, w, days), (x * y + z + s**2)[..., None], "r:1")
    figure = rendered(grid.plot())
    words = "axis 2 at 0.1235, axis 3 at 2024-03-01, 7 × 5 × 3 × 4 nodes"
    assert words in [text.replace("\n", " ") for text in texts_of(figure)]
    x, y, shown = image_of(figure)
    np.testing.assert_allclose(shown, grid.grid(x, y, w[1], days[2])[..., 0])
    points = np.array(grid.points)
    points[:, :, 1] = np.nan
    raises("all nodes of the section are missing", ss.GridSpline((U, V, w, days), points, "r:1").plot)


@pytest.mark.parametrize("unit, step", [("D", 1), ("h", 7), ("ms", 40)])
def test_dates_on_either_axis(unit, step):
    days = np.datetime64("2024-02-27", unit) + step * np.array([0, 1, 2, 4, 5]).astype(f"timedelta64[{unit}]")
    for flipped in (False, True):
        points = smooth_field("r:1")
        axes = (days, U) if flipped else (U, days)
        grid = ss.GridSpline(axes, points.swapaxes(0, 1) if flipped else points, "r:1")
        figure = rendered(grid.plot())
        dots = nodes_of(figure)[:, 0 if flipped else 1]
        np.testing.assert_allclose(np.unique(dots), date2num(days), rtol=0, atol=2e-11)
        x, y, shown = image_of(figure)
        at = [np.datetime64(num2date(number).replace(tzinfo=None), "us") for number in (x, y)[not flipped]]
        coordinates = (at, y) if flipped else (x, at)
        np.testing.assert_allclose(shown, grid.grid(*map(np.asarray, coordinates))[..., 0], atol=2e-4)


def test_one_axis_gives_the_figure_of_the_curve():
    points = smooth_field("sphere:2")[:, 2]
    figure = rendered(ss.GridSpline((U,), points, "sphere:2").plot())
    assert "C² spline on sphere:2" in texts_of(figure) and "7 points, not-a-knot ends" in texts_of(figure)
    assert axes_named(figure, "speed")
    one, ax = ss.GridSpline((U,), points, "sphere:2"), Figure().add_subplot()
    assert one.plot(ax=ax, title="mine") is ax and one.plot(figsize=(5, 4)).get_size_inches().tolist() == [5, 4]
    points[3] = np.nan
    raises("the only axis of the grid has missing nodes", ss.GridSpline((U,), points, "sphere:2").plot)


def test_grids_are_drawn_into_axes_and_files(tmp_path):
    grid = grid_on("so:3")
    ax = Figure(figsize=(6, 5)).add_subplot()
    assert grid.plot(ax=ax, title="mine") is ax and ax.get_title() == "mine"
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("axis 1", "axis 0")
    assert grid.plot(figsize=(5, 4)).get_size_inches().tolist() == [5, 4]
    raises("figsize and ax exclude each other", grid.plot, ax=ax, figsize=(5, 4))
    raises("ax has the projection", grid.plot, ax=Figure().add_subplot(projection="3d"))
    grid.plot(tmp_path / "grid.pdf")
    assert (tmp_path / "grid.pdf").read_bytes().startswith(b"%PDF")


def test_axes_have_names_and_axis_0_is_vertical():
    """As in xarray, so that rows of points are rows of the picture."""
    grid = grid_on("r:1")
    figure = grid.plot(axis_names=["latitude", "longitude"])
    axes = axes_named(figure, "field")
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("longitude", "latitude")
    low, high = axes.get_ylim()
    assert low < U[0] < U[-1] < high
    deep = ss.GridSpline((U, V, V), np.zeros((7, 5, 5, 1)), "r:1").plot(axis_names=["x", "y", "depth"])
    assert any("depth at 0.1" in text for text in texts_of(deep))
    assert any("x →" in text for text in texts_of(grid_on("r:3").plot(axis_names=["x", "y"])))
    raises("axis_names must be a list of 2 strings", grid.plot, axis_names=["latitude"])
    raises("axis_names must be a list of 2 strings", grid.plot, axis_names="xy")
    raises("axis_names\\[1\\] must be a string", grid.plot, axis_names=["x", 1], error=TypeError)


CORNERS = {
    "432": [[0, 0, 1], [1, 0, 1], [1, 1, 1]],
    "622": [[0, 0, 1], [1, 0, 0], [3**0.5, 1, 0]],
    "422": [[0, 0, 1], [1, 0, 0], [1, 1, 0]],
    "222": [[0, 0, 1], [1, 0, 0], [0, 1, 0]],
}


@pytest.mark.parametrize("left", [False, True])
@pytest.mark.parametrize("name", CORNERS)
def test_inverse_pole_figure_colours(name, left):
    """Crystals whose corner of the sector is along the direction are red, green and blue, whatever their symmetry."""
    rng, sample = np.random.default_rng(3), np.array([0.0, 0.6, 0.8])
    space = ss.Quotient("so:3", name, left=left)
    group = ss.rotations.point_group(name)
    for number, corner in enumerate(CORNERS[name]):
        # An orientation maps vectors of the crystal to those of the sample, or with left=True the reverse.
        to, start = ss.Sphere(2).project(np.array([sample, corner], float))
        axis = np.cross(start, to)
        turn = ss.rotations.from_rotation_vectors(axis / np.linalg.norm(axis) * np.arccos(start @ to))
        turn = ss.rotations.from_rotation_vectors(rng.uniform(0, 6) * to) @ turn @ group[rng.integers(len(group))]
        points = np.broadcast_to(turn.T if left else turn, (7, 5, 3, 3))
        _, _, shown = image_of(ss.GridSpline((U, V), points, space).plot(direction=2 * sample))
        np.testing.assert_allclose(shown[..., :3], np.broadcast_to(np.eye(3)[number], (*shown.shape[:2], 3)), atol=1e-3)


def test_crystal_maps_are_continuous_and_explained():
    """Neighbouring directions have similar colours, also across the edges of the sector; equivalent ones are equal."""
    group = ss.rotations.point_group("432")
    turned = ss.rotations.from_rotation_vectors(np.stack(np.broadcast_arrays(U[:, None], V, 0.3 * V), axis=-1) * 0.5)
    grid = ss.GridSpline((U, V), turned, "so:3/432")
    figure = rendered(grid.plot())
    _, _, shown = image_of(figure)
    # Colours are square roots of shares, whose slope is infinite at zero.
    assert max(np.abs(np.diff(shown**2, axis=i)).max() for i in (0, 1)) < 0.1
    assert {"001", "101", "111"} <= set(texts_of(figure))
    (words,) = [text.replace("\n", " ") for text in texts_of(figure) if "along x₃ of the sample" in text]
    assert "disorientation" in words
    random = np.random.default_rng(0).integers(0, 24, (7, 5))
    again = ss.GridSpline((U, V), turned @ group[random], "so:3/432")
    np.testing.assert_allclose(image_of(again.plot())[2], shown, atol=1e-6)
    raises("direction is for maps of crystals", grid_on("so:3").plot, direction=[1, 0, 0])
    raises("direction must be three numbers", grid.plot, direction=[0, 0, 0])


def test_tensors_have_a_bar_of_a_known_length():
    figure = rendered(grid_on("spd:2").plot())
    axes = axes_named(figure, "field")
    (words,) = [text.replace("\n", " ") for text in texts_of(figure) if "the bar is" in text]
    length = float(words.rpartition(" ")[2])
    (bar,) = [own for own in axes.collections if isinstance(own, LineCollection) and len(own.get_segments()) == 3]
    (ellipses,) = [own for own in axes.collections if isinstance(own, PolyCollection)]
    drawn = np.ptp(bar.get_transform().transform(bar.get_segments()[0])[:, 0])
    rings = ellipses.get_transform().transform(ellipses.get_paths()[0].vertices[:97])
    tensor = grid_on("spd:2").points[0, 0]
    half = np.sqrt(np.linalg.eigvalsh(tensor)[-1])
    across = np.linalg.norm(rings - rings[:96].mean(axis=0), axis=1).max()
    assert drawn / length == pytest.approx(across / half, rel=1e-2)
