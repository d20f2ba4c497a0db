//! Values at many times.

use crate::point::Row;
use std::ops::Index;

/// Values of many curves at the same times: `samples[curve][time]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples<P> {
    pub(crate) values: Vec<P>,
    pub(crate) count: usize,
}

impl<P: Row> Samples<P> {
    /// Reads rows of numbers. Within a curve, values continue each other.
    pub(crate) fn read(rows: &[f64], len: usize, count: usize) -> Self {
        let mut values: Vec<P> = Vec::with_capacity(rows.len() / len);
        for row in rows.chunks_exact(len) {
            let mut value = P::read(row);
            if let Some(before) = values.last().filter(|_| !values.len().is_multiple_of(count)) {
                value.align(before);
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
