//! Initial curves: means of neighbouring data.
//!
//! A pyramid of weighted means of pairs: noise decreases from level to level, and distances due to motion increase.
//! The level whose neighbours are closest to each other, among those before distances increase clearly, provides the
//! points of the initial spline. (The iteration often fails from the data themselves if the noise is large. At much
//! coarser levels fast oscillations average out, and they would be taken for noise, unless a given λ does the same.)

use crate::frames::lanes_of;
use symspline_core::scalar::{LANES, Lane, gather, scatter};
use symspline_core::space::{Ambient, Erased, below};

/// Points with times and weights.
#[derive(Clone)]
pub struct Level {
    /// Increasing times.
    pub times: Vec<f64>,
    /// Points, one after another.
    pub points: Vec<f64>,
    weights: Vec<f64>,
}

/// The factor of a mean squared distance that is clearly larger. Distances of random points vary by less.
const FARTHER: f64 = 1.3;

/// The levels for given data, the best first, and then coarser ones. The last has two points. `averaged` is the time over
/// which a given λ averages the data.
pub fn levels(
    space: &Erased,
    times: &[f64],
    points: &[f64],
    weights: &[f64],
    averaged: Option<f64>,
) -> Vec<Level> {
    let mut level = Level { times: times.to_vec(), points: points.to_vec(), weights: weights.to_vec() };
    while level.times.windows(2).any(|t| t[0] == t[1]) {
        level = level.paired(space, |level, i| level.times[i] == level.times[i + 1]);
    }
    let mut found = Vec::new();
    loop {
        level = level.apart(space);
        let distance = level.mean_square(space);
        found.push((distance, level.clone()));
        if level.times.len() <= 3 {
            break;
        }
        level = level.paired(space, |_, _| true);
    }
    let mut best = 0;
    for (i, (distance, level)) in found.iter().enumerate() {
        let least = found[best].0;
        let is_averaged = averaged.is_some_and(|time| level.spacing() < time);
        if *distance > FARTHER * least && !is_averaged {
            break;
        }
        if *distance < least {
            best = i;
        }
    }
    let last = found.last().map(|(_, level)| level.ends(space));
    found.into_iter().skip(best).map(|(_, level)| level).chain(last).collect()
}

impl Level {
    /// Given points.
    pub fn of(times: &[f64], points: &[f64]) -> Level {
        Level { times: times.to_vec(), points: points.to_vec(), weights: vec![1.0; times.len()] }
    }

    /// Joins neighbours that are much closer in time than others: a spline through noisy points at nearly equal times
    /// has large velocities.
    fn apart(mut self, space: &Erased) -> Level {
        /// The smallest distance in time, divided by the mean.
        const NEAR: f64 = 0.1;
        loop {
            let last = self.times.len() - 1;
            let least = NEAR * self.spacing();
            let near = |level: &Level, i: usize| level.times[i + 1] - level.times[i] < least;
            if last < 3 || !(0..last).any(|i| near(&self, i)) {
                return self;
            }
            self = self.paired(space, near);
        }
    }

    /// Replaces pairs by their means, from the first one on, where `join` is true. Data without weight are ignored.
    fn paired(&self, space: &Erased, join: impl Fn(&Level, usize) -> bool) -> Level {
        let len = space.point_len();
        let count = self.times.len();
        let mut pairs = Vec::new();
        let mut i = 0;
        while i < count {
            let both = i + 1 < count && join(self, i);
            pairs.push((i, if both { i + 1 } else { i }));
            i += if both { 2 } else { 1 };
        }
        // If the number is odd, the remaining point is joined at the next level.
        let part = |(a, b): (usize, usize)| {
            let (v, w) = (self.weights[a], self.weights[b]);
            if v + w > 0.0 { w / (v + w) } else { 0.5 }
        };
        let mut points = vec![0.0; pairs.len() * len];
        let [mut p, mut q, mut v, mut mean] = [(); 4].map(|_| vec![Lane::ZERO; len]);
        for (group, out) in points.chunks_mut(LANES * len).enumerate() {
            let at = lanes_of(group, pairs.len()).map(|i| pairs[i]);
            gather(at.map(|(a, _)| &self.points[a * len..][..len]), &mut p);
            gather(at.map(|(_, b)| &self.points[b * len..][..len]), &mut q);
            let angle = space.log(&p, &q, &mut v);
            let t = Lane::new(at.map(part));
            space.ray(&p, &v, t, &mut mean);
            space.project(&mut mean);
            // Antipodal points have no mean; the first one is used.
            let near = angle.simd_lt(below(space.cut_angle()));
            mean.iter_mut().zip(&p).for_each(|(x, p)| *x = near.select(*x, *p));
            scatter(&mean, out);
        }
        let times = pairs.iter().map(|&(a, b)| {
            let t = part((a, b));
            (1.0 - t) * self.times[a] + t * self.times[b]
        });
        let weights =
            pairs.iter().map(|&(a, b)| self.weights[a] + if a == b { 0.0 } else { self.weights[b] });
        Level { times: times.collect(), weights: weights.collect(), points }
    }

    /// The mean squared distance of neighbours, those beyond the cut locus at its distance.
    fn mean_square(&self, space: &Erased) -> f64 {
        let len = space.point_len();
        let count = self.times.len() - 1;
        if count == 0 {
            return f64::INFINITY;
        }
        let [mut p, mut q, mut v] = [(); 3].map(|_| vec![Lane::ZERO; len]);
        let mut sum = 0.0;
        for group in 0..count.div_ceil(LANES) {
            let at = lanes_of(group, count);
            gather(at.map(|i| &self.points[i * len..][..len]), &mut p);
            gather(at.map(|i| &self.points[(i + 1) * len..][..len]), &mut q);
            space.log(&p, &q, &mut v);
            let square = space.inner(&p, &v, &v).to_array();
            let own = LANES.min(count - group * LANES);
            sum += square[..own]
                .iter()
                .map(|x| if x.is_nan() { space.cut_angle().powi(2) } else { *x })
                .sum::<f64>();
        }
        sum / count as f64
    }

    /// The mean distance in time.
    fn spacing(&self) -> f64 {
        let last = self.times.len() - 1;
        (self.times[last] - self.times[0]) / last as f64
    }

    /// First and last point.
    fn ends(&self, space: &Erased) -> Level {
        let len = space.point_len();
        let last = self.times.len() - 1;
        let pick = |x: &[f64], size: usize| [&x[..size], &x[last * size..]].concat();
        Level {
            times: pick(&self.times, 1),
            points: pick(&self.points, len),
            weights: pick(&self.weights, 1),
        }
    }
}
