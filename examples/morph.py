"""A leaf that opens: a C² film through three drawings of twelve landmarks."""

import numpy as np

import symspline as ss

angle = np.linspace(0, 2 * np.pi, 13)[:-1]


def leaf(width, tip, turn):
    x, y = width * np.sin(angle) * (1 + tip * np.cos(angle)), np.cos(angle) + tip * np.cos(2 * angle)
    return np.column_stack([x, y]) @ [[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]


drawings = np.stack([leaf(0.15, 0.0, 0.0), leaf(0.4, 0.2, 0.5), leaf(0.7, 0.35, 0.3)])
film = ss.shapes.AffineMorph([0.0, 1.0, 2.5], drawings)
film.plot("leaf.png")
frames = film(np.linspace(0, 2.5, 100))
print(
    f"{len(frames)} frames of {frames.shape[1]} landmarks; length of the path of shapes {film.shape.length():.2f}"
)
