//! The segments of several samples at a time, one per lane.

use super::data::{Job, Outside, Times};
use super::locate::Locator;
use crate::scalar::{LANES, Lane, few, lane};

/// The segments and parameters of a sample per lane. The cursor iterates over the samples of a block in their order, or
/// over the times of a curve per lane at once.
pub struct SampleCursor<'a> {
    job: &'a Job<'a>,
    /// The next sample: the i-th time of a curve.
    curve: usize,
    i: usize,
    /// The number of remaining samples in the block.
    left: usize,
    segment: usize,
    /// The index of the data of each lane's segment.
    pub at: [usize; LANES],
    /// Times, first knots and lengths of the segments, and their reciprocals.
    pub x: Lane,
    pub knot: Lane,
    pub h: Lane,
    pub rate: Lane,
    /// Times after the last knot (positive) or before the first one.
    pub beyond: [f64; LANES],
    /// First and last knot of the segment, if all lanes are in the same segment.
    shared: Option<[Lane; 2]>,
}

impl<'a> SampleCursor<'a> {
    pub fn new(job: &'a Job<'a>, samples: usize) -> Self {
        let count = job.times.count;
        SampleCursor {
            job,
            curve: job.first / count,
            i: job.first % count,
            left: samples,
            segment: 0,
            at: [usize::MAX; LANES],
            x: Lane::ZERO,
            knot: Lane::ZERO,
            h: Lane::ONE,
            rate: Lane::ONE,
            beyond: [0.0; LANES],
            shared: None,
        }
    }

    /// Advances to the next samples; unused lanes repeat the last one. Returns whether the segments have
    /// changed.
    #[inline(always)]
    pub fn advance(&mut self) -> bool {
        if self.job.apart > 1 {
            return self.advance_together();
        }
        let Times { x, count } = *self.job.times;
        if let Some([from, to]) = self.shared
            && self.left >= LANES
            && self.i + LANES <= count
        {
            // Consecutive dense samples stay in a segment.
            let row = if x.len() == count { self.i } else { self.curve * count + self.i };
            let next = Lane::new(few(|l| x[row..][..LANES][l]));
            if (next.simd_ge(from) & next.simd_lt(to)).all() {
                self.x = next;
                self.step(LANES);
                return false;
            }
        }
        self.search()
    }

    /// The next time of all curves, with common knots and times.
    fn advance_together(&mut self) -> bool {
        let Job { curves, times, outside, locator, len, .. } = self.job;
        let begins = self.i == 0;
        let (x, beyond) = inside(times.x[self.i], curves.t, *outside);
        let k = locator.map_or(0, |locator| locator.find(x, self.segment));
        let changed = begins || k != self.segment;
        if changed {
            self.segment = k;
            self.at = few(|l| ((self.curve + l) * curves.nodes + k) * len);
            self.knot = lane(curves.t[k]);
            self.h = lane(curves.t[k + 1]) - self.knot;
            self.rate = Lane::ONE / self.h;
        }
        self.x = lane(x);
        self.beyond = [beyond; LANES];
        self.i += 1;
        if self.i == times.count {
            (self.curve, self.i) = (self.curve + LANES, 0);
        }
        changed
    }

    #[inline(always)]
    fn step(&mut self, samples: usize) {
        self.left -= samples;
        self.i += samples;
        if self.i == self.job.times.count {
            (self.curve, self.i) = (self.curve + 1, 0);
            self.shared = None;
        }
    }

    fn search(&mut self) -> bool {
        let Job { curves, locator, outside, .. } = self.job;
        let Times { x, count } = *self.job.times;
        let len = self.job.len;
        let (mut at, mut xs, mut knots, mut ends) = (self.at, [0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for l in 0..LANES {
            let mut x = if x.len() == count { x[self.i] } else { x[self.curve * count + self.i] };
            let t = curves.knots(self.curve);
            (x, self.beyond[l]) = inside(x, t, *outside);
            let k = match locator {
                Some(locator) => locator.find(x, self.segment),
                None => Locator::new(t, false).find(x, self.segment),
            };
            self.segment = k;
            at[l] = (self.curve * curves.nodes + k) * len;
            (xs[l], knots[l], ends[l]) = (x, t[k], t[k + 1]);
            if self.left > 1 {
                self.step(1);
            }
        }
        let changed = at != self.at;
        self.at = at;
        self.x = Lane::new(xs);
        self.knot = Lane::new(knots);
        self.h = Lane::new(ends) - self.knot;
        self.rate = Lane::ONE / self.h;
        // The next sample may belong to another curve.
        let alike = at == [at[0]; LANES] && self.beyond == [0.0; LANES] && self.i >= LANES;
        self.shared = alike.then(|| [self.knot, Lane::new(ends)]);
        changed
    }
}

/// A time after application of the extrapolation policy: between the knots if it is wrapped or the curve continues as
/// a geodesic, and the distance beyond the end.
#[inline(always)]
pub fn inside(x: f64, t: &[f64], outside: Outside) -> (f64, f64) {
    let (start, end) = (t[0], t[t.len() - 1]);
    if x >= start && x <= end {
        return (x, 0.0);
    }
    match outside {
        Outside::Continue => (x, 0.0),
        Outside::Geodesic => (x.max(start).min(end), if x < start { x - start } else { x - end }),
        Outside::Wrap => ((start + (x - start).rem_euclid(end - start)).max(start).min(end), 0.0),
    }
}
