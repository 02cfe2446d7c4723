//! Nodes held on a switching surface: the exceptional case of theory §5 where neither side can be entered.
//!
//! The node stays on `w_i = p_i = 0` and the acceleration is Filippov's convex combination `ü = ü_c + Σ θ_i (ü_f,i − ü_c)` with `θ` such that
//! `p̈_i = 0`. Its monitors are `θ_i` and `1 − θ_i`.

use nalgebra::{DMatrix, DVector};

use super::monitor::{Monitor, MonitorKind};
use super::phase::Phase;
use super::scratch::Scratch;
use super::states::PointState;

impl Phase {
    /// The phase `self`, in which the nodes `held` are in contact, with these nodes held; `released` are the phases with each one of them
    /// free.
    pub(super) fn hold(mut self, held: Vec<usize>, released: Vec<Phase>) -> Phase {
        let mut monitors = vec![];
        for m in std::mem::take(&mut self.monitors) {
            let of = |kind, to| Monitor { kind, to, ..m.clone() };
            match held.contains(&m.point) {
                true => {
                    monitors.push(of(MonitorKind::HeldToContact, PointState::Closed));
                    monitors.push(of(MonitorKind::HeldToFree, PointState::Open));
                }
                false => monitors.push(m),
            }
        }
        self.monitors = monitors;
        (self.held, self.released) = (held, released);
        self
    }

    pub(super) fn held_acceleration(
        &self,
        t: f64,
        u_o: &[f64],
        v_o: &[f64],
        s: &mut Scratch,
        a_o: &mut [f64],
    ) {
        let (theta, accelerations) = self.weights(t, u_o, v_o, s);
        a_o.copy_from_slice(&accelerations[0]);
        for (&theta, released) in theta.iter().zip(&accelerations[1..]) {
            for ((a, r), c) in a_o.iter_mut().zip(released).zip(&accelerations[0]) {
                *a += theta * (r - c);
            }
        }
    }

    /// Weights `θ` of the held nodes, and the accelerations with all of them in contact and with each one released.
    fn weights(
        &self,
        t: f64,
        u_o: &[f64],
        v_o: &[f64],
        s: &mut Scratch,
    ) -> (Vec<f64>, Vec<Vec<f64>>) {
        let mut accelerations: Vec<Vec<f64>> = vec![];
        let mut rates = vec![];
        // the phase in contact last: its full state is what stays in `s`
        for phase in self.released.iter().chain(std::iter::once(self)) {
            let mut a = vec![0.0; u_o.len()];
            phase.smooth_acceleration(t, u_o, v_o, s, &mut a);
            let rate = self.monitor_curvatures_at(t, &a);
            let of_point = |i: &usize| self.monitor_of(*i).map_or(0.0, |k| rate[k]);
            rates.push(self.held.iter().map(of_point).collect::<Vec<f64>>());
            accelerations.push(a);
        }
        rates.rotate_right(1);
        accelerations.rotate_right(1);
        let k = self.held.len();
        let matrix = DMatrix::from_fn(k, k, |i, j| rates[1 + j][i] - rates[0][i]);
        let rhs = DVector::from_iterator(k, rates[0].iter().map(|r| -r));
        // where the sides do not differ there is no motion on the surface: not a number, which the flow reports
        let theta = matrix.lu().solve(&rhs).unwrap_or_else(|| DVector::from_element(k, f64::NAN));
        (theta.as_slice().to_vec(), accelerations)
    }

    /// The weights `θ` of the held nodes at a state.
    pub(crate) fn held_theta(&self, t: f64, u_o: &[f64], v_o: &[f64], s: &mut Scratch) -> Vec<f64> {
        if self.held.is_empty() { vec![] } else { self.weights(t, u_o, v_o, s).0 }
    }
}
