"""Integration of angular velocities, and attitudes from measured rates that are aligned with measured attitudes.

The bias of the rates is estimated by consensus of the turns between neighbouring attitudes. The estimate is robust
against several turns between two attitudes, and against wrong attitudes.

References
----------
C. Forster, L. Carlone, F. Dellaert, D. Scaramuzza, On-manifold preintegration for real-time visual-inertial odometry,
IEEE Trans. Robotics 33 (2017).
H. Yang, P. Antonante, V. Tzoumas, L. Carlone, Graduated non-convexity for robust spatial perception, IEEE Robotics and
Automation Letters 5 (2020).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._spaces import Doubles, Euclidean
from .._splines.cubic import CubicSpline
from ..convert._quaternions import quaternion_to_matrix

# Rates have a gap where a time step exceeds this number of median time steps.
_GAP = 20.0
# Largest numbers of attitudes with which biases are compared, and of intervals that propose a bias.
_COMPARED, _PROPOSALS = 200, 60
# The same numbers when time offsets are compared.
_COMPARED_OFFSETS, _PROPOSED_OFFSETS = 60, 10
# Residuals are limited to the quantile 0.999 of χ² with three degrees of freedom.
_LIMIT = 16.27
# Numbers of whole turns that are added to the turn between two attitudes.
_TURNS = (0, -1, 1)
# A bias without a prior is assumed to be small compared with the rates: its standard deviation is the first fraction of
# their size. If the mean square of the residuals then exceeds `_BAD`, the second fraction is tried as well.
_SHARES = (0.5, 0.1)
_BAD = 6.0
# Rates are integrated again if a new bias changes the integral by more than this angle.
_LINEAR = 0.1
# Corners of the loss of Geman and McClure, in squares of standard deviations, during the alignment.
_CORNERS = (64.0, 16.0, 4.0, 4.0)
# Steps of the bias whose squared length in standard deviations is below this number end an iteration.
_SMALL_STEP = 1e-4
# Number of time offsets on either side of the start that are tried, and the turn of the body in radians per step.
_OFFSETS, _OFFSET_TURN = 20, 0.2


def integrated(t: Doubles, omega: Doubles, interpolation: str = "linear") -> Doubles:
    """Return rotations that begin with the identity and have given angular velocities in the body frame.

    Each step is the exponential of the Magnus expansion of fourth order for the polynomial that interpolates ω. With
    s measured from the middle of the step, :math:`\\Omega = m_0 + m_0 \\times m_1` for the moments
    :math:`m_0 = \\int \\omega\\,ds` and :math:`m_1 = \\int s\\,\\omega\\,ds / h`.

    Parameters
    ----------
    t : ndarray, shape (n,) or (..., n)
        Increasing times of the core.
    omega : ndarray, shape (..., n, 3)
        Angular velocities.
    interpolation : {"linear", "cubic"}
        Interpolation of ω between the times, by a not-a-knot spline for ``"cubic"``.

    Returns
    -------
    ndarray, shape (..., n, 4)
        Unit quaternions, scalar first.

    References
    ----------
    S. Blanes, F. Casas, J. A. Oteo, J. Ros, The Magnus expansion and some of its applications, Phys. Rep. 470 (2009),
    Section 5. The commutator has the opposite sign here, because the unknown is on the left in R' = Rω.
    """
    h = np.diff(t)[..., None]
    before, after = omega[..., :-1, :], omega[..., 1:, :]
    zeroth, first = h * (before + after) / 2, h * (after - before) / 12
    if interpolation == "cubic" and omega.shape[-2] > 2:
        curve = CubicSpline(t, omega, Euclidean(3), bc_type="not-a-knot")
        start, end = curve.velocities[..., :-1, :], curve.velocities[..., 1:, :]
        zeroth = zeroth + h * h * (start - end) / 12
        first = h * (after - before) / 10 - h * h * (start + end) / 120
    vectors = zeroth + np.cross(zeroth, first)
    half = np.sqrt((vectors * vectors).sum(axis=-1)) / 2
    steps = np.zeros((*omega.shape[:-1], 4))
    steps[..., 0, 0] = 1.0
    steps[..., 1:, 0] = np.cos(half)
    # np.sinc has a factor of π in its argument.
    steps[..., 1:, 1:] = vectors * np.sinc(half / np.pi)[..., None] / 2
    return _core.quaternion_products(steps)


def attitudes_at(t: Doubles, omega: Doubles, x: Doubles) -> Doubles:
    """Return rotation matrices at times x that begin with the identity and have the angular velocity ω in the body.

    ω is linear between the samples and constant beyond them. Times of the samples may repeat.
    """
    nodes = np.unique(np.concatenate([t, x]))
    rates = np.stack([np.interp(nodes, t, column) for column in omega.T], axis=-1)
    return quaternion_to_matrix(integrated(nodes, rates)[np.searchsorted(nodes, x)], scalar_first=True)


class Rates(NamedTuple):
    """Angular velocities in the frame of the body.

    Attributes
    ----------
    times : ndarray, shape (n,)
        Times that do not decrease.
    omega : ndarray, shape (n, 3)
        Angular velocities.
    noise : float
        Their usual standard deviation.
    bias : ndarray, shape (3,)
        Start of their bias, the mean of its prior.
    spread : ndarray, shape (3,) or None
        Standard deviations of the prior, infinite if there is none. None if the bias is known.
    """

    times: Doubles
    omega: Doubles
    noise: float
    bias: Doubles
    spread: Doubles | None


class Attitudes(NamedTuple):
    """Measured rotation matrices at times that do not decrease, and their standard deviations."""

    times: Doubles
    matrices: Doubles
    sigma: Doubles

    def taken(self, index: NDArray[np.intp]) -> Attitudes:
        """Return some of them."""
        return Attitudes(self.times[index], self.matrices[index], self.sigma[index])

    def later(self, offset: float) -> Attitudes:
        """Return them with an offset added to their times."""
        return self._replace(times=self.times + offset)


def _exp(vectors: Doubles) -> Doubles:
    """Return the rotation matrices of rotation vectors."""
    return _core.convert_rotations(np.ascontiguousarray(vectors), "vector", "matrix", np.inf)[0]


def _log(matrices: Doubles) -> Doubles:
    """Return the rotation vectors of rotation matrices."""
    return _core.convert_rotations(np.ascontiguousarray(matrices), "matrix", "vector", np.inf)[0]


class Integral:
    """The integral of rates with a bias, and its derivative with respect to the bias."""

    def __init__(self, rates: Rates, bias: Doubles) -> None:
        self.bias = bias
        self._t, omega = rates.times, rates.omega
        if np.any(np.diff(self._t) <= 0):
            self._t = np.unique(rates.times)
            omega = np.stack([np.interp(self._t, rates.times, row) for row in omega.T], axis=-1)
        self._omega = omega - bias
        quaternions = integrated(self._t, self._omega)
        self._matrices = _core.convert_rotations(quaternions, "scalar first", "matrix", np.inf)[0]
        steps = 0.5 * np.diff(self._t)[:, None, None] * (self._matrices[1:] + self._matrices[:-1])
        self._sums = np.concatenate([np.zeros((1, 3, 3)), np.cumsum(steps, axis=0)])
        # The last times with their result: searches for a bias ask for the same ones again and again.
        self._known: tuple[Doubles, tuple[Doubles, Doubles]] | None = None

    def at(self, x: Doubles) -> tuple[Doubles, Doubles]:
        """Return the rotations G at times x, and ∫G dt.

        If the bias changes by b, G changes to G exp(−Gᵀ∫G dt b) in the first order.
        """
        if self._known is not None and x is self._known[0]:
            return self._known[1]
        last = max(len(self._t) - 2, 0)
        i = np.clip(np.searchsorted(self._t, x, side="right") - 1, 0, last)
        s = (x - self._t[i])[:, None]
        after = np.minimum(i + 1, len(self._t) - 1)
        h = np.maximum(self._t[after] - self._t[i], np.finfo(float).tiny)[:, None]
        # Rates are linear between their times, and constant before the first and after the last.
        inner = np.clip(s, 0.0, h)
        turn = s * self._omega[i] + inner * (s - 0.5 * inner) / h * (self._omega[after] - self._omega[i])
        rotations = self._matrices[i] @ _exp(turn)
        result = rotations, self._sums[i] + 0.5 * s[..., None] * (self._matrices[i] + rotations)
        self._known = x, result
        return result


class _Pairs(NamedTuple):
    """Rotations E that remain between measured turns and those of the integral, and their derivatives J.

    If the bias changes by b, E changes to exp(J b) E. The variance of a component is the sum of those of both attitudes
    and of the integrated noise of the rates.
    """

    rest: Doubles
    derivatives: Doubles
    variances: Doubles

    def residuals(self, b: Doubles) -> Doubles:
        """Return the remaining rotation vectors after changes b of the bias, of shape (..., 3)."""
        turned = np.einsum("kij,...j->...ki", self.derivatives, b)
        return _log(_exp(turned) @ self.rest)


class _Problem:
    """The bias of rates and the frame of their integral, from attitudes that are not in gaps of the rates."""

    def __init__(self, rates: Rates) -> None:
        self.rates = rates
        t = np.unique(rates.times)
        self.step = float(np.median(np.diff(t))) if len(t) > 1 else 0.0
        # First and last times of the segments in which there are rates.
        breaks = np.flatnonzero(np.diff(t) > _GAP * self.step)
        self.first, self.last = t[np.append(0, breaks + 1)], t[np.append(breaks, len(t) - 1)]
        self.size = float(np.sqrt(np.mean(np.sum((rates.omega - rates.bias) ** 2, axis=1))))
        self.integral = self.first_integral = Integral(rates, rates.bias)
        self.limit_bias(_SHARES[0])

    def limit_bias(self, share: float) -> None:
        """Limit the standard deviation of the bias to a fraction of the size of the rates."""
        spread = np.full(3, np.inf) if self.rates.spread is None else self.rates.spread
        self.precision = np.minimum(spread, max(share * self.size, self.rates.noise)) ** -2.0

    def segment(self, x: Doubles) -> NDArray[np.intp]:
        """Return the number of the segment of rates that contains each time, or −1 in a gap."""
        j = np.clip(np.searchsorted(self.first, x, side="right") - 1, 0, len(self.first) - 1)
        near = _GAP * self.step
        # Times shortly before a segment belong to it.
        ahead = np.minimum(j + 1, len(self.first) - 1)
        j = np.where((x > self.last[j] + near) & (x >= self.first[ahead] - near), ahead, j)
        return np.where((x >= self.first[j] - near) & (x <= self.last[j] + near), j, -1)

    def integrate(self, bias: Doubles) -> Integral:
        """Return the integral with a bias; one with nearly this bias is reused, the first one or the last one."""
        most = _LINEAR / max(float(np.ptp(self.rates.times)), np.finfo(float).tiny)
        for known in (self.integral, self.first_integral):
            if float(np.abs(bias - known.bias).max()) <= most:
                return known
        self.integral = Integral(self.rates, bias)
        return self.integral

    def pairs(self, attitudes: Attitudes, where: NDArray[np.intp], bias: Doubles, apart: int, more: float) -> _Pairs:
        """Return the turns between attitudes whose indices differ by a given number.

        Parameters
        ----------
        attitudes : Attitudes
            Attitudes.
        where : ndarray of int
            Numbers of the segments that contain them.
        bias : ndarray
            Bias about which the turns are linearised.
        apart : int
            Difference of the indices.
        more : float
            Additional standard deviation of every attitude.
        """
        integral = self.integrate(bias)
        t = attitudes.times
        i = np.arange(len(t) - apart)
        i = i[(where[i] >= 0) & (where[i] == where[i + apart]) & (t[i + apart] > t[i])]
        j = i + apart
        g, sums = integral.at(t)
        derivatives = g[j].swapaxes(-1, -2) @ (sums[j] - sums[i])
        turned = (g[i].swapaxes(-1, -2) @ g[j]).swapaxes(-1, -2) @ (
            attitudes.matrices[i].swapaxes(-1, -2) @ attitudes.matrices[j]
        )
        change = np.einsum("kij,j->ki", derivatives, bias - integral.bias)
        variances = attitudes.sigma[i] ** 2 + attitudes.sigma[j] ** 2 + 2 * more**2
        variances = variances + self.rates.noise**2 * self.step * (t[j] - t[i])
        return _Pairs(_exp(change) @ turned, derivatives, variances)

    def _prior(self, b: Doubles) -> Doubles:
        return np.asarray(np.sum((b - self.rates.bias) ** 2 * self.precision, axis=-1))

    def consensus(self, attitudes: Attitudes, more: float = 0.0) -> Doubles:
        """Return the bias with which the integral agrees with most turns between neighbouring attitudes."""
        bias = self.rates.bias
        if self.rates.spread is None or len(attitudes.times) < 2:
            return bias
        most, proposals = (_COMPARED_OFFSETS, _PROPOSED_OFFSETS) if more else (_COMPARED, _PROPOSALS)
        index = np.linspace(0, len(attitudes.times) - 1, min(len(attitudes.times), most)).astype(int)
        some = attitudes.taken(np.unique(index))
        where = self.segment(some.times)
        for number in range(3):
            pairs = self.pairs(some, where, bias, 1, more)
            if not len(pairs.rest):
                return bias
            changes = np.zeros((1, 3))
            if number == 0:
                changes = np.concatenate([changes, self._proposals(pairs, proposals)])
            squares = np.sum(pairs.residuals(changes) ** 2, axis=-1) / pairs.variances
            best = changes[np.argmin(np.minimum(squares, _LIMIT).sum(axis=1) + self._prior(bias + changes))]
            best = self._improved(pairs, bias, best)
            bias = bias + best
            if np.abs(best).max() * float(np.diff(some.times).max()) < _LINEAR:
                break
        # A small error of the bias adds up to a large turn over the recording. Turns over longer and longer intervals
        # make the bias precise.
        apart = 2
        while apart < len(some.times):
            pairs = self.pairs(some, where, bias, apart, more)
            if len(pairs.rest):
                bias = bias + self._improved(pairs, bias, np.zeros(3))
            apart *= 2
        return bias

    def _proposals(self, pairs: _Pairs, most: int) -> Doubles:
        """Return changes of the bias that explain single turns, also with a whole turn more or less."""
        count = min(len(pairs.rest), most)
        lengths = np.linalg.norm(pairs.derivatives, axis=(-2, -1))
        shortest = np.argsort(lengths, kind="stable")[:count]
        vectors = _log(pairs.rest[shortest])
        angles = np.linalg.norm(vectors, axis=-1, keepdims=True) + 1e-12
        turned = np.concatenate([vectors * (1 + 2 * np.pi * turns / angles) for turns in _TURNS])
        shortest = np.tile(shortest, len(_TURNS))
        j, weights = pairs.derivatives[shortest], 1.0 / pairs.variances[shortest, None]
        normal = np.einsum("kij,kil->kjl", j, j) * weights[..., None] + np.diag(self.precision)
        right = -np.einsum("kij,ki->kj", j, turned) * weights
        return np.asarray(np.linalg.solve(normal, right[..., None])[..., 0])

    def _improved(self, pairs: _Pairs, bias: Doubles, change: Doubles) -> Doubles:
        """Return a change of the bias after Gauss–Newton steps with the weights of Geman and McClure."""
        j = pairs.derivatives
        for _ in range(6):
            r = pairs.residuals(change)
            squares = np.sum(r**2, axis=-1) / pairs.variances
            weights = (1 + squares / _LIMIT) ** -2.0 / pairs.variances
            normal = np.einsum("k,kji,kjl->il", weights, j, j) + np.diag(self.precision)
            right = np.einsum("k,kji,kj->i", weights, j, r) + self.precision * (bias + change - self.rates.bias)
            step = np.linalg.solve(normal, right)
            change = change - step
            if step @ normal @ step < _SMALL_STEP:
                break
        return change

    def aligned(
        self, attitudes: Attitudes, bias: Doubles, more: float = 0.0, late: float = 0.0
    ) -> tuple[Doubles, Doubles, float, float]:
        """Align the integral with attitudes within one segment.

        Parameters
        ----------
        attitudes : Attitudes
            Attitudes.
        bias : ndarray
            First bias.
        more : float
            Additional standard deviation of every attitude.
        late : float
            Standard deviation of a time to be found that is added to the times of the attitudes; 0 if there is none.

        Returns
        -------
        first : ndarray, shape (3, 3)
            Attitude at the time of the first one.
        bias : ndarray, shape (3,)
            Bias with which they agree best.
        misfit : float
            Mean of the squared residuals in standard deviations, each of them limited.
        offset : float
            Time that was found.
        """
        t, r, offset = attitudes.times, attitudes.matrices, 0.0
        drift = self.rates.noise**2 * self.step * float(np.ptp(t))
        variances = attitudes.sigma**2 + more**2 + drift
        free = self.rates.spread is not None and len(t) > 1
        g, turned = self._since_first(t, bias)
        candidates = r @ g.swapaxes(-1, -2)
        # Start from the attitude that agrees best with the others.
        some = np.unique(np.linspace(0, len(t) - 1, min(len(t), _COMPARED)).astype(int))
        apart = np.linalg.norm(_log(candidates[some].swapaxes(-1, -2)[:, None] @ candidates[some][None]), axis=-1)
        wide = 2 * np.sqrt(variances[some]) + 0.1
        first = candidates[some[np.minimum(apart / wide, 3).sum(axis=1).argmin()]]
        for corner in _CORNERS:
            path = first @ g
            rest = _log(path.swapaxes(-1, -2) @ r)
            squares = np.sum(rest**2, axis=-1) / (3 * variances)
            weights = (corner / (corner + squares)) ** 2 / variances
            # Columns of the first attitude, turned into the body, and of the bias.
            columns = np.concatenate([path.swapaxes(-1, -2), -turned if free else 0 * turned], axis=-1)
            if late:
                columns = np.concatenate([columns, self.rates_at(t, bias)[..., None]], axis=-1)
            normal = np.einsum("k,kji,kjl->il", weights, columns, columns)
            right = np.einsum("k,kji,kj->i", weights, columns, rest)
            normal[3:6, 3:6] += np.diag(self.precision)
            right[3:6] -= self.precision * (bias - self.rates.bias)
            if late:
                normal[6, 6] += late**-2.0
                right[6] -= offset * late**-2.0
            step = np.linalg.solve(normal, right)
            first = _exp(step[:3]) @ first
            bias = bias + step[3:6] if free else bias
            if late:
                offset += float(step[6])
                t = attitudes.times + offset
            if free or late:
                g, turned = self._since_first(t, bias)
        squares = np.sum(_log((first @ g).swapaxes(-1, -2) @ r) ** 2, axis=-1) / variances
        return first, bias, float(np.minimum(squares, _LIMIT).mean()), offset

    def rates_at(self, t: Doubles, bias: Doubles) -> Doubles:
        """Return the rates without a bias at times."""
        rates = self.rates
        return np.stack([np.interp(t, rates.times, row) for row in rates.omega.T], axis=-1) - bias

    def _since_first(self, t: Doubles, bias: Doubles) -> tuple[Doubles, Doubles]:
        """Return the rotations since the first time, and minus their derivatives with respect to the bias."""
        integral = self.integrate(bias)
        g, sums = integral.at(t)
        turned = g.swapaxes(-1, -2) @ (sums - sums[:1])
        return g[0].T @ g @ _exp(-np.einsum("kil,l->ki", turned, bias - integral.bias)), turned


class Path:
    """Attitudes as a function of time, from rates and measured attitudes.

    Attributes
    ----------
    bias : ndarray, shape (3,)
        Bias of the rates.
    offset : float
        Time that was added to the times of the attitudes.
    misfit : float
        Mean of the squared residuals of the attitudes in standard deviations, each limited to `_LIMIT`.
    """

    def __init__(
        self,
        rates: Rates,
        attitudes: Attitudes,
        offset: tuple[float, float, float] | None = None,
        smoothed: Callable[[Doubles], Doubles] | None = None,
    ) -> None:
        """Find bias, alignment and offset.

        Parameters
        ----------
        rates : Rates
            Measured rates.
        attitudes : Attitudes
            Measured attitudes, at least one.
        offset : tuple of float, optional
            Start, lowest and highest value of an unknown time that is added to the times of the attitudes.
        smoothed : callable, optional
            Function that returns smoothed attitudes at times of attitudes. It is called for gaps of the rates.
        """
        problem = _Problem(rates)
        self.offset = 0.0 if offset is None else _best_offset(problem, attitudes, *offset)
        attitudes = attitudes.later(self.offset)
        where = problem.segment(attitudes.times)
        segments = [np.flatnonzero(where == j) for j in np.unique(where[where >= 0])]
        self.bias, self.misfit = rates.bias, np.inf
        for share in _SHARES if segments else ():
            problem.limit_bias(share)
            bias = problem.consensus(attitudes)
            alignments = [problem.aligned(attitudes.taken(segment), bias) for segment in segments]
            _, biases, misfits, _ = zip(*alignments, strict=True)
            counts = list(map(len, segments))
            misfit = float(np.average(misfits, weights=counts))
            if misfit < self.misfit:
                self.bias, self.misfit = biases[int(np.argmax(counts))], misfit
            if misfit < _BAD:
                break
        # All segments share the bias of the segment with the most attitudes.
        problem.rates = rates._replace(bias=self.bias, spread=None)
        self._integral = problem.integral = Integral(rates, self.bias)
        times, frames = [], []
        for segment in segments:
            some = attitudes.taken(segment)
            frame = problem.aligned(some, self.bias)[0] @ self._integral.at(some.times[:1])[0][0].T
            times += [problem.first[where[segment[0]]], problem.last[where[segment[0]]]]
            frames += [frame, frame]
        inside = np.flatnonzero(where < 0)
        if len(inside):
            at = attitudes.times[inside]
            known = attitudes.matrices[inside] if smoothed is None else smoothed(at - self.offset)
            times += list(at)
            frames += list(known @ self._integral.at(at)[0].swapaxes(-1, -2))
        order = np.argsort(times, kind="stable")
        # Rotations C at times, with which C·G are the attitudes.
        self._nodes, self._frames = np.array(times)[order], np.stack(frames)[order]

    def __call__(self, x: Doubles) -> Doubles:
        """Return rotation matrices at times x."""
        g, _ = self._integral.at(x)
        nodes, frames = self._nodes, self._frames
        i = np.clip(np.searchsorted(nodes, x, side="right") - 1, 0, max(len(nodes) - 2, 0))
        after = np.minimum(i + 1, len(nodes) - 1)
        h = nodes[after] - nodes[i]
        share = np.clip((x - nodes[i]) / np.where(h > 0, h, 1.0), 0.0, 1.0)
        share = share * share * (3 - 2 * share)
        # In a gap of the rates, the frames of both sides are joined by the shortest turn in the frame of the body.
        turns = _log(g.swapaxes(-1, -2) @ frames[i].swapaxes(-1, -2) @ frames[after] @ g)
        return np.asarray(frames[i] @ g @ _exp(share[:, None] * turns))


def _best_offset(problem: _Problem, attitudes: Attitudes, start: float, low: float, high: float) -> float:
    """Return the time offset for which the attitudes agree best with the rates."""
    if not problem.size > 0:
        return start
    step = _OFFSET_TURN / problem.size
    some = np.unique(np.linspace(0, len(attitudes.times) - 1, min(len(attitudes.times), _COMPARED)).astype(int))
    few = attitudes.taken(some)

    def compared(offset: float, width: float) -> tuple[float, float]:
        """Return the score of an offset with an uncertainty `width`, and an improved offset."""
        shifted, more = few.later(offset), 0.5 * width * problem.size / np.sqrt(3.0)
        bias = problem.consensus(shifted, more)
        where = problem.segment(shifted.times)
        segments = [np.flatnonzero(where == j) for j in np.unique(where[where >= 0])]
        if not segments:
            return np.inf, offset
        alignments = [problem.aligned(shifted.taken(index), bias, more, width) for index in segments]
        _, _, misfits, later = zip(*alignments, strict=True)
        counts = list(map(len, segments))
        improved = offset + later[int(np.argmax(counts))]
        return float(np.average(misfits, weights=counts)), float(np.clip(improved, low, high))

    score, best = compared(start, 4 * step)
    if score > 3 + 4 * np.sqrt(6 / len(some)):
        steps = np.arange(-_OFFSETS, _OFFSETS + 1) * step + start
        tried = [compared(float(trial), step) for trial in steps[(steps >= low) & (steps <= high)]]
        best = min(tried)[1] if tried else best
    return compared(best, step / 4)[1]
