import pytest

import symspline as ss


@pytest.fixture
def threads():
    """Puts the number of threads back."""
    yield
    ss.set_num_threads(0)
