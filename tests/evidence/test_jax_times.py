"""The table of ``docs/jax.md`` can be made."""

import jax
import jax_times


def test_the_table_can_be_made():
    with jax.enable_x64(True):
        lines = jax_times.times_table(curves=2, runs=1).splitlines()
    assert len(lines) == 6 and all(line.count("|") == 4 for line in lines)
