"""Times of the same work done by several libraries, in turns."""

from __future__ import annotations

import gc
import statistics
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from time import perf_counter_ns
from typing import NamedTuple

import symspline as ss

Work = Callable[[], object]


class Contestant(NamedTuple):
    """Work to be timed.

    Attributes:
        prepare: makes the input, which is not timed, and returns the work.
        threads: how many threads symspline may use.
    """

    prepare: Callable[[], Work]
    threads: int = 1


def ready(work: Work, threads: int = 1) -> Contestant:
    """Work that needs no preparation."""
    return Contestant(lambda: work, threads)


@dataclass(frozen=True)
class Timing:
    """Seconds a call: median and extremes of the runs."""

    median: float
    low: float
    high: float
    runs: int

    def __str__(self) -> str:
        unit, name = _unit(self.median)
        return self.within(unit, f" {name}")

    def within(self, unit: float, name: str = "") -> str:
        """As a number of units of so many seconds."""
        spread = f"{_digits(self.low / unit)}–{_digits(self.high / unit)}"
        return f"{_digits(self.median / unit)}{name} ({'once' if self.runs == 1 else spread})"


@dataclass(frozen=True)
class Failure:
    """Why there is no time."""

    reason: str

    def __str__(self) -> str:
        return f"fails: {self.reason}"


Result = Timing | Failure


def failure(error: Exception) -> Failure:
    """What a table says about an error."""
    return Failure(f"{type(error).__name__}: {error}")


@dataclass(frozen=True)
class Effort:
    """How much a measurement may cost.

    Attributes:
        runs: number of runs, unless they take too long.
        shortest: seconds a run must last; short calls are repeated within a run.
        longest: seconds after which no further run of the same work begins.
    """

    runs: int
    shortest: float
    longest: float


def measure(contestants: Mapping[str, Contestant], effort: Effort) -> dict[str, Result]:
    """Time all contestants, one run of each after the other, so that a disturbance meets all."""
    gc.collect()
    entered = {name: _enter(contestant, effort) for name, contestant in contestants.items()}
    running = [entry for entry in entered.values() if isinstance(entry, _Running)]
    for _ in range(effort.runs):
        for entry in running:
            if entry.spent < effort.longest:
                entry.run()
    return {name: entry.timing() if isinstance(entry, _Running) else entry for name, entry in entered.items()}


def ratio(slow: Result, fast: Result) -> float | None:
    """How many times faster the fast one is; None where one of them fails."""
    if isinstance(slow, Failure) or isinstance(fast, Failure):
        return None
    return slow.median / fast.median


def shared(result: Result, n: int) -> Result:
    """The time for one of n things that are done in a call."""
    if isinstance(result, Failure):
        return result
    return Timing(result.median / n, result.low / n, result.high / n, result.runs)


def in_unit(result: Result, unit: float) -> str:
    """A result as a number of units of so many seconds."""
    return result.within(unit) if isinstance(result, Timing) else str(result)


def seconds(time: float) -> str:
    """A time with its unit."""
    unit, name = _unit(time)
    return f"{_digits(time / unit)} {name}"


@dataclass
class _Running:
    """A contestant with its input, and what was measured."""

    work: Work
    threads: int
    calls: int = 1
    spent: float = 0.0
    times: list[float] = field(default_factory=list)

    def run(self) -> None:
        time = _run(self.work, self.calls, self.threads)
        self.spent += time * self.calls
        self.times.append(time)

    def timing(self) -> Timing:
        return Timing(statistics.median(self.times), min(self.times), max(self.times), len(self.times))


def _enter(contestant: Contestant, effort: Effort) -> _Running | Failure:
    """Prepare and warm up. The first call counts only if it is so long that there is no second."""
    ss.set_num_threads(contestant.threads)
    try:
        entry = _Running(contestant.prepare(), contestant.threads)
        entry.run()
    except Exception as error:
        return failure(error)
    if entry.spent < effort.longest:
        calls = _calls(entry.work, entry.threads, effort.shortest)
        entry = _Running(entry.work, entry.threads, calls)
    return entry


def _calls(work: Work, threads: int, shortest: float) -> int:
    """How many calls a run needs to last long enough."""
    calls = 1
    while (time := calls * _run(work, calls, threads)) < shortest:
        calls = min(10 * calls, 1 + int(1.3 * calls * shortest / max(time, 1e-9)))
    return calls


def _run(work: Work, calls: int, threads: int) -> float:
    """Seconds a call; as in `timeit`, without garbage collection."""
    ss.set_num_threads(threads)
    gc.disable()
    try:
        start = perf_counter_ns()
        for _ in range(calls):
            work()
        return 1e-9 * (perf_counter_ns() - start) / calls
    finally:
        gc.enable()


def _unit(time: float) -> tuple[float, str]:
    for unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs")):
        if time >= unit[0]:
            return unit
    return 1e-9, "ns"


def _digits(number: float) -> str:
    """Three digits."""
    return f"{number:.0f}" if number >= 99.95 else f"{number:.1f}" if number >= 9.995 else f"{number:.2f}"
