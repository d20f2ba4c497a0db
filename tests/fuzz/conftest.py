"""The number of examples of the fuzzers, which are others in every run."""

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

# What a slow machine or the garbage collector costs is no hang: `outcomes` has a limit of its own.
settings.register_profile(
    "fuzz", max_examples=8000, deadline=None, suppress_health_check=list(HealthCheck), print_blob=True
)
settings.load_profile("fuzz")


@pytest.fixture(autouse=True)
def short_arrays():
    """Arrays in reports of what failed are short."""
    with np.printoptions(threshold=20, edgeitems=2):
        yield
