"""Attitudes and rates of bodies that turn: gaps, free biases, delays, wrong attitudes, turns between attitudes."""

import numpy as np

import symspline as ss

from .outcome import Outcome, outcome_of

SO3 = ss.SpecialOrthogonal(3)


class Recording:
    """A body that turns about an axis and wobbles, with its measured attitudes and rates."""

    def __init__(self, seed, delay=False, wrong=0.0):
        rng = np.random.default_rng(seed)
        self.begin = rng.uniform(-100, 100)
        self.end = self.begin + rng.uniform(10, 40)
        between = rng.uniform(0.2, 2.0)
        self.sigma = float(np.exp(rng.uniform(np.log(0.005), np.log(0.3))))
        self.noise = float(np.exp(rng.uniform(np.log(0.002), np.log(0.05))))
        self.bias = rng.uniform(0.01, 0.3) * rng.standard_normal(3)
        axis = rng.standard_normal(3)
        axis /= np.linalg.norm(axis)
        # From a wobble without a turn to 600° between two attitudes, at most a turn and a half per second.
        speed = min(np.radians(rng.uniform(0, 600)) / between, 3 * np.pi) * rng.integers(0, 2)
        frequency, phase = rng.uniform(0.1, 0.5, (3, 3)), rng.uniform(0, 6.28, (3, 3))
        size = 0.3 * rng.standard_normal((3, 3))
        span = self.end - self.begin
        fine = np.linspace(self.begin - 1, self.end + 1, int(40 * (span + 2)))
        since = fine - self.begin
        angles = np.outer(speed * since + 0.4 * np.sin(0.3 * since), axis)
        wobble = np.sum(size * np.sin(2 * np.pi * frequency * since[:, None, None] + phase), axis=1)
        turns = ss.rotations.from_rotation_vectors(wobble) @ ss.rotations.from_rotation_vectors(angles)
        self.truth = ss.CubicSpline(fine, turns, SO3, bc_type="not-a-knot")
        self.s = np.arange(self.begin, self.end, 1 / rng.uniform(40, 100))
        self.t = np.sort(rng.uniform(self.begin, self.end, max(int(span / between), 5)))
        gap = rng.uniform(0, 0.4) * span * rng.integers(0, 2)
        hole = self.begin + rng.uniform(0, 0.6) * span
        kept = (self.t < hole) | (self.t > hole + gap)
        self.t = self.t[kept] if kept.sum() >= 5 else self.t
        self.late = rng.uniform(-0.3, 0.3) if delay else 0.0
        if delay:
            self.t = self.t[(self.t > self.begin + 0.3) & (self.t < self.end - 0.3)]
        noise = self.sigma * rng.standard_normal((len(self.t), 3))
        self.seen = self.truth(self.t) @ ss.rotations.from_rotation_vectors(noise)
        bad = rng.random(len(self.t)) < wrong
        self.seen[bad] = SO3.random_point(rng, (int(bad.sum()),)) if bad.any() else self.seen[bad]
        rates = ss.rotations.angular_velocity(self.truth, self.s)
        self.omega = rates + self.bias + self.noise * rng.standard_normal((len(self.s), 3))
        self.turning = float(np.linalg.norm(rates, axis=1).max())
        # A gyroscope that pauses.
        if rng.random() < 0.2 and speed == 0:
            hole = rng.uniform(0.2, 0.7) * span + self.begin
            on = (self.s < hole) | (self.s > hole + 0.3)
            self.s, self.omega = self.s[on], self.omega[on]

    def given(self, delay, loss):
        offset = ss.measure.Constant(1) if delay else None
        return [
            ss.measure.Points(self.t - self.late, self.seen, sigma=self.sigma, time_offset=offset, loss=loss),
            ss.measure.BodyRates(self.s, self.omega, sigma=self.noise, bias=ss.measure.Constant(3)),
        ]

    def error(self, curve):
        """Largest error of an attitude or of the bias in standard errors."""
        x = np.linspace(self.s[0], self.s[-1], 60)
        off = ss.rotations.as_rotation_vectors(np.swapaxes(self.truth(x), -1, -2) @ curve(x))
        bias = curve.parameters["gyro bias"]
        return max(
            float(np.max(np.linalg.norm(off, axis=1) / np.sqrt(3) / curve.std(x))),
            float(np.max(np.abs(bias.value - self.bias) / bias.std)),
        )


def rates(seed, knots=None, delay=False, wrong=0.0):
    """Fit a recording with given or automatic knots."""
    one = Recording(seed, delay, wrong)

    def fit():
        first, last = min(one.s[0], one.t[0]), max(one.s[-1], one.t[-1])
        # A quarter of a radian between two knots, and at most a fifth of a second.
        number = int(np.ceil((last - first) / min(0.2, 0.25 / one.turning))) + 1
        chosen = np.linspace(first, last, number) if knots is None else knots
        return one.error(ss.estimate(one.given(delay, "cauchy" if wrong else None), chosen, SO3))

    return outcome_of(fit)


def given_knots(seed) -> Outcome:
    return rates(seed)


def automatic_knots(seed) -> Outcome:
    return rates(seed, "auto")


def delays(seed) -> Outcome:
    return rates(seed, delay=True)


def wrong_attitudes(seed) -> Outcome:
    return rates(seed, wrong=0.1)


KINDS = {
    "attitudes and rates": given_knots,
    "attitudes and rates, automatic knots": automatic_knots,
    "attitudes and rates, unknown delay": delays,
    "attitudes and rates, a tenth of the attitudes wrong": wrong_attitudes,
}
