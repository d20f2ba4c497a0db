"""Writes special.csv: the functions of `special.rs` to 40 digits, rounded to 17.

Arguments run over decades of both signs and stand close together on both sides of every switch
between series. They are exact doubles.
"""

from pathlib import Path

from mpmath import acos, acosh, cos, cosh, diff, mp, mpf, sin, sinh, sqrt

mp.dps = 60


def trig(x):
    r = sqrt(abs(x))
    return (cos(r), sin(r) / r) if x > 0 else (cosh(r), sinh(r) / r)


FUNCTIONS = {
    "c": lambda x: trig(x)[0],
    "s": lambda x: trig(x)[1],
    "k": lambda x: (trig(x)[0] - 1) / x,
    "j": lambda x: (1 - trig(x)[1]) / x,
    "arc": lambda y: acos(1 - y) / sin(acos(1 - y)) if y > 0 else acosh(1 - y) / sinh(acosh(1 - y)),
}
SWITCHES = {"trig": [0.1, 2.5], "arc": [0.0075, 0.09, 0.3]}


def arguments(kind):
    positive = [10.0**e * m for e in range(-12, 3) for m in (1.0, 3.7)]
    for switch in SWITCHES[kind]:
        positive += [switch * (1 + d) for d in (-1e-3, -1e-12, 0.0, 1e-12, 1e-3, 0.3)]
    for value in positive:
        if kind == "trig" or value < 1.999:
            yield value
        yield -value
    if kind == "trig":
        yield from (9.5, 9.9, 39.0, -1e4)


def rows():
    for name, function in FUNCTIONS.items():
        for x in arguments("arc" if name == "arc" else "trig"):
            argument = mpf(x)
            # Taylor-accurate derivatives: 60 digits leave plenty after the difference quotients.
            values = [function(argument), diff(function, argument, 1), diff(function, argument, 2)]
            yield ",".join([name, repr(x), *(mp.nstr(v, 17) for v in values)])


Path(__file__).with_name("special.csv").write_text("\n".join(rows()) + "\n", encoding="ascii")
