"""The page of figures in headless Chromium: its points are dragged, and its Python programs give the drawn curves."""

from __future__ import annotations

import gzip
import json
import os
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import symspline as ss
from javascript.npm_tools import PAGE, ROOT, TOOLS, node, require

require(PAGE, TOOLS / "playwright-core")
CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")
if CHROMIUM is None:
    pytest.skip("Chromium is not installed: set CHROMIUM to its path", allow_module_level=True)

CURVES = (
    *("globe", "dragged", "noisy", "smooth", "rotations", "turned", "up", "bloch", "ellipses"),
    *("plane", "sphere", "disk"),
)


@pytest.fixture(scope="module", params=[1280, 390])
def seen(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What was seen on the page, at the width of a desktop and of a phone."""
    pictures = Path(os.environ.get("PLAY_PICTURES") or tmp_path_factory.mktemp("pictures"))
    found: dict[str, Any] = json.loads(node("play.mjs", TOOLS, CHROMIUM, PAGE, request.param, pictures, timeout=300))
    return found


def test_nothing_is_logged_and_nothing_is_fetched_from_elsewhere(seen: dict[str, Any]) -> None:
    assert seen["logged"] == []
    assert {url.split(":")[0] for url in seen["requests"]} <= {"file", "data"}
    assert seen["overflow"] <= 0


def test_the_page_starts_soon(seen: dict[str, Any]) -> None:
    # It takes a third of a second on an idle machine; here several tests may run.
    assert seen["times"]["globe"] < 15_000


def test_frames_are_cheap(seen: dict[str, Any]) -> None:
    # A frame of 60 per second has 16.7 ms. Half of them suffices for a loaded machine without a graphics card.
    assert seen["frames"]["count"] > 20
    assert seen["frames"]["median"] < 33


def test_a_dragged_point_follows_the_cursor_and_the_curve_passes_through_it(seen: dict[str, Any]) -> None:
    dragged = seen["dragged"]
    # Longitudes and latitudes are rounded to a hundredth of a degree.
    assert np.hypot(*np.subtract(dragged["place"][:2], dragged["target"])) < 1
    assert np.abs(np.subtract(dragged["knots"], dragged["points"])).max() < 1e-14
    assert np.abs(ss.geo.from_lonlat(*dragged["lonlat"]) - dragged["points"][2]).max() < 1e-15


def test_the_curve_is_twice_continuously_differentiable(seen: dict[str, Any]) -> None:
    near = np.array(seen["dragged"]["near"])
    before, after = near[:, :, 0], near[:, :, 1]
    assert np.abs(after - before).max() < 1e-8
    # The same from points alone: one-sided differences of second order, and their tangential parts.
    h, samples = seen["dragged"]["h"], np.array(seen["dragged"]["differences"])
    side = np.array([-1, 1])[:, None]
    first = side * np.einsum("k,csk...->cs...", [-1.5, 2, -0.5, 0], samples) / h
    second = np.einsum("k,csk...->cs...", [2, -5, 4, -1], samples) / h**2
    p = samples[:, :, 0]
    second -= (second * p).sum(-1, keepdims=True) * p
    assert np.abs(np.diff(first, axis=1)).max() < 1e-5 * np.abs(first).max()
    assert np.abs(np.diff(second, axis=1)).max() < 1e-2 * np.abs(second).max()


def test_the_grabbed_place_of_the_globe_stays_under_the_cursor(seen: dict[str, Any]) -> None:
    turned = seen["turned"]
    assert np.hypot(*np.subtract(turned["place"][:2], turned["target"])) < 0.5
    assert turned["place"][2] > 0


def test_times_keys_and_double_clicks(seen: dict[str, Any]) -> None:
    assert seen["times"]["knot"] == pytest.approx(11, abs=0.1)
    start, up, following, added, removed, later = seen["keys"]
    assert up["lonlat"] != start["lonlat"] and len(up["lonlat"]) == 5
    assert following["selected"] == (start["selected"] + 1) % 5
    assert len(added["t"]) == 6 and len(removed["t"]) == 5 and removed["lonlat"] == up["lonlat"]
    assert later["t"] != removed["t"] or later["selected"] in (0, 4)
    assert len(seen["added"]["t"]) == 6


@pytest.mark.parametrize("name", CURVES)
@pytest.mark.filterwarnings("default")
def test_the_python_program_gives_the_curve_that_is_drawn(seen: dict[str, Any], name: str) -> None:
    shown, scope = seen["curves"][name], run(seen, name)
    x, points = np.array(shown["x"]), np.array(shown["points"])
    values = scope["spline"](x)
    if name == "bloch":
        a, b = np.moveaxis(values, -1, 0)
        across = 2 * a.conj() * b
        values = np.stack([across.real, across.imag, abs(a) ** 2 - abs(b) ** 2], axis=-1)
    scale = np.abs(points).max()
    assert np.abs(values.reshape(points.shape) - points).max() < 1e-12 * max(scale, 1)
    assert np.abs(scope["x"] - x).max() < 1e-12 * x[-1]


def run(seen: dict[str, Any], name: str) -> dict[str, Any]:
    """Run the Python program of a figure."""
    scope: dict[str, Any] = {}
    exec(seen["curves"][name]["program"], scope)
    return scope


def test_graphs_of_the_globe(seen: dict[str, Any]) -> None:
    found, scope = seen["globe"], run(seen, "dragged")
    x, t = np.array(found["x"]), np.array(found["t"])
    assert found["motion"][0] == pytest.approx(scope["speed"], rel=1e-10)
    acceleration = 6371 * np.linalg.norm(scope["spline"](x, nu=2), axis=-1)
    assert found["motion"][1] == pytest.approx(acceleration, rel=1e-8)
    polygon = ss.PiecewiseGeodesic(t, scope["points"], "sphere:2")
    assert np.abs(found["geodesics"]["places"] - polygon(x)).max() < 1e-14
    inner = ~np.isin(x, t)
    assert np.array(found["geodesics"]["speed"])[inner] == pytest.approx(6371 * polygon.speed(x)[inner])
    # Jumps of the velocity at the inner knots, relative to the largest speed.
    h = 1e-6
    jumps = [np.linalg.norm(polygon(k + h, nu=1) - polygon(k - h, nu=1)) for k in t[1:-1]]
    jumps /= polygon.speed(x).max()
    assert np.array(found["geodesics"]["jumps"]) == pytest.approx(np.column_stack([t[1:-1], jumps]), rel=1e-5)


def test_graphs_of_longitude_and_latitude(seen: dict[str, Any]) -> None:
    found = seen["globe"]
    flat = CubicSpline(found["t"], found["lonlat"], bc_type="not-a-knot")
    x, h = np.array(found["x"])[1:-1], 2e-4
    before, at, after = (ss.geo.from_lonlat(*flat(x + step).T) for step in (-h, 0, h))
    assert np.abs(found["naive"]["places"][1:-1] - at).max() < 1e-12
    speed = np.linalg.norm(after - before, axis=-1) / (2 * h)
    second = (before - 2 * at + after) / h**2
    second -= (second * at).sum(-1, keepdims=True) * at
    assert found["naive"]["speed"][1:-1] == pytest.approx(6371 * speed, rel=1e-5)
    wanted = 6371 * np.linalg.norm(second, axis=-1)
    assert found["naive"]["acceleration"][1:-1] == pytest.approx(wanted, abs=1e-4 * wanted.max())


def test_graphs_of_rotations(seen: dict[str, Any]) -> None:
    found, scope = seen["rotations"], run(seen, "turned")
    x, times = np.array(found["x"]), np.array(found["times"])
    assert found["motion"][0] == pytest.approx(np.linalg.norm(scope["rates"], axis=-1), rel=1e-10)
    second = np.rad2deg(ss.rotations.angular_acceleration(scope["spline"], x))
    assert found["motion"][1] == pytest.approx(np.linalg.norm(second, axis=-1), rel=1e-8, abs=1e-8)
    spline, slerp, euler = np.swapaxes(np.reshape(found["at"], (len(times), 3, 3, 3)), 0, 1)
    assert np.abs(spline - scope["spline"](times)).max() < 1e-12
    polygon = ss.PiecewiseGeodesic(found["t"], scope["points"], "so:3")
    assert np.abs(slerp - polygon(times)).max() < 1e-12
    knot = np.isin(x, found["t"])
    assert np.array(found["slerp"]["speed"])[~knot] == pytest.approx(np.rad2deg(polygon.speed(x))[~knot])
    # Euler angles: the rotation between two times, by the trace of the matrix of a small turn.
    before, after = np.swapaxes(np.reshape(found["near"], (len(times), 2, 3, 3)), 0, 1)
    rate = np.rad2deg(np.linalg.norm(after - before, axis=(1, 2)) / np.sqrt(2) / (2 * found["h"]))
    assert np.interp(times, x, found["euler"][0]) == pytest.approx(rate, rel=1e-5)
    assert np.abs(np.swapaxes(euler, 1, 2) @ euler - np.eye(3)).max() < 1e-12


def test_field_and_areas(seen: dict[str, Any]) -> None:
    pauli = np.array([[[0, 1], [1, 0]], [[0, -1j], [1j, 0]], [[1, 0], [0, -1]]])
    hamiltonians = run(seen, "bloch")["H"]
    assert np.abs(seen["field"] - np.einsum("xij,kji->xk", hamiltonians, pauli).real).max() < 1e-10
    assert seen["area"] == pytest.approx(run(seen, "ellipses")["areas"], rel=1e-10)


def test_the_construction_ends_on_the_curve(seen: dict[str, Any]) -> None:
    assert np.abs(np.subtract(*seen["construction"].values())).max() < 1e-13


def test_opposite_points_give_a_message(seen: dict[str, Any]) -> None:
    assert "cut locus" in seen["antipodes"]["message"]
    assert "cut locus" not in seen["antipodes"]["after"]


def test_the_globe_can_be_mounted_elsewhere(seen: dict[str, Any]) -> None:
    assert seen["hero"] == {"pictures": 0, "width": 320, "points": 5}
    assert seen["code"].startswith("import numpy as np")


def test_the_page_is_small() -> None:
    files = [PAGE, PAGE.with_name("play.js"), PAGE.with_name("play.css")]
    assert sum(len(gzip.compress(file.read_bytes())) for file in files) < 1e6


def test_coastlines_are_those_of_the_package() -> None:
    with np.load(ROOT / "python/symspline/_plotting/land.npz") as file:
        rings = np.split(file["points"] / 100, file["starts"])
    kept = json.loads((ROOT / "docs/play/land.json").read_text())
    assert len(kept) == len(rings)
    for differences, ring in zip(kept, rings, strict=True):
        corners = np.reshape(differences, (-1, 2)).cumsum(axis=0) / 10
        distance = np.abs(ring[:, None] - corners).max(axis=-1).min(axis=1)
        assert distance.max() <= 0.0501
