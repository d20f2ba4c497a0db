//! Storage on the stack: of few entries, or of constant size.

use super::base::Storage;
use crate::scalar::few;
use std::ops::{Deref, DerefMut};

/// Any shape of at most CAPACITY entries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Small<const CAPACITY: usize>;

impl<const CAPACITY: usize> Storage for Small<CAPACITY> {
    type Shape = (usize, usize);
    type Of<T: Copy> = Entries<T, CAPACITY>;
    #[inline(always)]
    fn shape(rows: usize, cols: usize) -> Self::Shape {
        assert!(rows * cols <= CAPACITY, "a matrix of {rows} x {cols} is too large here");
        (rows, cols)
    }
    #[inline(always)]
    fn size(shape: Self::Shape) -> (usize, usize) {
        shape
    }
    #[inline(always)]
    fn filled<T: Copy>(_: Self::Shape, x: T) -> Self::Of<T> {
        Entries([x; CAPACITY])
    }
    #[inline(always)]
    fn collected<T: Copy>((rows, cols): Self::Shape, spare: T, mut f: impl FnMut(usize) -> T) -> Self::Of<T> {
        let mut out = Entries([spare; CAPACITY]);
        for (i, x) in out[..rows * cols].iter_mut().enumerate() {
            *x = f(i);
        }
        out
    }
}

/// N × N matrices with NN = N² entries, of constant size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Known<const N: usize, const NN: usize>;

/// An array that dereferences to a slice.
#[derive(Clone, Copy)]
pub struct Entries<T, const NN: usize>([T; NN]);

impl<T, const NN: usize> Deref for Entries<T, NN> {
    type Target = [T];
    #[inline(always)]
    fn deref(&self) -> &[T] {
        &self.0
    }
}

impl<T, const NN: usize> DerefMut for Entries<T, NN> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.0
    }
}

impl<const N: usize, const NN: usize> Storage for Known<N, NN> {
    const TINY: bool = N < 3;
    type Shape = ();
    type Of<T: Copy> = Entries<T, NN>;
    #[inline(always)]
    fn shape(rows: usize, cols: usize) -> Self::Shape {
        debug_assert!(rows == N && cols == N && N * N == NN);
    }
    #[inline(always)]
    fn size(_: Self::Shape) -> (usize, usize) {
        (N, N)
    }
    #[inline(always)]
    fn filled<T: Copy>(_: Self::Shape, x: T) -> Self::Of<T> {
        Entries([x; NN])
    }
    #[inline(always)]
    fn collected<T: Copy>(_: Self::Shape, _: T, f: impl FnMut(usize) -> T) -> Self::Of<T> {
        Entries(few(f))
    }
}
