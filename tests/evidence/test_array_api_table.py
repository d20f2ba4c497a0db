"""The table of array libraries in ``docs/array_api.md`` is that of new calls, for the libraries that are installed."""

import array_api_table
import jax
import pytest

# PyTorch warns of its own code.
pytestmark = pytest.mark.filterwarnings("ignore:`torch.jit:FutureWarning", "ignore:`torch.jit:DeprecationWarning")


def test_the_table_is_up_to_date():
    before = jax.config.read("jax_disable_most_optimizations")
    jax.config.update("jax_disable_most_optimizations", True)
    try:
        page = array_api_table.PAGE.read_text("utf-8")
        assert array_api_table.page(page) == page, "run python docs/array_api_table.py"
    finally:
        jax.config.update("jax_disable_most_optimizations", before)


def test_entries_of_other_libraries_are_kept(monkeypatch):
    monkeypatch.setattr(array_api_table, "find_spec", lambda name: None)
    monkeypatch.setattr(array_api_table, "functions", dict)
    page = array_api_table.PAGE.read_text("utf-8")
    kept = array_api_table.page(page)
    names = [line for line in page.splitlines() if line.startswith("| `symspline.torch.")]
    assert names and all(line in kept for line in names)
