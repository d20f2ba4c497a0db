"""Times whose spacing in double precision is coarse."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .warnings import warn

# Rounding of times, as a fraction of the time step, beyond which accelerations are affected.
_COARSE = 1e-4
REMEDY = (
    "Subtract the first time before the conversion to floating-point numbers, or pass integers or datetime64[ns], "
    "which are exact."
)


def warn_of_rounded_times(times: NDArray[Any], name: str = "t", remedy: str = REMEDY) -> None:
    """Warn if the spacing of floating-point numbers is more than 1e-4 of the median time step.

    Whole numbers are exact and cause no warning. Accelerations depend on squares of time steps. Times in seconds since
    1970, which are rounded to 2.4e-7 s, therefore yield wrong accelerations at 1 kHz.
    """
    if times.dtype.kind != "f" or times.shape[-1:] < (2,) or not times.size:
        return
    kept = times[np.isfinite(times)]
    if not kept.size:
        return
    largest = kept[np.argmax(np.abs(kept))]
    spacing = float(np.spacing(np.abs(largest)))
    with np.errstate(over="ignore", invalid="ignore"):
        steps = np.abs(np.diff(times, axis=-1))
        steps = steps[(steps > 0) & (steps < np.inf)]
        step = float(np.median(steps)) if steps.size else np.inf
    if not spacing > _COARSE * step or np.array_equal(kept, np.rint(kept)):
        return
    warn(
        f"{name} near {largest:.9g} are rounded to multiples of {spacing:.2g} by the type {times.dtype}, which is "
        f"{spacing / step:.2g} of the time step {step:.3g}. Accelerations are wrong, and with coarser rounding also "
        f"velocities. {remedy}",
        UserWarning,
    )
