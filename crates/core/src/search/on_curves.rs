//! Distances from curves of the core.

use super::closest::{Distances, Nearest, TimeSamples, closest};
use crate::curve::{Curves, Factor, Outside, Quantity, Times, evaluate};
use crate::monitor::Monitor;
use crate::parallel;
use crate::scalar::{LANES, Lane, few, gather, max_or_nan};
use crate::space::{Ambient, below};

/// Targets that one thread processes at a time.
const BLOCK: usize = 128;
/// A factor whose speed is below this part of the whole speed is at rest.
const REST: f64 = 1e-12;

/// Targets in one factor of a product; a space that is not a product is its only factor.
pub struct Targets<'a> {
    /// The curves, whose knots are the same in all factors.
    pub curve: Factor<'a>,
    /// Points of the curves at the samples, curve after curve.
    pub samples: &'a [f64],
    /// The points whose nearest points on the curves are sought.
    pub points: &'a [f64],
}

/// Finds the nearest points of curves to targets, which belong to some curves, in increasing order.
pub fn closest_on_curves(
    targets: &[Targets],
    samples: TimeSamples,
    curve: &[usize],
    monitor: &Monitor,
    out: &mut [Nearest],
) {
    let blocks: Vec<(usize, &mut [Nearest])> = out.chunks_mut(BLOCK).enumerate().collect();
    parallel::for_each(blocks, false, monitor, |(block, out)| {
        let first = block * BLOCK;
        let mut distances = OnCurves { targets, samples, curve, monitor };
        // An error is a cancellation, after which nobody reads the result.
        if let Ok(found) = closest(samples, first, &curve[first..][..out.len()], &mut distances) {
            out.copy_from_slice(&found);
        }
        monitor.advance(out.len());
    });
}

struct OnCurves<'a> {
    targets: &'a [Targets<'a>],
    samples: TimeSamples<'a>,
    curve: &'a [usize],
    monitor: &'a Monitor<'a>,
}

struct Cancelled;

impl Distances for OnCurves<'_> {
    type Error = Cancelled;

    fn of_samples(&mut self, target: &[usize], number: &[usize]) -> Result<Vec<f64>, Cancelled> {
        self.poll()?;
        let mut result = vec![0.0; target.len()];
        for (k, targets) in self.targets.iter().enumerate() {
            let len = targets.curve.space.point_len();
            let row = |i: usize| self.curve[target[i]] * self.samples.count + number[i];
            let points = |i: usize| &targets.samples[row(i) * len..][..len];
            targets.pairs(target, points, |p, q, log, lanes, i| {
                let angle = targets.curve.space.log(p, q, log);
                let own = targets.curve.space.distance(p, q, log, angle).to_array();
                for (result, own) in result[i..].iter_mut().zip(&own[..lanes]) {
                    *result = if k == 0 { *own } else { result.hypot(*own) };
                }
            });
        }
        Ok(result)
    }

    fn at(&mut self, target: &[usize], x: &[f64]) -> Result<[Vec<f64>; 2], Cancelled> {
        self.poll()?;
        let rows = self.rows(target);
        let count = target.len();
        let (mut distances, mut slopes) = (vec![0.0; count], vec![0.0; count]);
        let (mut parts, mut speeds) = (Vec::new(), Vec::new());
        for (k, targets) in self.targets.iter().enumerate() {
            let states = self.states(targets, &rows, x);
            let len = targets.curve.space.point_len();
            let limit = below(targets.curve.space.cut_angle());
            let state = |i: usize| &states[rows.place(i) * 2 * len..][..2 * len];
            let mut own = [vec![0.0; count], vec![0.0; count]];
            targets.pairs(target, state, |pv, q, log, lanes, i| {
                let (p, v) = pv.split_at(len);
                let angle = targets.curve.space.log(p, q, log);
                let distance = targets.curve.space.distance(p, q, log, angle).to_array();
                let slope =
                    angle.simd_lt(limit).select(-targets.curve.space.inner(p, log, v), NAN).to_array();
                for l in 0..lanes {
                    distances[i + l] = if k == 0 { distance[l] } else { distances[i + l].hypot(distance[l]) };
                    own[0][i + l] = slope[l];
                }
                if self.targets.len() > 1 {
                    let speed = max_or_nan(targets.curve.space.inner(p, v, v), Lane::ZERO).sqrt().to_array();
                    own[1][i..i + lanes].copy_from_slice(&speed[..lanes]);
                }
            });
            let [slope, speed] = own;
            parts.push(slope);
            speeds.push(speed);
        }
        for i in 0..count {
            let whole = speeds.iter().fold(0.0_f64, |sum, own| sum.hypot(own[i]));
            // At the cut locus in a factor that is at rest, the distance in this factor does not change.
            let rests = |k: usize| parts[k][i].is_nan() && speeds[k][i] <= REST * whole && parts.len() > 1;
            slopes[i] = (0..parts.len()).map(|k| if rests(k) { 0.0 } else { parts[k][i] }).sum();
        }
        Ok([distances, slopes])
    }
}

