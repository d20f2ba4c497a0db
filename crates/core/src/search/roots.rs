//! Roots of many functions at once, each in an interval at whose ends it has opposite signs.

/// An interval that contains a root.
#[derive(Clone, Copy, Debug)]
pub struct Bracket {
    /// Ends of the interval.
    pub ends: [f64; 2],
    /// Values at the ends, which do not have the same sign.
    pub values: [f64; 2],
    /// The first time inside the interval.
    pub guess: f64,
    /// Absolute tolerance of the root, in addition to rounding errors.
    pub tol: f64,
}

/// Bisection alone takes at most this number of steps from any interval to two neighbouring floating-point numbers.
const STEPS: usize = 1100;

/// The state of one root: it is between a, the latest time, and b. The next time is x.
struct State {
    index: usize,
    a: f64,
    b: f64,
    fa: f64,
    fb: f64,
    x: f64,
    tol: f64,
}

/// One root per interval by Chandrupatla's method: inverse quadratic interpolation or bisection.
///
/// `f(index, x)` returns the values at times x of the functions with some indices, which increase.
///
/// T. R. Chandrupatla, A new hybrid quadratic/bisection algorithm for finding the zero of a nonlinear function without
/// using derivatives, Adv. Eng. Softw. 28 (1997).
pub fn roots<E>(
    brackets: &[Bracket],
    mut f: impl FnMut(&[usize], &[f64]) -> Result<Vec<f64>, E>,
) -> Result<Vec<f64>, E> {
    let mut found: Vec<f64> = brackets
        .iter()
        .map(|own| own.ends[usize::from(!(own.values[0].abs() <= own.values[1].abs()))])
        .collect();
    let mut active: Vec<State> = brackets
        .iter()
        .enumerate()
        .filter(|(_, own)| own.values[0] != 0.0 && own.values[1] != 0.0 && own.ends[0] != own.ends[1])
        .map(|(index, own)| State {
            index,
            a: own.ends[0],
            b: own.ends[1],
            fa: own.values[0],
            fb: own.values[1],
            x: own.guess,
            tol: own.tol,
        })
        .collect();
    for _ in 0..STEPS {
        if active.is_empty() {
            break;
        }
        let index: Vec<usize> = active.iter().map(|own| own.index).collect();
        let x: Vec<f64> = active.iter().map(|own| own.x).collect();
        let mut values = f(&index, &x)?.into_iter();
        active.retain_mut(|own| match own.advance(values.next().unwrap_or(f64::NAN)) {
            Some(root) => {
                found[own.index] = root;
                false
            }
            None => true,
        });
    }
    Ok(found)
}

impl State {
    /// Takes over the value at the latest time; returns the root if it is accurate, and chooses the next time if not.
    fn advance(&mut self, fx: f64) -> Option<f64> {
        let same = (fx > 0.0) == (self.fa > 0.0) && fx != 0.0;
        let (c, fc) = if same { (self.a, self.fa) } else { (self.b, self.fb) };
        if !same {
            (self.b, self.fb) = (self.a, self.fa);
        }
        (self.a, self.fa) = (self.x, fx);
        let Self { a, b, fa, fb, .. } = *self;
        let best = if fa.abs() < fb.abs() { a } else { b };
        let near = (2.0 * f64::EPSILON * best.abs() + self.tol) / (b - a).abs();
        if !(near <= 0.5) || fa == 0.0 || !fa.is_finite() {
            return Some(best);
        }
        let (xi, phi) = ((a - b) / (c - b), (fa - fb) / (fc - fb));
        let smooth = phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi;
        let quadratic = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb);
        let t = if smooth { quadratic } else { 0.5 };
        self.x = a + t.clamp(near, 1.0 - near) * (b - a);
        None
    }
}
