"""Files of curves, and damaged copies of them."""

import io
import zipfile

import numpy as np
from curves import S2
from refused import P

import symspline as ss


def stored(spline=None):
    file = io.BytesIO()
    (spline or ss.CubicSpline(None, P, S2)).save(file)
    return file.getvalue()


def load(data):
    return ss.load(io.BytesIO(data))


def restored(curve):
    """The curve, or the collection of curves, after it was saved and loaded."""
    file = io.BytesIO()
    curve.save(file) if hasattr(curve, "save") else ss.save(curve, file)
    file.seek(0)
    return ss.load(file)


def with_arrays(spline=None, **changes):
    """A well-formed file with some arrays replaced, or taken out."""
    arrays = dict(np.load(io.BytesIO(stored(spline)))) | changes
    file = io.BytesIO()
    np.savez(file, **{name: array for name, array in arrays.items() if array is not None})
    return file.getvalue()


def npy(array):
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


def archive(**members):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as target:
        for name, content in members.items():
            target.writestr(name.replace("__", "."), content)
    return file.getvalue()
