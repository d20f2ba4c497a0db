//! Values at many times.

use crate::point::{Rows, read};
use std::ops::Index;

/// Values of many curves at the same times: `samples[curve][time]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples<P> {
    pub(crate) values: Vec<P>,
    pub(crate) count: usize,
}

impl<P: Rows> Samples<P> {
    /// Reads the numbers of curves in each factor, at times of equal number. Within a curve, values continue each other.
    pub(crate) fn read(rows: &[Vec<f64>], curves: usize, count: usize) -> Self {
        let mut values: Vec<P> = Vec::with_capacity(curves * count);
        for mut value in read::<P>(rows, curves * count) {
            if let Some(before) = values.last().filter(|_| !values.len().is_multiple_of(count)) {
                value.align_rows(before);
            }
            values.push(value);
        }
        Samples { values, count }
    }

    /// All values, curve by curve.
    pub fn into_vec(self) -> Vec<P> {
        self.values
    }
}

impl<P> Index<usize> for Samples<P> {
    type Output = [P];

    fn index(&self, curve: usize) -> &[P] {
        &self.values[curve * self.count..(curve + 1) * self.count]
    }
}
