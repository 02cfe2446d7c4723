//! Orders of convergence, held tightly: finite elements by manufactured solutions, integrators by fixed steps, harmonic balance by closed forms.

#[path = "orders/elements.rs"]
mod elements;
#[path = "orders/harmonics.rs"]
mod harmonics;
#[path = "orders/masses.rs"]
mod masses;
#[path = "orders/steps.rs"]
mod steps;

/// Least-squares slope of `log error` over `log size`.
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let product: f64 = logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    product / logs.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>()
}

/// Root of the mean square.
fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}
