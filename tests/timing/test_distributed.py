"""A cluster of worker processes on this machine: results do not depend on failing workers."""

import os
import signal
import sys
import time

import dask
import numpy as np
import pytest
import xarray as xr
from compare import same
from curves import S2, points_on, run_python
from distributed import Client, LocalCluster, as_completed, futures_of
from refused import raises

import symspline as ss
import symspline.xarray as sx

BLOCKS, EACH = 12, 4
X = np.linspace(0, 7, 11)


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    folder = str(tmp_path_factory.mktemp("workers"))
    settings = {
        # A process that dies is not the fault of what it worked on.
        "distributed.scheduler.allowed-failures": 10,
        "distributed.worker.memory.terminate": False,
        "distributed.admin.log-format": "%(message)s",
    }
    with (
        dask.config.set(settings),
        LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=":0", local_directory=folder, silence_logs="CRITICAL"
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client


def slow(block):
    time.sleep(0.15)
    return block


def curves():
    p = points_on(S2, 8, (BLOCKS * EACH,), step=0.5)
    p[7, 2] = np.nan
    return xr.DataArray(p, dims=("curve", "time", "q"))


def test_workers_are_bit_identical_to_this_process(client):
    da = curves()
    expected = ss.CubicSpline(None, da.values, S2, on_failure="ignore")
    ds = sx.fit(da.chunk(curve=EACH), S2)
    values, found = dask.compute(sx.evaluate(ds, X, nu=1), ds)
    assert same(values.values, expected(X, nu=1)) and same(found.residual.values, expected.report.residual)


def test_a_worker_that_is_killed_half_way_changes_nothing(client):
    da = curves()
    expected = ss.CubicSpline(None, da.values, S2, on_failure="ignore")
    blocks = da.chunk(curve=EACH)
    blocks = blocks.copy(data=blocks.data.map_blocks(slow, dtype=float))
    made = sx.evaluate(sx.fit(blocks, S2), X).persist()
    futures = futures_of(made)
    first = next(iter(as_completed(futures)))
    pids = client.run(os.getpid)
    holder = next(iter(client.who_has([first]).values()))[0]
    assert not all(future.done() for future in futures)
    # With what it has computed and not sent to anyone.
    os.kill(pids[holder], signal.SIGKILL)
    assert same(made.compute().values, expected(X))
    client.wait_for_workers(2)
    assert pids[holder] not in client.run(os.getpid).values()


def test_a_failure_in_a_worker_comes_here(client):
    da = curves()
    ds = sx.fit(da.chunk(curve=EACH), S2, on_failure="raise")
    raises("of curve 3", ds.compute)


@pytest.mark.skipif(sys.platform != "linux", reason="counts threads in /proc")
def test_workers_times_threads_do_not_multiply():
    """Four workers of dask need no threads of the core."""
    code = """
import os, threading, dask, numpy as np, xarray as xr, symspline as ss, symspline.xarray as sx
ss.set_num_threads(3)
p = ss.Sphere(2).geodesic([1, 0, 0], [0, 1, 0], np.linspace(0, 1, 20))
da = xr.DataArray(p, dims=("time", "q")).expand_dims(curve=8000)
def extra():
    return len(os.listdir("/proc/self/task")) - threading.active_count()
before = extra()
sx.fit(da.chunk(curve=1000), "sphere:2").compute(scheduler="threads", num_workers=4)
print(extra() - before)
sx.fit(da, "sphere:2")
print(extra() - before)
"""
    assert run_python(code, timeout=60).split() == ["0", "3"]
