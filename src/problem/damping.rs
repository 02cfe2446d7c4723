//! Damping from coefficients, from damping ratios, or from a matrix: `C = αM + βK`, or ratios of all modes.

use super::ProblemError;
use super::given::square;
use super::modes::OpenModes;
use crate::contact::{Dampers, Rayleigh, System};
use crate::fem::Csr;
use crate::scenario::{Amplitude, Issue, Scene};

pub(super) fn damping(scene: &Scene, modes: &OpenModes) -> Result<Option<Rayleigh>, ProblemError> {
    let Some(d) = &scene.damping else { return Ok(None) };
    let omega = |key: &str, k: usize| -> Result<f64, ProblemError> {
        let w = modes.modes.as_ref().and_then(|m| m.omega.get(k - 1)).copied().unwrap_or(0.0);
        if w > 0.0 {
            return Ok(w);
        }
        let message = format!("mode {k} is a rigid motion or does not exist");
        Err(scene.error(Issue::new(key, message, "name an elastic mode of the open body")).into())
    };
    let rayleigh = match (d.rayleigh, d.ratio, d.ratios) {
        (Some([alpha, beta]), _, _) => Rayleigh { alpha, beta },
        (_, Some(ratio), _) => {
            let w = omega("damping.mode", d.mode.unwrap_or(1))?;
            Rayleigh { alpha: 0.0, beta: 2.0 * ratio / w }
        }
        (_, _, Some([(m1, r1), (m2, r2)])) => {
            // 2 ξ ω = α + β ω² at both
            let (w1, w2) = (omega("damping.ratios", m1)?, omega("damping.ratios", m2)?);
            let beta = 2.0 * (r2 * w2 - r1 * w1) / (w2 * w2 - w1 * w1);
            let alpha = 2.0 * r1 * w1 - beta * w1 * w1;
            if alpha < 0.0 || beta < 0.0 {
                let message = format!(
                    "these ratios need α = {alpha:.3e}, β = {beta:.3e}: negative damping of other modes"
                );
                let help = "choose ratios closer to each other";
                return Err(scene.error(Issue::new("damping.ratios", message, help)).into());
            }
            Rayleigh { alpha, beta }
        }
        _ => return Ok(None),
    };
    let none = rayleigh.alpha == 0.0 && rayleigh.beta == 0.0;
    Ok((!none).then_some(rayleigh))
}

/// Most coordinates of a body whose modes are all computed for their damping.
const MOST: usize = 3000;

/// `ξ_k` of the modes of the open body, from the lowest on; none where the scene does not give all of them.
fn modal_ratios(scene: &Scene, count: usize) -> Option<Vec<f64>> {
    match scene.damping.as_ref()?.modal.as_ref()? {
        Amplitude::Scalar(ratio) => Some(vec![*ratio; count]),
        Amplitude::Vector(given) => {
            Some((0..count).map(|k| given.get(k).copied().unwrap_or(0.0)).collect())
        }
    }
}

/// `C = Σ 2ξ_kω_k (Mφ_k)(Mφ_k)ᵀ` over the modes of the open body; rigid motions are not damped.
pub(super) fn modal(scene: &Scene, system: &System) -> Result<Option<Dampers>, ProblemError> {
    let n = system.n_o();
    let Some(ratios) = modal_ratios(scene, n) else { return Ok(None) };
    if n > MOST {
        let message = format!("needs all {n} modes of the body: at most {MOST} are computed");
        let help = "add [reduction], or give ratios of two modes";
        return Err(scene.error(Issue::new("damping.modal", message, help)).into());
    }
    let phase = system.open_phase();
    let (k, m) = phase.matrices();
    let modes = crate::fem::eigen::all(&k, &m, system.units.frequency)?;
    let mut entries = vec![];
    let mut momentum = vec![0.0; n];
    let rates = modes.omega.iter().zip(&ratios).map(|(omega, ratio)| 2.0 * ratio * omega);
    let damped = rates.zip(&modes.shapes).filter(|(rate, _)| *rate > 0.0);
    let mut count = 0;
    for (rate, shape) in damped {
        m.mul(shape, &mut momentum);
        let row = momentum.iter().enumerate().map(|(j, x)| (count, j, rate.sqrt() * x));
        entries.extend(row.filter(|e| e.2 != 0.0));
        count += 1;
    }
    Ok((count > 0).then(|| Dampers::new(Csr::from_triplets(count, n, entries))))
}

