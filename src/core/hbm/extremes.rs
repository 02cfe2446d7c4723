//! What forces and probes come to along a series.

use std::collections::HashMap;
use std::f64::consts::TAU;

use super::Interface;
use super::series::{Basis, Series};
use super::solution::Solution;
use crate::contact::{Phase, States};
use crate::event::Sample;
use crate::orbit::extremes::Watching;
use crate::records::ExtremesRecord;

/// States of a period that are looked at, as many as of an orbit, beside its switches.
const SAMPLES: usize = 200;

/// Of a solution of displacements `u`, with the contact that its phases have; accelerations are those of the equation of each phase, of a series that never switches its own.
pub(super) fn extremes(interface: &Interface, s: &Solution, u: &Series) -> ExtremesRecord {
    let system = &interface.system;
    let mut watching = Watching::new(system);
    if watching.is_idle() {
        return ExtremesRecord::default();
    }
    let mut phases: HashMap<&States, Phase> = HashMap::new();
    let n_o = system.n_o();
    let [mut displacement, mut velocity] = [0; 2].map(|_| vec![0.0; system.n()]);
    let mut acceleration = vec![];
    if watching.takes_accelerations() {
        acceleration.resize(system.n(), 0.0);
    }
    let mut scratch = system.scratch();
    let mut pressure = vec![0.0; system.n_contact()];
    let mut traction = vec![0.0; system.tangents().map_or(0, <[_]>::len)];
    // there, and where a reversible motion comes back as it went
    let mut ways = vec![1.0];
    ways.extend((s.q.basis == Basis::Cosine).then_some(-1.0));
    let mut is_first = true;
    for way in ways {
        for (j, (set, (a, b))) in s.phases().enumerate() {
            if !std::mem::take(&mut is_first) {
                watching.cut();
            }
            let phase = phases.entry(set).or_insert_with(|| system.phase(set));
            let count = (SAMPLES as f64 * (b - a) / TAU).ceil().max(2.0);
            for k in 0..=count as usize {
                let share = k as f64 / count;
                let along = a + (b - a) * if way > 0.0 { share } else { 1.0 - share };
                let theta = if way > 0.0 { along } else { TAU - along };
                let mut state = s.state(u, along, j);
                state.v.iter_mut().for_each(|v| *v *= way);
                let t = theta / s.omega;
                phase.expand_displacement(t, &state.u, &mut displacement);
                phase.expand_velocity(t, &state.v, &mut velocity);
                if !acceleration.is_empty() {
                    let own = &mut acceleration[..n_o];
                    if s.sets().len() == 1 {
                        u.second(along, own);
                        own.iter_mut().for_each(|a| *a *= s.omega * s.omega);
                    } else {
                        // a series of what jumps has the middle there, and no side
                        phase.acceleration(t, &state.u, &state.v, &mut scratch, own);
                    }
                    phase.complete_acceleration(t, &mut acceleration);
                }
                phase.pressures(t, &state.u, &mut pressure);
                if !traction.is_empty() {
                    phase.tractions(t, (&state.u, &state.v), &mut traction);
                }
                watching.note(&Sample {
                    t,
                    u: &displacement,
                    v: &velocity,
                    a: &acceleration,
                    active: set,
                    pressure: &pressure,
                    traction: &traction,
                    energies: None,
                    jumps: 0.0,
                });
            }
        }
    }
    if s.q.basis == Basis::Full {
        watching.close(TAU / s.omega);
    }
    watching.seen()
}
