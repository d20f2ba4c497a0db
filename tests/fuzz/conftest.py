"""Profiles of the fuzzers: "short" is part of every test run and deterministic, "long" is for `make fuzz`."""

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

# What a slow machine or the garbage collector costs is no hang: `outcomes` has a limit of its own.
_COMMON = {"deadline": None, "suppress_health_check": list(HealthCheck), "print_blob": True}
settings.register_profile("short", max_examples=100, derandomize=True, database=None, **_COMMON)
settings.register_profile("long", max_examples=8000, **_COMMON)


def pytest_configure(config):
    """The short one, unless --hypothesis-profile names another."""
    if config.getoption("--hypothesis-profile") is None:
        settings.load_profile("short")


@pytest.fixture(autouse=True)
def short_arrays():
    """Arrays in reports of what failed are short."""
    with np.printoptions(threshold=20, edgeitems=2):
        yield
