"""How often a result is wrong without a warning: random recordings, one module per kind of fit.

Each module has `KINDS`, which maps the name of a kind of data to a function that makes the recording of a seed, fits it
and returns its `Outcome`. `python -m tests.trust 1000` prints the table of the page on trust.
"""
