"""
A morph between drawings
========================

A leaf that opens: a film through three drawings of twelve landmarks.
"""

# %%
# The naive way
# -------------
# Move every landmark on a straight line to its next place. When the leaf turns, it shrinks on the way, and at every
# drawing it stops dead and starts in another direction.

import matplotlib.pyplot as plt
import numpy as np

import symspline as ss

angle = np.linspace(0, 2 * np.pi, 13)[:-1]


def leaf(width, tip, turn):
    x, y = width * np.sin(angle) * (1 + tip * np.cos(angle)), np.cos(angle) + tip * np.cos(2 * angle)
    return np.column_stack([x, y]) @ [[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]


t = np.array([0.0, 1.0, 2.5])
drawings = np.stack([leaf(0.15, 0.0, 0.0), leaf(0.4, 0.2, 2.2), leaf(0.7, 0.35, 1.2)])

x = np.linspace(0, 2.5, 100)
later = np.clip(np.searchsorted(t, x), 1, 2)
share = ((x - t[later - 1]) / (t[later] - t[later - 1]))[:, None, None]
straight = (1 - share) * drawings[later - 1] + share * drawings[later]

# %%
# The morph
# ---------
# `AffineMorph` takes apart what is shape and what is affine map, and puts a C² spline through each.

film = ss.shapes.AffineMorph(t, drawings)
frames = film(x)
print(
    f"{len(frames)} frames of {frames.shape[1]} landmarks; length of the path of shapes {film.shape.length():.2f}"
)


def tip_speed(frames):
    return np.linalg.norm(np.gradient(frames[:, 0], x, axis=0), axis=-1)


figure, (above, below) = plt.subplots(2, figsize=(9, 5.5), height_ratios=(2, 1), layout="constrained")
for row, (pictures, colour, label) in enumerate(
    ((straight, "0.6", "straight lines"), (frames, "C0", "morph"))
):
    for i in range(0, 100, 9):
        above.fill(*(pictures[i] + [0.28 * i, -3 * row]).T, facecolor=colour, alpha=0.3)
        above.fill(*(pictures[i] + [0.28 * i, -3 * row]).T, facecolor="none", edgecolor=colour)
    below.plot(x, tip_speed(pictures), color=colour, label=label)
above.set(aspect="equal", yticks=[0, -3], yticklabels=["straight lines", "morph"], xticks=[])
below.set(xlabel="time", ylabel="speed of one landmark")
below.legend()

# %%
# The picture that every morph can draw of itself:

strip = film.plot()
plt.show()
