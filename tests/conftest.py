"""A map of the tests.

    spaces       operations, laws of geometry, names; points that are off a space
    fit          the spline is C² and obeys its laws; solvers
    spline       the interface of `CubicSpline`, promise by promise, and its errors
    motion       curves of rotations and poses: rates, quaternions, recordings
    derivatives  with respect to the data
    in_jax       the compiled spline as a function in JAX, and splines written in JAX
    free         `BSpline`, `BezierCurve` and `CumulativeBSpline`
    files, convert, cli, plotting
    manifolds    curves on manifolds made of functions, Stiefel manifolds, surfaces; the public suite of laws
    geo          positions, speed and course on a globe
    quantum      Hamiltonians, propagators, pulses, the Bloch sphere
    subspaces    reduced bases over a parameter
    tensors      diffusion tensors in the order of each program
    shapes       affine shapes of landmarks, and their page
    xarray_dask  curves in xarray objects, in blocks of dask
    host         threads, memory, progress, arrays of other libraries
    typing       annotations, as type checkers read them
    docs         the code of the documentation runs
    release      licences, README and metadata of the packages agree with their sources
    raw_data     recordings with gaps, duplicates, missing samples and huge offsets, through every entry point

Outside the default run:
    evidence     formulas of the paper and of the theory, comparisons, tables and figures of pages: `make docs`
    examples, bench, javascript   the recipes and the benchmarks run: `make test-programs`
    fuzz         random input: `make fuzz`
    timing       what depends on the time or the memory that the machine has left, workers that die: `make test-timing`
    oracles, pytorch   have environments of their own: `make test-oracles`, `make test-torch`

Shared modules: `cases` has the one list of spaces, the one list of end conditions, data on them, and decorators that
run several values within one case of pytest; `curves` has arrays, `lie` the algebra of each group, `compare`
comparisons, `refused` invalid input, `limited` scripts with little memory, `pages` code and tables of the
documentation, `stored` files of curves and damaged copies of them.

A law of spaces runs as one case per family (`cases.every_family`), whatever does not depend on the formulas of a
space on `cases.REPRESENTATIVE`. Lists that would multiply take turns instead.
"""

import gc
import importlib.metadata
import os
import signal
import sys

import numpy as np
import pytest

import symspline as ss

# Type checkers read these files. They are not run.
collect_ignore = ["typing/right.py", "typing/wrong.py"]

# Without these emitters XLA compiles a third faster; it reads this when the first array is made. Versions that do not
# know the flag end the process.
try:
    if importlib.metadata.version("jaxlib").startswith("0.10."):
        os.environ.setdefault("XLA_FLAGS", "--xla_cpu_use_fusion_emitters=false")
except importlib.metadata.PackageNotFoundError:
    pass


def pytest_collection_finish() -> None:
    """Spare the garbage collector what stays until the end: modules and thousands of cases, a tenth of its time."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 100)


# What a shell starts in the background ignores Ctrl-C, and so would all that tests start.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def rng(request):
    """Random numbers, the same in every run. A module chooses others by ``SEED``."""
    return np.random.default_rng(getattr(request.module, "SEED", 1815))


@pytest.fixture
def threads():
    """Puts the number of threads back."""
    yield
    ss.set_num_threads(0)


PEAKS = {}
"""The largest resident sizes so far, of this process and of its children, in kB."""


@pytest.fixture(autouse=True)
def memory():
    """No test takes 2 GB. A process of JAX keeps up to two more: what it compiled for all of its tests.

    The operating system knows the largest size of all tests so far: the test that raises it has taken the memory.
    """
    yield
    if sys.platform == "linux":
        import resource

        # Children that are forked begin with all that this process has.
        limit = (4 if "jax" in sys.modules else 2) * 2**20
        for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN):
            before, PEAKS[who] = PEAKS.get(who, 0), resource.getrusage(who).ru_maxrss
            assert PEAKS[who] < limit or PEAKS[who] == before, f"the largest resident size is {PEAKS[who]} kB"
