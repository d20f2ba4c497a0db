"""Animations: what moves, where to, and files."""

import json
import subprocess

import matplotlib.animation
import numpy as np
import pytest
from drawn import VIEWS, rate_axes, spline_on, texts_of
from PIL import Image
from refused import raises


def at_time(curve, x):
    """The figure of an animation at a time, counted from the first."""
    moving = curve.animate(frames=2)
    moving._draw_was_started = True
    moving._func(x)
    return moving._fig


@pytest.mark.parametrize("name", VIEWS[::3])
def test_every_space_moves(name):
    figure = at_time(spline_on(name), 0.5)
    assert "t = 0.5" in texts_of(figure)
    for axes in rate_axes(figure)[0]:
        cursor, dot = axes.lines[-1], axes.lines[-2]
        (line,) = [line for line in axes.lines if line.get_gid() == "_curve"]
        assert cursor.get_xdata()[0] == 0.5
        np.testing.assert_allclose(dot.get_xydata(), [[0.5, np.interp(0.5, *line.get_data())]], atol=1e-12)


def test_files_of_animations(tmp_path):
    path = tmp_path / "a.gif"
    spline_on("r:1").animate(path, frames=3, fps=10)
    with Image.open(path) as image:
        assert image.n_frames == 3 and image.info["duration"] == 100
    assert [own.name for own in tmp_path.iterdir()] == ["a.gif"]


@pytest.mark.skipif(not matplotlib.animation.writers.is_available("ffmpeg"), reason="ffmpeg is not installed")
@pytest.mark.parametrize("kind", ["mp4", "webm"])
def test_films(tmp_path, kind):
    """ffprobe counts the frames, and reads the size and the rate."""
    path = tmp_path / f"a.{kind}"
    spline_on("so:3").animate(path, frames=4, fps=8)
    shown = "stream=nb_read_frames,r_frame_rate,width,height"
    command = ["ffprobe", "-v", "error", "-count_frames", "-show_entries", shown, "-of", "json", str(path)]
    (stream,) = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)["streams"]
    assert stream["nb_read_frames"] == "4" and stream["r_frame_rate"] == "8/1"
    width, height = spline_on("so:3").plot().get_size_inches()
    assert abs(stream["width"] - 80 * width) < 2 and abs(stream["height"] - 80 * height) < 2
    assert [own.name for own in tmp_path.iterdir()] == [f"a.{kind}"]


def test_films_need_ffmpeg(tmp_path, monkeypatch):
    monkeypatch.setattr(matplotlib.animation.writers, "is_available", lambda name: name == "pillow")
    raises("needs the program ffmpeg, which is not installed", spline_on("r:1").animate, tmp_path / "a.mp4")


def test_invalid_arguments(tmp_path):
    animate = spline_on("r:1").animate
    raises("must end in .gif", animate, tmp_path / "a.png")
    raises("frames must be", animate, frames=1)
    raises("fps must be", animate, fps=0)
    raises("this is a batch of 3 curves", spline_on("r:1", (3, 5)).animate)
    for name in ("a.gif", "a.mp4"):
        raises("is an animation, but plot writes still images", spline_on("r:1").plot, tmp_path / name)
    assert not list(tmp_path.iterdir())