const NAN: Lane = Lane::splat(f64::NAN);

impl OnCurves<'_> {
    fn poll(&self) -> Result<(), Cancelled> {
        if self.monitor.poll() { Err(Cancelled) } else { Ok(()) }
    }

    /// The layout in which the curves of targets are evaluated: all at equally many times.
    fn rows(&self, target: &[usize]) -> Rows {
        let curve = |i: usize| self.curve[target[i]];
        let (first, last) = (curve(0), curve(target.len() - 1));
        if first == last {
            return Rows { first, curves: 1, count: target.len(), places: Vec::new() };
        }
        let mut counts = vec![0; last - first + 1];
        let column: Vec<usize> = (0..target.len())
            .map(|i| {
                let own = &mut counts[curve(i) - first];
                *own += 1;
                *own - 1
            })
            .collect();
        let count = counts.iter().copied().max().unwrap_or(0);
        let places = column.iter().enumerate().map(|(i, c)| (curve(i) - first) * count + c).collect();
        Rows { first, curves: counts.len(), count, places }
    }

    /// Points and velocities at times x in some layout.
    fn states(&self, targets: &Targets, rows: &Rows, x: &[f64]) -> Vec<f64> {
        let (curves, len) = (&targets.curve.curves, targets.curve.space.point_len());
        let part =
            |all: &'_ [f64], size: usize| rows.first * size..(rows.first + rows.curves) * size.min(all.len());
        let nodes = curves.nodes;
        let own = Curves {
            t: if curves.t.len() == nodes { curves.t } else { &curves.t[part(curves.t, nodes)] },
            nodes,
            points: &curves.points[part(curves.points, nodes * len)],
            velocities: &curves.velocities[part(curves.velocities, nodes * len)],
            before: if curves.before.is_empty() {
                &[]
            } else {
                &curves.before[part(curves.before, nodes * len)]
            },
        };
        let mut states = vec![0.0; rows.curves * rows.count * 2 * len];
        let mut padded = Vec::new();
        let times = if rows.places.is_empty() {
            x
        } else {
            padded.extend((0..rows.curves).flat_map(|c| vec![own.domain(c).0; rows.count]));
            rows.places.iter().zip(x).for_each(|(&place, &x)| padded[place] = x);
            &padded
        };
        let times = Times { x: times, count: rows.count };
        evaluate(
            &targets.curve.space,
            &own,
            &times,
            Quantity::State,
            Outside::Continue,
            self.monitor,
            &mut states,
        );
        states
    }
}

/// The times of some targets, in rows of equal length for consecutive curves.
struct Rows {
    first: usize,
    curves: usize,
    count: usize,
    /// The place of each time; empty for one curve, where times are in order.
    places: Vec<usize>,
}

impl Rows {
    fn place(&self, i: usize) -> usize {
        if self.places.is_empty() { i } else { self.places[i] }
    }
}

impl Targets<'_> {
    /// Calls `f` for a pair of rows of numbers and targets per lane, with an array for a logarithm, the number of
    /// pairs, which is smaller for the last ones, and the first of them.
    fn pairs<'a>(
        &self,
        target: &[usize],
        rows: impl Fn(usize) -> &'a [f64],
        mut f: impl FnMut(&[Lane], &[Lane], &mut [Lane], usize, usize),
    ) {
        let len = self.curve.space.point_len();
        let count = target.len();
        if count == 0 {
            return;
        }
        let mut row = vec![Lane::ZERO; rows(0).len()];
        let (mut q, mut log) = (vec![Lane::ZERO; len], vec![Lane::ZERO; len]);
        for first in (0..count).step_by(LANES) {
            let at: [usize; LANES] = few(|l| (first + l).min(count - 1));
            gather(at.map(&rows), &mut row);
            gather(at.map(|i| &self.points[target[i] * len..][..len]), &mut q);
            f(&row, &q, &mut log, LANES.min(count - first), first);
        }
    }
}
