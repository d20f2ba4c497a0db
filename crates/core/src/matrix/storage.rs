//! How the entries of a matrix are stored: any size, few of them, or a size that the compiler knows.

use super::Compiled;
use crate::scalar::{Scalar, few};
use smallvec::{SmallVec, smallvec};
use std::ops::{Deref, DerefMut};

/// Where the entries of a matrix are, and how many.
pub trait Storage: Copy + Send + Sync + 'static {
    /// Whether matrices may be of any size: then functions of them are compiled once, see [`Compiled`].
    const ANY: bool = false;
    /// Rows and columns.
    type Shape: Copy;
    /// A container of entries.
    type Of<T: Copy>: Clone + Deref<Target = [T]> + DerefMut;
    /// A shape that is asked for.
    fn shape(rows: usize, cols: usize) -> Self::Shape;
    /// The numbers of rows and columns.
    fn size(shape: Self::Shape) -> (usize, usize);
    /// Equal entries.
    fn filled<T: Copy>(shape: Self::Shape, x: T) -> Self::Of<T>;
    /// Entries from their places, row by row. Writes each once, where `filled` and a loop write twice.
    fn collected<T: Copy>(shape: Self::Shape, spare: T, f: impl FnMut(usize) -> T) -> Self::Of<T>;
    /// Functions of matrices of any size.
    fn compiled<S: Scalar, const D: usize>() -> &'static Compiled<S, D, Self> {
        unreachable!("matrices of any size only are stored there")
    }
}

/// Any size. Up to sixteen entries live on the stack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dynamic;

impl Storage for Dynamic {
    const ANY: bool = true;
    type Shape = (usize, usize);
    type Of<T: Copy> = SmallVec<[T; 16]>;
    fn shape(rows: usize, cols: usize) -> Self::Shape {
        (rows, cols)
    }
    #[inline(always)]
    fn size(shape: Self::Shape) -> (usize, usize) {
        shape
    }
    fn filled<T: Copy>((rows, cols): Self::Shape, x: T) -> Self::Of<T> {
        smallvec![x; rows * cols]
    }
    #[inline(always)]
    fn collected<T: Copy>((rows, cols): Self::Shape, _: T, f: impl FnMut(usize) -> T) -> Self::Of<T> {
        (0..rows * cols).map(f).collect()
    }
    #[inline(always)]
    fn compiled<S: Scalar, const D: usize>() -> &'static Compiled<S, D, Self> {
        Compiled::table()
    }
}

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

/// N × N matrices of NN = N² entries, a size known to the compiler.
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
