//! Saltation: how a perturbation passes a switch (theory §8; Aizerman and Gantmakher 1958).
//!
//! A perturbed motion reaches the switching surface `h = 0` later by `δt = −∇h·δu / ḣ` and until then keeps the old acceleration:
//!
//! ```text
//! δu⁺ = δu⁻,   δu̇⁺ = δu̇⁻ + (ü⁻ − ü⁺) δt        S = I + [0; ü⁺ − ü⁻] [∇h, 0] / ḣ
//! ```
//!
//! An impact multiplies velocities by `R` besides, `u̇⁺ = R u̇⁻`, and a delay moves the displacement too:
//!
//! ```text
//! δu⁺ = δu⁻ + (u̇⁻ − u̇⁺) δt,   δu̇⁺ = R δu̇⁻ + (R ü⁻ − ü⁺) δt
//! ```
//!
//! Methods whose acceleration is continuous have `S = I`; at grazing (`ḣ = 0`) it does not exist.

/// Carry `δu̇` (in whatever coordinates, the same as `jump`) through a switch: `jump = ü⁻ − ü⁺`, `rate = ḣ`, `slope = ∇h·δu` before it.
pub fn pass(jump: &[f64], rate: f64, slope: f64, dv: &mut [f64]) {
    let delay = -slope / rate;
    dv.iter_mut().zip(jump).for_each(|(v, a)| *v += a * delay);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mass on a spring meets a force at `u = 1`, `ü⁻ = −4 u`, `ü⁺ = −4 u − 3`: two motions that begin close to each other, in closed form.
    #[test]
    fn a_jump_of_the_acceleration_is_felt() {
        let motion = |amplitude: f64, end: f64| -> f64 {
            let switch = (1.0 / amplitude).asin() / 2.0;
            let rate = 2.0 * (amplitude * amplitude - 1.0).sqrt();
            // about u = −3/4 with ω = 2
            let (sin, cos) = (2.0 * (end - switch)).sin_cos();
            rate * cos - 1.75 * 2.0 * sin
        };
        let (amplitude, eps) = (1.6f64, 1e-6);
        let switch = (1.0 / amplitude).asin() / 2.0;
        let rate = 2.0 * (amplitude * amplitude - 1.0).sqrt();
        let (sin, cos) = (2.0 * switch).sin_cos();
        let (du, mut dv) = (sin, [2.0 * cos]);
        // h = 1 − u: ḣ = −u̇, ∇h δu = −δu; ü⁻ − ü⁺ = 3
        pass(&[3.0], -rate, -du, &mut dv);
        let end = switch + 0.1;
        let (sin, cos) = (2.0 * (end - switch)).sin_cos();
        let carried = dv[0] * cos - 2.0 * du * sin;
        let seen = (motion(amplitude + eps, end) - motion(amplitude - eps, end)) / (2.0 * eps);
        assert!((carried - seen).abs() < 1e-7, "{carried} {seen}");
    }
}
