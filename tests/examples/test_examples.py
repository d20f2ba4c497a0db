"""The examples run and draw their pictures."""

import re
import runpy
from pathlib import Path

import matplotlib.pyplot as plt
import pytest
from gallery_texts import TEXTS
from matplotlib.figure import Figure
from matplotlib.image import imread

FOLDER = Path(__file__).parents[2] / "examples"
SAYS = {
    "attitude": r"at 6.5 minutes: \[",
    "imu_from_a_recording": "",
    "qubit_control": r"the same .* 1\.\d\d of 1\.57 apart\nmissed by (\d\.\de-1[4-7]|0\.0e\+00), strongest field "
    r".*\nQuTiP comes through all six, up to (-?\de-1\d|0e\+00)",
    "tensor_volume": r"35\d\d voxels, mean diffusivity 1\.00e-03 mm²/s, all positive: True",
    "dti_volume": r"(?s)noisy, six numbers, linear +off by 6\.\d\d %, determinant up to 3\.\d .*cubic.* [1-9] tensors "
    r"not positive.*clean, log-Euclidean, cubic +off by 0\.1\d %.*clean, grid spline +off by 0\.\d\d %.*1\.6 times",
    "pod_over_a_parameter": r"4 numbers in place of 80: off by 0\.\d%; with interpolated numbers by \d\d\.\d%",
    "reduced_bases_over_two_parameters": r"largest error: numbers interpolated 1\d\.\d%, GridSpline 1\.4%, own "
    r"simulation 1\.4%\nfrom 4 x 4 matrices at the nodes: 1\.[34]%",
    "storms_from_a_table": "37 storms, 946 fixes, 5900 hours; fastest: Martin 2022",
    "noisy_gps": r"1\d degrees of freedom; half way known to 4\.\d m",
    "crystal_orientations": r"median error: \d\d\.\d degrees without the symmetry, 0\.\d\d with it\n"
    r"measured map: 0\.7\d degrees .*\nsmooth map: 0\.1\d degrees .*\n"
    r"steps between rows that jump: \d{4} as measured, 0 with",
    "poses_over_joints": r"Linear .* 58 % of its volume\.\nLargest error of the position: 5 mm\n"
    r"matrices, projected: largest error 7\.\d°\nquaternions: largest error 1\d\d\.\d°\nGridSpline: .* 0\.6°",
    "noisy_attitude": r"noise 1\.0\d degrees found; the curve is off by 0\.[45]\d degrees",
    "star_tracker_and_gyro": r"gyro bias, degrees/s: 0\.59 ± 0\.01, -0\.4\d ± 0\.01, 0\.8\d ± 0\.01",
    "ship_with_gaps": r"through the positions: up to 1\.\d km off\nwith speed and course: up to 0\.3 km off\n"
    r"distance sailed: 91\.\d ± 0\.4 km",
    "drone_imu": r"positions: 0\.3\d m off with GPS only, 0\.[12]\d m with the IMU\nattitude: 0\.1\d degrees off",
    "time_offset": r"offset 43\d\.\d ± 1\.9 ms; the true offset is 437 ms",
    "noisy_tensors": r"noise 0\.1[3-6] in every coordinate; the curve is off by 0\.1\d",
    "polar_wander": r"[5-8] degrees of freedom; 100 million years ago A95 is 2\.\d degrees",
    "noisy_camera": r"λ = 0\.04\d*, noise 0\.04\d m; λ = 0\.3\d*, noise 0\.05\d rad",
    "field_on_a_grid": r"2592 curves in 4 blocks, 2592 converged; the field turns by up to 0.2\d degrees a year",
    "first_curve": r"lengths from 0\.\d\d to 1\.\d\d; of the spline 1 ± \de-16",
    "five_orientations": r"largest step of a component: 0\.00\d\non S³ and on SO\(3\): \de-1[3-6] apart",
    "tracking_gap": r"longest time between points: 12\.1 s",
    "seven_joints": r"the motion takes 1\.44 s",
    "camera_path": r"from frame to frame 57\.\d to 57\.\d mm",
    "date_line": r"speed 17\.2 m/s, course 123 degrees",
    "wind_over_a_year": r"on 1 December \(x = 10\.5\) from 35\d degrees, and the spline of the degrees gives 188",
    "covariances": r"grams or kilograms: \de-1[2-6] apart",
    "diffusion_tensors": r"log det off a cubic spline by \de-1[4-6]",
    "affine_shapes": r"the curve crosses the rim 1 time; largest speed 1\.16, also near \(C\)",
    "fit_by_gradient_in_jax": r"off by 3\.\d degrees at first, and by 1\.\d in the end",
    "de_casteljau": r"the polynomial is as deep as 0\.25 .*\ncompiled and by hand: (0e\+00|\de-1[5-9]) apart",
    "c2_condition": r"(?s)Catmull–Rom: .*e-0[12]\nC² spline: the two sides differ by( \d\.\de-1[4-6]){3}",
    "where_the_iteration_converges": (
        r"(?s)quasi-newton: \d+ iterations, bending energy 348.*auto: .*energy 340"
        r".*V 0\.23\d; bound of the contraction 0\.665, measured 0\.4\d"
    ),
}


@pytest.mark.parametrize("name", SAYS)
def test_a_recipe_draws_a_picture(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    plt.switch_backend("agg")
    # Which says that it cannot, without a screen.
    monkeypatch.setattr(plt, "show", lambda: None)
    names = runpy.run_path(str(FOLDER / f"{name}.py"))
    said = capsys.readouterr().out
    assert re.match(SAYS[name], said), said
    of_pyplot = [plt.figure(number) for number in plt.get_fignums()]
    others = [value for value in names.values() if isinstance(value, Figure)]
    figures = list(dict.fromkeys(of_pyplot + others))
    # The gallery has an alternative text for each, and a thumbnail of one of their axes.
    texts = TEXTS[name]
    number, axes = texts.subject
    assert len(figures) == len(texts.alt) >= number and 0 < texts.share <= 1
    assert any(axes < len(figure.axes) for figure in figures)
    for number, figure in enumerate(figures):
        figure.savefig(tmp_path / f"{number}.png", dpi=40)
    plt.close("all")
    pictures = list(tmp_path.glob("*.png"))
    # Neither white nor of one colour.
    assert pictures and all(imread(picture)[..., :3].std() > 0.02 for picture in pictures)


def test_every_recipe_is_here():
    names = sorted(path.stem for path in FOLDER.glob("*.py"))
    assert names == sorted(SAYS) == sorted(TEXTS)


def test_alternative_texts_are_sentences():
    for texts in TEXTS.values():
        assert all(40 < len(alt) < 300 and alt[0].isupper() and alt.endswith(".") for alt in texts.alt)
        assert len(set(texts.alt)) == len(texts.alt)
