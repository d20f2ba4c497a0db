"""Quantum states: the Hamiltonians that steer a system along a curve, pulses, propagators, the Bloch sphere.

A curve of `ComplexProjective` is a path of pure states, one of `ComplexGrassmannian` a path of subspaces (of
logical states, say), one of `Unitary` or `SpecialUnitary` a path of gates. This is the second step of §4.2 of
the paper. Everywhere iψ' = Hψ, with ħ = 1; the paper has the other sign.

>>> import numpy as np, symspline as ss
>>> path = ss.CubicSpline([0, 1, 2], [[1, 0], [0.8, 0.6j], [0.6, 0.8]], "cp:1")
>>> H = ss.quantum.hamiltonian(path, np.linspace(0, 2, 5))
>>> U = ss.quantum.propagator(path, 1.0)
>>> ss.CubicSpline(None, [U @ path.points[0], path.points[1]], "cp:1").length().round(8)
np.float64(0.0)
"""

from .generators import hamiltonian
from .propagation import propagator
from .pulse_trains import pulses
from .solvers import qobjevo
from .states import bloch_vector, from_bloch_vector, from_kets

__all__ = [
    "bloch_vector",
    "from_bloch_vector",
    "from_kets",
    "hamiltonian",
    "propagator",
    "pulses",
    "qobjevo",
]
