"""How long symspline takes, beside SciPy and ``splines``: ``python -m benchmarks [--quick]``."""
