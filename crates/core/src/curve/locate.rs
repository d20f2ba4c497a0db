//! The segment that contains a time.

/// Knots with an index over equal buckets of time, which makes the cost of a look-up independent of the number of
/// knots.
pub struct Locator<'a> {
    t: &'a [f64],
    buckets: Vec<u32>,
    per_time: f64,
}

impl<'a> Locator<'a> {
    /// `indexed` is faster if there are about as many look-ups as knots.
    pub fn new(t: &'a [f64], indexed: bool) -> Self {
        let n = t.len() - 1;
        let per_time = n as f64 / (t[n] - t[0]);
        let mut buckets = Vec::new();
        if indexed && n > 8 && per_time.is_finite() && n < u32::MAX as usize {
            buckets.reserve(n + 2);
            for (k, &knot) in t.iter().enumerate() {
                let bucket = ((knot - t[0]) * per_time) as usize;
                while buckets.len() <= bucket.min(n) {
                    buckets.push(k.saturating_sub(1) as u32);
                }
            }
            buckets.resize(n + 2, n as u32 - 1);
        }
        Locator { t, buckets, per_time }
    }

    /// The segment k with `t[k] <= x < t[k+1]`; the first or last one for x outside the knots. `hint` is an earlier
    /// result.
    #[inline(always)]
    pub fn find(&self, x: f64, hint: usize) -> usize {
        let (t, last) = (self.t, self.t.len() - 2);
        if t[hint] <= x && x < t[hint + 1] {
            return hint;
        }
        if hint < last && t[hint + 1] <= x && x < t[hint + 2] {
            return hint + 1;
        }
        let (from, to) = if self.buckets.is_empty() {
            (0, last + 1)
        } else {
            let bucket = ((x - t[0]) * self.per_time).clamp(0.0, last as f64) as usize;
            let spread = (self.buckets[bucket] as usize, self.buckets[bucket + 1] as usize + 1);
            // Rounding may select an adjacent bucket.
            if t[spread.0] <= x && x < t[spread.1.min(last + 1)] { spread } else { (0, last + 1) }
        };
        let inner = &t[(from + 1).min(last + 1)..=to.min(last).max(from)];
        from + inner.partition_point(|&knot| knot <= x)
    }
}
