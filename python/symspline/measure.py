"""Measurements of a curve, from which `symspline.estimate` fits it.

Each class describes what a sensor reports, and when. Standard deviations are in the units of the measurement.

Examples
--------
>>> import numpy as np
>>> import symspline as ss
>>> gyro = ss.measure.BodyRates([0.0, 0.1], np.zeros((2, 3)), sigma=0.02, bias=ss.measure.Constant(3))
>>> gyro.bias.size
3
"""

from ._estimation.measurements import (
    BodyRates,
    Constant,
    Directions,
    Function,
    Points,
    SpecificForce,
    Velocities,
)

__all__ = [
    "BodyRates",
    "Constant",
    "Directions",
    "Function",
    "Points",
    "SpecificForce",
    "Velocities",
]
