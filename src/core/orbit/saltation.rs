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
