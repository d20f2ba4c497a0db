//! Rows of numbers of any kind: how a formula that is generic over its numbers passes through a table.

use super::{Dual, Jet, Lane};

/// Numbers, all of one kind.
#[derive(Clone, Copy)]
pub enum Row<'a> {
    /// Plain numbers.
    Lane(&'a [Lane]),
    /// Numbers with a derivative.
    Dual(&'a [Dual]),
    /// Numbers with two derivatives.
    Jet(&'a [Jet]),
}

/// The same, to be written.
pub enum RowMut<'a> {
    /// Plain numbers.
    Lane(&'a mut [Lane]),
    /// Numbers with a derivative.
    Dual(&'a mut [Dual]),
    /// Numbers with two derivatives.
    Jet(&'a mut [Jet]),
}
