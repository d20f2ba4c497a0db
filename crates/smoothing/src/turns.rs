//! A closed curve, unrolled: three turns of it, of which the one in the middle counts.
//!
//! What happens at a knot fades with the distance, so that the artificial ends do no harm; and what is left of them
//! vanishes where the gradient does.

use crate::Data;

/// Three turns of noisy data and knots.
pub struct Turns {
    times: Vec<f64>,
    points: Vec<f64>,
    weights: Vec<f64>,
    information: Vec<f64>,
    knots: Vec<f64>,
}

impl Turns {
    /// Of a curve whose last knot is the first again.
    pub fn of(data: &Data) -> Self {
        let period = data.knots[data.knots.len() - 1] - data.knots[0];
        let count = data.times.len();
        // Where the last turn ends the next one begins, so that no knot is without data that has some.
        let with_next = |x: &[f64]| [&x.repeat(3)[..], &x[..x.len() / count]].concat();
        let mut times = turns(data.times, period);
        times.push(data.times[0] + 2.0 * period);
        Turns {
            times,
            points: with_next(data.points),
            weights: with_next(data.weights),
            information: with_next(data.information),
            knots: knots(data.knots),
        }
    }

    /// As data of a curve.
    pub fn data<'a>(&'a self, of: &Data<'a>) -> Data<'a> {
        Data {
            times: &self.times,
            points: &self.points,
            weights: &self.weights,
            information: &self.information,
            knots: &self.knots,
            ..*of
        }
    }
}

/// Times, a period earlier, as they are, and a period later.
fn turns(x: &[f64], period: f64) -> Vec<f64> {
    [-period, 0.0, period].iter().flat_map(|shift| x.iter().map(move |x| x + shift)).collect()
}

/// Knots of three turns, of those of one.
pub fn knots(one: &[f64]) -> Vec<f64> {
    let last = one.len() - 1;
    let period = one[last] - one[0];
    let mut knots = turns(&one[..last], period);
    knots.push(one[last] + period);
    knots
}

/// Repeats what the rows of the turn in the middle have in the other two, and behind them.
pub fn repeat(rows: &mut [f64], len: usize) {
    let n = (rows.len() / len - 1) / 3;
    let turn = rows[n * len..2 * n * len].to_vec();
    for (k, row) in rows.chunks_exact_mut(len).enumerate() {
        row.copy_from_slice(&turn[k % n * len..][..len]);
    }
}
