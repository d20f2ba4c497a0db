//! Products of spaces. Points and velocities have one entry per factor, and so have the numbers of their curves.

use crate::point::{Point, Row, Rows};
use crate::space::{Factor, Space};

/// The product of any number of spaces of one type. Points are vectors with one point per factor.
///
/// Tuples are products of spaces of different types.
///
/// # Examples
/// ```
/// use symspline::prelude::*;
///
/// // Two directions, such as those of a stereo camera.
/// let pair = Product(vec![Sphere::<3>; 2]);
/// let points = [[0.0, 0.1], [0.5, 0.7], [1.2, 0.9]].map(|angles| angles.map(|a: f64| [a.cos(), a.sin(), 0.0]).to_vec());
/// let spline = CubicSpline::new(pair, &[0.0, 1.0, 2.0], &points)?;
/// let directions = spline.at(1.0); // one per factor
/// assert!((directions[1][0] - 0.7_f64.cos()).abs() < 1e-14);
///
/// // Spaces that are chosen when the program runs.
/// let space = Product(vec![AnySpace::new("so", &[3])?, AnySpace::new("r", &[3])?]);
/// let one = vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
/// let points = [vec![one.clone(), vec![0.0; 3]], vec![one, vec![1.0, 2.0, 3.0]]];
/// let spline = CubicSpline::new(space, &[0.0, 1.0], &points)?;
/// assert_eq!(spline.at(0.5)[1], [0.5, 1.0, 1.5]);
/// # Ok::<(), Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Product<S>(pub Vec<S>);

impl<S: Factor + Clone> Space for Product<S> {
    type PerFactor<T> = Vec<T>;

    fn factors(&self) -> Vec<&dyn Factor> {
        self.0.iter().map(|factor| factor as _).collect()
    }
    fn per_factor<T>(values: Vec<T>) -> Vec<T> {
        values
    }
}

impl<S: Factor + Clone, P: Point<S> + Row> Point<Product<S>> for Vec<P>
where
    P::Tangent: Row,
{
    type Tangent = Vec<P::Tangent>;
}

impl<R: Row> Rows for Vec<R> {
    fn write_rows(&self, factors: &mut [Vec<f64>]) -> usize {
        self.iter().zip(factors).for_each(|(row, factor)| row.write(factor));
        self.len()
    }
    fn read_rows(rows: &[&[f64]]) -> Self {
        rows.iter().map(|row| R::read(row)).collect()
    }
    fn align_rows(&mut self, before: &Self) {
        self.iter_mut().zip(before).for_each(|(row, before)| row.align(before));
    }
}

macro_rules! tuples {
    ($($count:literal: $($space:ident $point:ident $i:tt),*;)*) => {
        $(
            impl<$($space: Factor + Clone),*> Space for ($($space,)*) {
                type PerFactor<T> = [T; $count];

                fn factors(&self) -> Vec<&dyn Factor> {
                    vec![$(&self.$i),*]
                }
                fn per_factor<T>(values: Vec<T>) -> [T; $count] {
                    let mut values = values.into_iter();
                    std::array::from_fn(|_| values.next().expect("there is one value per factor"))
                }
            }

            impl<$($space: Factor + Clone, $point: Point<$space> + Row),*> Point<($($space,)*)> for ($($point,)*)
            where
                $($point::Tangent: Row),*
            {
                type Tangent = ($($point::Tangent,)*);
            }

            impl<$($point: Row),*> Rows for ($($point,)*) {
                fn write_rows(&self, factors: &mut [Vec<f64>]) -> usize {
                    $(self.$i.write(&mut factors[$i]);)*
                    $count
                }
                fn read_rows(rows: &[&[f64]]) -> Self {
                    ($($point::read(rows[$i]),)*)
                }
                fn align_rows(&mut self, before: &Self) {
                    $(self.$i.align(&before.$i);)*
                }
            }
        )*
    };
}

tuples! {
    2: A P 0, B Q 1;
    3: A P 0, B Q 1, C R 2;
    4: A P 0, B Q 1, C R 2, D U 3;
    5: A P 0, B Q 1, C R 2, D U 3, E V 4;
    6: A P 0, B Q 1, C R 2, D U 3, E V 4, F W 5;
}
