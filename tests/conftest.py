"""A map of the tests.

    spaces       operations, laws of geometry, names; points that are off a space
    fit          the spline is C² and obeys its laws; solvers
    spline       the interface of `CubicSpline`, promise by promise, with what it refuses
    motion       what curves of rotations and poses are asked: rates, quaternions, recordings
    derivatives  with respect to the data
    in_jax       the compiled spline as a function in JAX, and those that are all JAX
    free         `BSpline` and `BezierCurve`
    files, convert, cli, plotting, demo
    manifolds    curves on manifolds that are made of functions, Stiefel manifolds, surfaces; the public suite of laws
    geo          places, speed and course on a globe
    quantum      Hamiltonians, propagators, pulses, the Bloch sphere
    subspaces    reduced bases over a parameter
    tensors      diffusion tensors in the order of each program, NIfTI files
    shapes       affine shapes of landmarks, morphs and their pictures
    xarray_dask  curves in xarray objects, in blocks of dask, on workers that die
    host         the program around: threads, memory, interruptions, arrays of other libraries
    docs, bench  what they show runs
    examples     the recipes run
    fuzz         random input; `make fuzz` runs it at length
    raw_data     data as people bring them: gaps, repeats, missing samples, huge offsets, over every entry
    oracles, pytorch   have environments of their own: `make test-oracles`, `make test-torch`

Beside this file lies what they share: `cases` is the list of spaces and data on them, `curves` has arrays and
comparisons, `refused` what must be an error, `lifting` the horizontal lift by a general solver.
"""

import signal

import pytest

import symspline as ss

# What a shell starts in the background ignores Ctrl-C, and so would all that tests start.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def threads():
    """Puts the number of threads back."""
    yield
    ss.set_num_threads(0)
