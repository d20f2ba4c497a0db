//! Noisy data of one curve, without what has no effect.

/// Copies of a row of a text file agree up to this fraction of their size.
const COPY: f64 = 1e-9;

/// Data of one curve in the order of time, see [`Data`](crate::Data).
#[derive(Clone, Debug, Default)]
pub struct Observations {
    /// Times, possibly with repetitions.
    pub times: Vec<f64>,
    /// One point per time.
    pub points: Vec<f64>,
    /// One positive weight per time.
    pub weights: Vec<f64>,
    /// Information matrices, or empty.
    pub information: Vec<f64>,
}

impl Observations {
    /// The data with a weight. Copies of a row, as loggers write them, are merged into one of their weight: they would
    /// make the noise appear to be zero. Points have `len` numbers. The first point of a closed curve, repeated at its
    /// end after a `period` as for interpolating splines, would have the same effect.
    pub fn new(
        times: &[f64],
        points: &[f64],
        weights: &[f64],
        information: &[f64],
        len: usize,
        period: Option<f64>,
    ) -> Self {
        let entries = information.len() / times.len().max(1);
        let mut own = Observations::default();
        let mut before = None;
        for i in (0..times.len()).filter(|&i| weights[i] > 0.0) {
            let point = |i: usize| &points[i * len..][..len];
            let matrix = &information[i * entries..][..entries];
            match before {
                Some(k) if times[k] == times[i] && same(point(k), point(i)) => {
                    if let Some(weight) = own.weights.last_mut() {
                        *weight += weights[i];
                    }
                    let last = own.information.len() - entries;
                    own.information[last..].iter_mut().zip(matrix).for_each(|(sum, x)| *sum += x);
                }
                _ => {
                    own.times.push(times[i]);
                    own.points.extend_from_slice(point(i));
                    own.weights.push(weights[i]);
                    own.information.extend_from_slice(matrix);
                }
            }
            before = Some(i);
        }
        let last = own.times.len().saturating_sub(1);
        if last > 0
            && period == Some(own.times[last] - own.times[0])
            && same(&own.points[last * len..], &own.points[..len])
        {
            own.weights[0] = own.weights[0].max(own.weights[last]);
            own.times.truncate(last);
            own.points.truncate(last * len);
            own.weights.truncate(last);
            own.information.truncate(last * entries);
        }
        own
    }
}

/// Whether two arrays are equal up to the rounding of a text file.
fn same(p: &[f64], q: &[f64]) -> bool {
    let size = p.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    p.iter().zip(q).all(|(p, q)| (p - q).abs() <= COPY * size)
}
