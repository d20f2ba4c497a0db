"""The public interface changes on purpose only."""

import interface
import pytest

pytest.importorskip("jax")
pytest.importorskip("xarray")


def test_the_interface_is_that_of_the_snapshot():
    wanted = interface.SNAPSHOT.read_text(encoding="utf-8").splitlines()
    assert interface.interface() == wanted, "run `python tests/interface.py` if the change is meant"
