"""The size of rounding errors in tests."""


def rounding(space, p):
    """The distance between neighbouring floating-point points at p, in units of 2.2e-16."""
    return space._rounding(p)
