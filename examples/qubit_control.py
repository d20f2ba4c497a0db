"""
Control of a qubit, both steps (Fig. 6)
=======================================

§4.2 of the paper: a curve through six states of a qubit, drawn on the Bloch sphere, and the Hamiltonian that drives the
states along it.
"""

# %%
# The naive way
# -------------
# Kets come with any phase: two kets that differ by a factor of modulus one are the same state. A spline through their
# complex numbers takes the phases for data. The curve below goes through the same six states, but between
# them it depends on phases that mean nothing.

import matplotlib.pyplot as plt
import numpy as np
import qutip
from scipy.interpolate import CubicSpline

import symspline as ss

# The paper does not give its states; these are six points on the Bloch sphere.
azimuth, polar = np.radians([[0, 60, 100, 170, 220, 300], [30, 70, 120, 100, 50, 80]])
times = np.array([0.0, 1.0, 2.0, 3.5, 4.5, 6.0])
kets = np.stack([np.cos(polar / 2), np.exp(1j * azimuth) * np.sin(polar / 2)], axis=-1)
phases = np.exp([0, 2j, 5j, 1j, 4j, 3j])
x = np.linspace(0, 6, 600)


def naive(kets):
    numbers = CubicSpline(times, kets, bc_type="natural")(x)
    return numbers / np.linalg.norm(numbers, axis=1, keepdims=True)


between = ss.space("cp:1").distance(naive(kets), naive(phases[:, None] * kets))
print(f"the same states with other phases: up to {between.max():.2f} of {np.pi / 2:.2f} apart")

# %%
# First step: the curve
# ---------------------
# On ``cp:1`` phases play no part.

path = ss.CubicSpline(times, kets, "cp:1")
other = ss.CubicSpline(times, phases[:, None] * kets, "cp:1")
assert path.space.distance(path(x), other(x)).max() < 1e-7

bloch = path.plot()

# %%
# Second step: the fields
# -----------------------
# Fields along x, y and z that are constant during each pulse, and drive the states through all six exactly.

PAULIS = np.array([[[0, 1], [1, 0]], [[0, -1j], [1j, 0]], [[1, 0], [0, -1]]])
edges = np.linspace(0, 6, 49)  # among them all the times
fields = ss.quantum.pulses(path, edges, operators=PAULIS)  # one row of three strengths a pulse

state = path.points[0]
for strengths, duration in zip(fields, np.diff(edges), strict=True):
    values, vectors = np.linalg.eigh(np.einsum("q,qab->ab", strengths, PAULIS))
    state = vectors @ (np.exp(-1j * values * duration) * (vectors.conj().T @ state))
print(f"missed by {path.space.distance(state, path.points[-1]):.1e}, strongest field {abs(fields).max():.2f}")

# The continuous Hamiltonian, in QuTiP's own solver of Schrödinger's equation:
found = qutip.sesolve(
    ss.quantum.qobjevo(path), qutip.Qobj(path.points[0]), times, options={"rtol": 1e-10, "atol": 1e-12}
)
overlaps = [
    abs(np.vdot(ket, there.full())) ** 2 for ket, there in zip(path.points, found.states, strict=True)
]
print(f"QuTiP comes through all six, up to {1 - min(overlaps):.0e}")

smooth = np.einsum("xab,qba->xq", ss.quantum.hamiltonian(path, x), PAULIS).real / 2
figure, axes = plt.subplots(2, figsize=(8, 5), sharex=True, layout="constrained")
axes[0].plot(x, np.abs(naive(kets)[:, 0]) ** 2, color="0.6", label="components")
axes[0].plot(
    x, np.abs(naive(phases[:, None] * kets)[:, 0]) ** 2, color="0.6", linestyle=":", label="other phases"
)
axes[0].plot(x, np.abs(path(x)[:, 0]) ** 2, label="spline")
axes[0].plot(times, np.abs(kets[:, 0]) ** 2, "k.")
axes[0].set(ylabel="probability of |0⟩")
axes[0].legend(ncols=3)
for i, name in enumerate("xyz"):
    axes[1].plot(x, smooth[:, i], f"C{i}", label=name)
    axes[1].stairs(fields[:, i], edges, color=f"C{i}", alpha=0.5)
axes[1].set(xlabel="time", ylabel="field", title="The Hamiltonian of the curve, continuous, and its pulses")
axes[1].legend(ncols=3)
plt.show()
