"""Steer a qubit through six states (Fig. 6 of the paper) by pulses in three fields."""

import numpy as np

import symspline as ss

PAULIS = np.array([[[0, 1], [1, 0]], [[0, -1j], [1j, 0]], [[1, 0], [0, -1]]])

# The paper does not give its states; these are six places on the Bloch sphere.
places = ss.geo.from_lonlat([0, 60, 100, 170, 220, 300], [60, 20, -30, -10, 40, 10])
times = np.array([0.0, 1.0, 2.0, 3.5, 4.5, 6.0])
path = ss.CubicSpline(times, ss.quantum.from_bloch_vector(places), "cp:1")

edges = np.linspace(0, 6, 49)  # among them all the times
fields = ss.quantum.pulses(path, edges, operators=PAULIS)  # one row of three strengths a pulse

state = path.points[0]
for strengths, duration in zip(fields, np.diff(edges), strict=True):
    values, vectors = np.linalg.eigh(np.einsum("q,qab->ab", strengths, PAULIS))
    state = vectors @ (np.exp(-1j * values * duration) * (vectors.conj().T @ state))
print(f"missed by {path.space.distance(state, path.points[-1]):.1e}, strongest field {abs(fields).max():.2f}")
path.plot("qubit.png")
