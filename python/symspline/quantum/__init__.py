"""Quantum control: Hamiltonians that steer a system along a curve, pulses, propagators, the Bloch sphere.

A curve on `ComplexProjective` is a path of pure states, a curve on `ComplexGrassmannian` a path of subspaces (such as
logical states), and a curve on `Unitary` or `SpecialUnitary` a path of gates. The module implements the second step of
§4.2 of the paper. All functions use iψ' = Hψ with ħ = 1; the paper uses the opposite sign.

Examples
--------
>>> import numpy as np, symspline as ss
>>> path = ss.CubicSpline([0, 1, 2], [[1, 0], [0.8, 0.6j], [0.6, 0.8]], "cp:1")
>>> H = ss.quantum.hamiltonian(path, np.linspace(0, 2, 5))
>>> U = ss.quantum.propagator(path, 1.0)
>>> ss.CubicSpline(None, [U @ path.points[0], path.points[1]], "cp:1").length().round(8)
np.float64(0.0)
"""

from ._generators import hamiltonian
from ._propagation import propagator
from ._pulse_trains import pulses
from ._solvers import qobjevo
from ._states import bloch_vector, from_bloch_vector, from_kets

__all__ = ["bloch_vector", "from_bloch_vector", "from_kets", "hamiltonian", "propagator", "pulses", "qobjevo"]
