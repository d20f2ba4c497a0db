"""Scripts that run in a process with little memory."""

import textwrap

from curves import run_python

LIMITED = """
import resource
import sys

import numpy as np

import symspline as ss

resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30))
refused = (ss.ValidationError, ss.CutLocusError, ss.ConvergenceError, MemoryError)
"""


def run(script, timeout=100):
    """What a script prints in a process with 2 GB of address space."""
    return run_python(LIMITED + textwrap.dedent(script), timeout=timeout, PYTHONWARNINGS="ignore")