/// `2ξω` of a mode of the open body.
pub(super) fn modal_damping(scene: &Scene, system: &System, mode: usize, omega: f64) -> f64 {
    let (alpha, beta) = system.damping.map_or((0.0, 0.0), |d| (d.alpha, d.beta));
    let own = modal_ratios(scene, mode).map_or(0.0, |r| 2.0 * r[mode - 1] * omega);
    alpha + beta * omega * omega + own
}

/// What `K` has across `M`, over all of it, is rounding below this.
const PARALLEL: f64 = 1e-12;

/// `α`, `β` of a damping matrix that is a combination of `M` and `K`.
pub(super) fn rayleigh_of(
    scene: &Scene,
    system: &System,
    name: &String,
) -> Result<Rayleigh, ProblemError> {
    let issue = |message: String| -> ProblemError {
        let help = "give a C that is α M + β K, or [damping] in its place";
        scene.error(Issue::new("body.damping_matrix", message, help)).into()
    };
    let c = square(scene, "body.damping_matrix", Some(name))?;
    // tips of springs have no damping of their own
    let n = system.n_displacements();
    if (c.n_rows(), c.n_cols()) != (n, n) {
        return Err(issue(format!(
            "is {} × {}, the other matrices {n} × {n}",
            c.n_rows(),
            c.n_cols()
        )));
    }
    let c = system.body.dofs.congruence(&c).leading(n);
    let dense = |a: &Csr| -> Vec<f64> {
        let mut d = vec![0.0; n * n];
        a.triplets().for_each(|(i, j, v)| d[i * n + j] = v);
        d
    };
    let body = &system.body;
    let (c, m, k) = (dense(&c), dense(&body.mass.leading(n)), dense(&body.structure().leading(n)));
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    // an orthonormal basis of M and K, so that nothing is lost where they are of very different size, or nearly parallel
    let norm = |a: &[f64]| dot(a, a).sqrt();
    let (of_m, of_c) = (norm(&m), norm(&c));
    let along: f64 = dot(&k, &m) / of_m;
    let across: Vec<f64> = k.iter().zip(&m).map(|(k, m)| k - along * m / of_m).collect();
    let of_k = norm(&across);
    let c_m = dot(&c, &m) / of_m;
    // a stiffness in proportion to the mass damps as the mass does
    let is_parallel = of_k <= PARALLEL * norm(&k);
    let beta = if is_parallel { 0.0 } else { dot(&c, &across) / (of_k * of_k) };
    let alpha = (c_m - beta * along) / of_m;
    let rest: Vec<f64> = (0..n * n).map(|i| c[i] - alpha * m[i] - beta * k[i]).collect();
    let share = norm(&rest) / of_c;
    // what each part contributes, over the whole
    let (part_m, part_k) = (alpha * of_m / of_c, beta * norm(&k) / of_c);
    if !(share <= 1e-8 && part_m >= -1e-8 && part_k >= -1e-8) {
        return Err(issue(format!(
            "is not α M + β K with α, β ≥ 0: {share:.1e} of it is left over (α = {alpha:.3e}, β = {beta:.3e})"
        )));
    }
    // a part that is a rounding error is none
    let clean = |x: f64, part: f64| if part.abs() <= 1e-12 { 0.0 } else { x.max(0.0) };
    Ok(Rayleigh { alpha: clean(alpha, part_m), beta: clean(beta, part_k) })
}
