"""Splines as differentiable functions in PyTorch.

>>> import torch
>>> from symspline.torch import evaluate, fit
>>> points = torch.eye(3, dtype=torch.float64, requires_grad=True)
>>> t = torch.arange(3.0, dtype=torch.float64)
>>> velocities = fit(t, points, "sphere:2")
>>> evaluate(t, points, velocities, "sphere:2", [0.5, 1.5]).shape
torch.Size([2, 3])
"""

from ._compiled import curve
from ._native import evaluate, fit

__all__ = ["curve", "evaluate", "fit"]
