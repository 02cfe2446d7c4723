//! Gaps that move from place to place: `g(x, t) = g₀(x) + Σ_k (c_k(x) cos ω_k t + s_k(x) sin ω_k t)`.
//!
//! Contact displacements are counted from where the gap has gone, `u_C = ũ_C + q(t)` with `q = g − g₀` along the normals, so that the gap of `ũ` is
//! constant. They have no mass, and what is left is a load:
//!
//! ```text
//! M ü + C u̇ + K u = f      becomes      M ũ¨ + C ũ˙ + K ũ = f − K q − β K q̇
//! ```
//!
//! Pressures are elastic: they bear `K q`, and the other, a force of dampers, acts through what contact displacements follow.

use std::f64::consts::FRAC_PI_2;

use super::ProblemError;
use super::places::place;
use crate::contact::System;
use crate::fem::{Course, Loads};
use crate::scenario::{Issue, Scene, Wave};

/// One frequency: what it adds to the gaps of the contact points, with the cosine and with the sine.
struct Tone {
    omega: f64,
    parts: [Vec<f64>; 2],
}

/// The loads of gaps that move.
pub(super) fn gaps(scene: &Scene, system: &System, loads: &mut Loads) -> Result<(), ProblemError> {
    let beta = system.damping.map_or(0.0, |d| d.beta);
    let (n, n_o) = (system.n(), system.n_o());
    for tone in tones(scene, system)? {
        for (part, phase) in tone.parts.into_iter().zip([0.0, -FRAC_PI_2]) {
            if part.iter().all(|x| *x == 0.0) {
                continue;
            }
            let course = Course::Harmonic { omega: tone.omega, phase };
            let mut q = vec![0.0; n];
            q[n_o..n_o + part.len()].copy_from_slice(&part);
            let (mut force, mut damped) = (vec![0.0; n], vec![0.0; n]);
            system.body.stiffness.mul(&q, &mut force);
            system.body.structure().mul(&q, &mut damped);
            loads.follow(force.iter().map(|f| -f).collect(), 0, &course);
            if beta != 0.0 {
                loads.damp(damped.iter().map(|f| -beta * f).collect(), &course);
            }
            loads.carried.push_contact(q.split_off(n_o), force, &course);
        }
    }
    Ok(())
}

/// What moves of the gaps of the contact points, frequency by frequency.
fn tones(scene: &Scene, system: &System) -> Result<Vec<Tone>, ProblemError> {
    let Some(c) = scene.contact.as_ref().filter(|c| c.swings()) else { return Ok(vec![]) };
    let (body, facing) = (&system.body, system.facing().len());
    let mut tones: Vec<Tone> = vec![];
    for (k, obstacle) in c.obstacles.iter().enumerate() {
        let Some(swings) = &obstacle.swings else { continue };
        let refuse = |node: usize, why: &str| {
            let at = place(body.mesh.nodes()[node], scene.dim());
            let help = "let t stand in one sine or cosine, linear: \"0.3 + 0.1*cos(2*(atan2(y, x) - 5.0*t))\"";
            scene.error(Issue::new(c.key(k, "gap"), format!("{why}, at {at}"), help))
        };
        let mut first: Option<Vec<Wave>> = None;
        for node in body.mesh.group_nodes(&obstacle.group) {
            let Some(i) = body.dofs.contact_at(k, node) else { continue };
            let others = (0..c.obstacles.len()).filter(|j| *j != k);
            if others.into_iter().any(|j| body.dofs.contact_at(j, node) == Some(i)) {
                return Err(refuse(node, "moves, and another obstacle stands before it").into());
            }
            let waves = swings.at(body.mesh.nodes()[node]).map_err(|why| refuse(node, why))?;
            let first = first.get_or_insert_with(|| waves.clone());
            for (wave, of_first) in waves.iter().zip(first.iter()) {
                let omega = of_first.omega;
                if (wave.omega - omega).abs() > 1e-9 * omega {
                    let why = format!(
                        "has the frequency {:.6}, and {omega:.6} elsewhere: time runs alike at all places",
                        wave.omega
                    );
                    return Err(refuse(node, &why).into());
                }
                let same = |t: &Tone| (t.omega - omega).abs() <= 1e-9 * omega;
                let at = tones.iter().position(same).unwrap_or_else(|| {
                    tones.push(Tone { omega, parts: [vec![0.0; facing], vec![0.0; facing]] });
                    tones.len() - 1
                });
                let Wave { amplitude, phase, .. } = *wave;
                if !phase.is_finite() || amplitude.is_nan() || amplitude.abs() > 1e60 {
                    return Err(refuse(node, "is no number, or beyond 1e60").into());
                }
                tones[at].parts[0][i] += amplitude * phase.cos();
                tones[at].parts[1][i] -= amplitude * phase.sin();
            }
        }
    }
    Ok(tones)
}
