"""The numbers on ``docs/guide/measurements.md`` are those of its code."""

import re
from pathlib import Path

import numpy as np
from pages import blocks, run

PAGE = Path(__file__).parents[2] / "docs/guide/measurements.md"


def test_the_numbers_are_those_of_the_code():
    names, text = {}, PAGE.read_text(encoding="utf-8")
    for block in blocks(PAGE):
        run(block, PAGE, names)
    assert f"curve.report.sigma  # {names['curve'].report.sigma:.2f}\n" in text
    bias = names["bias"]
    assert f"# ({', '.join(f'{value:.3f}' for value in bias.value)}), each ± {bias.std.max():.3f};" in text
    value, std, true = re.search(
        r"offset.std  # ([\d.]+) and ([\d.]+) seconds; the true offset is ([\d.]+)", text
    ).groups()
    offset = names["offset"]
    assert (f"{offset.value[0]:.3f}", f"{offset.std[0]:.3f}") == (value, std)
    assert abs(offset.value[0] - float(true)) < 3 * offset.std[0]
    assert np.abs(names["again"](names["t"]) - names["track"](names["t"])).max() < 1e-10
    errors = names["so3"].distance(names["robust"](names["t"]), names["truth"](names["t"]))
    assert (errors < names["robust"].band(names["t"])).all()
