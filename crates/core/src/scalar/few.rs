//! Arrays of a few numbers by plain loops: `array::from_fn` and `array::map`, with everything that they call, were a
//! third of the code to compile.

/// An array of the values of a function.
#[inline(always)]
pub fn few<T: Copy, const N: usize>(mut f: impl FnMut(usize) -> T) -> [T; N] {
    let mut out = [f(0); N];
    let mut i = 1;
    while i < N {
        out[i] = f(i);
        i += 1;
    }
    out
}

/// A function of every number of an array.
pub trait Each<T: Copy, const N: usize> {
    /// The array of its values.
    fn each<U: Copy>(self, f: impl FnMut(T) -> U) -> [U; N];
}

impl<T: Copy, const N: usize> Each<T, N> for [T; N] {
    #[inline(always)]
    fn each<U: Copy>(self, mut f: impl FnMut(T) -> U) -> [U; N] {
        few(|i| f(self[i]))
    }
}
