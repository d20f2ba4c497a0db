//! Curves in a product of spaces: one curve per factor, at common times.

use super::data::{Curves, Outside, Quantity, Times};
use super::evaluate::evaluate;
use super::jerk::jerk;
use crate::monitor::Monitor;
use crate::space::Erased;

/// Curves in one factor of a product; a space that is not a product is its only factor.
#[derive(Clone, Copy)]
pub struct Factor<'a> {
    /// The space.
    pub space: Erased<'a>,
    /// The curves. Their knots may differ between factors, their domains may not.
    pub curves: Curves<'a>,
}

/// Evaluates the curves of all factors. Points and vectors are written to one array per factor. Lengths are those in
/// the product metric, and written to the first array.
pub fn evaluate_product(
    factors: &[Factor],
    times: &Times,
    quantity: Quantity,
    outside: Outside,
    monitor: &Monitor,
    out: &mut [&mut [f64]],
) {
    if !quantity.is_length() {
        for (Factor { space, curves }, out) in factors.iter().zip(out) {
            match quantity {
                Quantity::Jerk => jerk(space, curves, times, outside, monitor, out),
                _ => evaluate(space, curves, times, quantity, outside, monitor, out),
            }
        }
        return;
    }
    let [total, ..] = out else { return };
    let mut part = vec![0.0; if factors.len() > 1 { total.len() } else { 0 }];
    for (i, Factor { space, curves }) in factors.iter().enumerate() {
        let lengths = if i == 0 { &mut **total } else { &mut part };
        evaluate(space, curves, times, quantity, outside, monitor, lengths);
        if i > 0 {
            total.iter_mut().zip(&part).for_each(|(total, part)| *total = total.hypot(*part));
        }
    }
}
