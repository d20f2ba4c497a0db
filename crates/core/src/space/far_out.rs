//! Hyperbolic spaces: the distance up to which floating-point numbers are accurate.

/// The largest |p|² of a point, at a distance of 15.25 from (1, 0, …). Beyond it rounding errors ε|p|² exceed 0.2 %,
/// and at twice the distance no array is a point.
const FARTHEST: f64 = (1_u64 << 43) as f64;

/// The first point of real or complex hyperbolic space that is too far out to be accurate, and a description of it.
pub fn far_out(points: &[f64], len: usize) -> Option<(usize, String)> {
    let square = |p: &[f64]| p.iter().map(|x| x * x).sum::<f64>();
    let row = points.chunks_exact(len).position(|p| !(square(p) <= FARTHEST))?;
    // |p|² = cosh² r + sinh² r
    let distance = |square: f64| 0.5 * square.acosh();
    let why = format!(
        "lies at distance {:.1} from (1, 0, …), where rounding errors, ε|p|², leave too few significant digits (farthest: {:.1}); \
         move all points by one isometry, space.transvection, so that their middle is (1, 0, …)",
        distance(square(&points[row * len..(row + 1) * len])),
        distance(FARTHEST)
    );
    Some((row, why))
}
