//! The kinds of numbers, and slices of any of them, with which generic formulas pass through a table of functions.

/// Several floating-point numbers in SIMD lanes: one register of AVX-512 or AVX2. Wider numbers would take two registers
/// each, and code that is a quarter longer to compile.
#[cfg(target_feature = "avx512f")]
pub type Lane = wide::f64x8;
/// Several floating-point numbers in SIMD lanes.
#[cfg(not(target_feature = "avx512f"))]
pub type Lane = wide::f64x4;

/// The number of floating-point numbers in a [`Lane`], four or eight.
pub const LANES: usize = size_of::<Lane>() / size_of::<f64>();

/// A number `v + d ε` with `ε² = 0`.
#[derive(Clone, Copy, Debug)]
pub struct Dual {
    /// The value.
    pub v: Lane,
    /// The derivative.
    pub d: Lane,
}

/// A function of t near one t: its value, first and second derivative.
#[derive(Clone, Copy, Debug)]
pub struct Jet {
    /// The value.
    pub v: Lane,
    /// The first derivative.
    pub d: Lane,
    /// The second derivative.
    pub dd: Lane,
}

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

/// The same for mutable slices.
pub enum RowMut<'a> {
    /// Plain numbers.
    Lane(&'a mut [Lane]),
    /// Numbers with a derivative.
    Dual(&'a mut [Dual]),
    /// Numbers with two derivatives.
    Jet(&'a mut [Jet]),
}
