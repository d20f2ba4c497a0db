//! Quantiles of the χ² distribution.

/// The quantile of the χ² distribution with m degrees of freedom at a given probability.
pub fn quantile(m: usize, probability: f64) -> f64 {
    if !(probability > 0.0 && probability < 1.0) {
        return if probability == 0.0 { 0.0 } else { f64::INFINITY };
    }
    let (mut low, mut high) = (0.0, m as f64 + 1.0);
    while distribution(m, high) < probability {
        (low, high) = (high, 2.0 * high);
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if distribution(m, middle) < probability { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// `P(m/2, x/2)`, by its series (DLMF 8.7.1) `e⁻ʸ yᵃ Σ yᵏ/Γ(a + k + 1)`.
pub fn distribution(m: usize, x: f64) -> f64 {
    let (a, y) = (0.5 * m as f64, 0.5 * x);
    if y == 0.0 {
        return 0.0;
    }
    // ln Γ(a + 1) from Γ(1) = 1 or Γ(3/2) = √π/2.
    let (mut log_gamma, mut k) =
        if m.is_multiple_of(2) { (0.0, 1.0) } else { ((std::f64::consts::PI.sqrt() / 2.0).ln(), 1.5) };
    while k < a + 0.75 {
        log_gamma += f64::ln(k);
        k += 1.0;
    }
    let (mut term, mut sum, mut k) = (1.0, 1.0, 1.0);
    while term > sum * f64::EPSILON {
        term *= y / (a + k);
        sum += term;
        k += 1.0;
    }
    (a * y.ln() - y - log_gamma + sum.ln()).exp().min(1.0)
}

/// The quantile of χ² with m degrees of freedom divided by an estimate of its scale, the mean square of n independent
/// normal numbers: m times that of the F distribution, within 1 %.
pub fn ratio_quantile(m: usize, n: usize, probability: f64) -> f64 {
    /// The number of equally probable scales that represent their distribution.
    const SCALES: usize = 200;
    let part = |k: usize| quantile(n, (k as f64 + 0.5) / SCALES as f64) / n as f64;
    let scales: Vec<f64> = (0..SCALES).map(part).collect();
    let below = |x: f64| scales.iter().map(|scale| distribution(m, x * scale)).sum::<f64>() / SCALES as f64;
    let mut low = quantile(m, probability);
    let mut high = 2.0 * low;
    while below(high) < probability {
        (low, high) = (high, 2.0 * high);
    }
    while high - low > 1e-4 * high {
        let middle = 0.5 * (low + high);
        if below(middle) < probability { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}
