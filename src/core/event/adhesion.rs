//! What points do next before rough obstacles that have no mass in any direction ([`crate::contact`]'s adhesion): open, stick, slip forwards or backwards.
//!
//! At a switch the data of order k are `b = f_C^(k) − K_CO u_O^(k)`, the unknown `u_C^(k)`. Undecided are the points whose condition vanishes, and every point that slips: velocities
//! `u̇_C` jump at the switches of others. Each undecided point is in that of its states whose conditions, one order up, hold; what meets one of them with equality stays undecided
//! between the states that share it, and goes to the next order:
//!
//! ```text
//! {stick, slip σ} if s = 0 and μ r_n = σ r_t;   {open, slip sgn s} if w = r_n = 0 ≠ s;   all if all vanish
//! ```
//!
//! `u_C^(k)` is unique even where the states are not, and with it `u_O^(k+2)`. That a slip ends is decided by the second order, everything else generically by the first.

use super::classify::{ClassifyError, Decision, Order, Surface};
use crate::contact::{
    Anchor, Choice, MonitorKind, Phase, PointState, Scratch, States, System, Touch,
};

/// The last order that is looked at; what is undecided still keeps its present state: both agree to that order.
const LAST: u32 = 4;

/// A condition of a state vanishes below this share of the size of its terms, one of a higher order below that.
const ZERO: [f64; 2] = [1e-13, 1e-10];

/// How far from zero the numbers of one order may be that vanish: of displacements, of reactions.
#[derive(Clone, Copy)]
struct Blur([f64; 2]);

impl Blur {
    /// What the resolution of time makes of the next order.
    fn of(resolution: f64, next: &[Touch]) -> Blur {
        let most = |k: usize| next.iter().map(|t| t.sizes[k]).fold(0.0, f64::max);
        Blur([0, 1].map(|k| 8.0 * resolution * most(k)))
    }

    fn moves(&self, x: f64, touch: &Touch, share: f64) -> bool {
        x.abs() > share * touch.sizes[0] + self.0[0]
    }

    fn pulls(&self, x: f64, touch: &Touch, share: f64) -> bool {
        x.abs() > share * touch.sizes[1] + self.0[1]
    }
}

impl Surface<'_> {
    /// The states of all points; `u_c` are the contact displacements, `trigger` the monitor that reached zero.
    pub(super) fn adhere(
        &self,
        u_c: &[f64],
        trigger: Option<(usize, MonitorKind)>,
        scratch: &mut Scratch,
    ) -> Result<Decision, ClassifyError> {
        let (system, present) = (self.system, &self.phase.set);
        let anchors = system.anchors();
        // where what does not stick would
        let mut u_o = self.u_o.to_vec();
        for (point, anchor) in &anchors {
            if present.at(*point) != PointState::Stick {
                u_o[anchor.memory] = u_c[anchor.displacement];
            }
        }
        // derivatives of u_O in the present phase: the sizes of what rounding makes of each order
        let mut derivatives = vec![self.v_o.to_vec()];
        for _ in 1..=LAST {
            let next = self.derivative((self.phase, &u_o), &derivatives, scratch);
            derivatives.push(next);
        }
        let blurs: Vec<Blur> = (0..=LAST)
            .map(|k| {
                let x = &derivatives[k as usize];
                Blur::of(self.resolution, &system.touches(self.phase, (self.t, k + 1), x))
            })
            .collect();
        let now = system.touches(self.phase, (self.t, 0), self.u_o);
        let mut undecided: Vec<(usize, Choice)> = (0..now.len())
            .filter_map(|i| Some((i, choice(system, present, (i, &now[i]), blurs[0], trigger)?)))
            .collect();
        let (mut set, mut order) = (present.clone(), 0);
        let mut derivatives = vec![self.v_o.to_vec()];
        while !undecided.is_empty() && order < LAST {
            order += 1;
            let x = &derivatives[order as usize - 1];
            let at = |phase: &Phase| {
                system.touches(phase, (self.t, order), &moved(&anchors, (system, phase), x, order))
            };
            let blur = blurs[order as usize];
            let found = system.pivot_adhesion(set, &undecided, blur.0, at);
            let Some((states, touches)) = found else {
                let nodes = undecided.iter().map(|u| u.0).collect();
                return Err(ClassifyError::Unresolved { t: self.t, nodes });
            };
            set = states;
            undecided.retain_mut(|(i, choice)| {
                let next = tied(system, *i, (*choice, &touches[*i]), blur);
                next.is_some_and(|next| {
                    *choice = next;
                    true
                })
            });
            let phase = system.phase(&set);
            derivatives[0] = moved(&anchors, (system, &phase), &derivatives[0], 1);
            let next = self.derivative((&phase, &u_o), &derivatives, scratch);
            derivatives.push(next);
        }
        let order = match order {
            0 => Order::Displacement,
            1 => Order::Velocity,
            _ => Order::Acceleration,
        };
        Ok(Decision { set, held: vec![], order, grazing: vec![], ambiguous: Some(false) })
    }

    /// The next derivative of `u_O` in a phase after `u̇_O`, `ü_O`, …: the acceleration, or `x^(k+2) = L(x^(k), x^(k+1)) + M⁻¹ f^(k)`.
    fn derivative(
        &self,
        (phase, u_o): (&Phase, &[f64]),
        known: &[Vec<f64>],
        scratch: &mut Scratch,
    ) -> Vec<f64> {
        let n_o = self.system.n_o();
        let mut of = |u: &[f64], v: &[f64]| {
            let mut a = vec![0.0; n_o];
            phase.acceleration(self.t, u, v, scratch, &mut a);
            a
        };
        let [.., x, w] = known else { return of(u_o, &known[0]) };
        let still = vec![0.0; n_o];
        let (mut next, rest) = (of(x, w), of(&still, &still));
        let order = known.len() as u32 - 1;
        let mut pushed = vec![0.0; n_o];
        let loads = &self.system.loads;
        for load in loads.harmonics.iter().filter(|load| !load.damps) {
            phase.force_acceleration(&load.force, scratch, &mut pushed);
            let factor = load.factor(self.t, order);
            next.iter_mut().zip(&pushed).for_each(|(x, p)| *x += factor * p);
        }
        next.iter_mut().zip(&rest).for_each(|(x, r)| *x -= r);
        self.system.anchors().iter().for_each(|(_, a)| next[a.memory] = 0.0);
        next
    }
}

/// A derivative of `u_O` with that of what only remembers: where a point sticks it moves with the surface.
fn moved(
    anchors: &[(usize, Anchor)],
    (system, phase): (&System, &Phase),
    x: &[f64],
    order: u32,
) -> Vec<f64> {
    let mut x = x.to_vec();
    for (point, anchor) in anchors {
        let sticks = order == 1 && phase.set.at(*point) == PointState::Stick;
        let surface = system.tangent(*point).filter(|_| sticks).map_or(0.0, |t| t.surface);
        x[anchor.memory] = surface;
    }
    x
}

/// Between which states a point is undecided at a state; none where it is not.
fn choice(
    system: &System,
    present: &States,
    (point, touch): (usize, &Touch),
    blur: Blur,
    trigger: Option<(usize, MonitorKind)>,
) -> Option<Choice> {
    let found = |kind: MonitorKind| trigger == Some((point, kind));
    let state = present.at(point);
    if state == PointState::Open {
        let closes = found(MonitorKind::Gap) || !blur.moves(touch.gap, touch, ZERO[0]);
        return closes.then_some(Choice::ALL);
    }
    if found(MonitorKind::Pressure) || !blur.pulls(touch.normal, touch, ZERO[0]) {
        return Some(Choice::ALL);
    }
    if let Some(sigma) = state.slip() {
        return Some(Choice::of_slip(sigma));
    }
    let tangent = system.tangent(point)?;
    let margin = |sigma: f64| tangent.coefficient * touch.normal - sigma * touch.tangential;
    let at_limit =
        |sigma: f64, kind: MonitorKind| found(kind) || !blur.pulls(margin(sigma), touch, ZERO[0]);
    let slips = [at_limit(1.0, MonitorKind::StickPlus), at_limit(-1.0, MonitorKind::StickMinus)];
    slips.contains(&true).then_some(Choice { opens: false, sticks: true, slips })
}

/// Between which of its states a point is undecided still, where it meets conditions of this order with equality.
fn tied(
    system: &System,
    point: usize,
    (choice, touch): (Choice, &Touch),
    blur: Blur,
) -> Option<Choice> {
    let vanishes = |x: f64| !blur.moves(x, touch, ZERO[1]);
    let relaxes = |x: f64| !blur.pulls(x, touch, ZERO[1]);
    let Some(tangent) = system.tangent(point) else {
        return (vanishes(touch.gap) && relaxes(touch.normal)).then_some(choice);
    };
    if choice.opens && vanishes(touch.gap) && relaxes(touch.normal) {
        if vanishes(touch.slide) {
            return Some(choice);
        }
        let slips = [touch.slide > 0.0, touch.slide < 0.0];
        return Some(Choice { opens: true, sticks: false, slips });
    }
    let margin = |sigma: f64| tangent.coefficient * touch.normal - sigma * touch.tangential;
    let meets = |sigma: f64| choice.may_slip(sigma) && relaxes(margin(sigma));
    let slips = [meets(1.0), meets(-1.0)];
    let is_tied = vanishes(touch.slide) && slips.contains(&true) && choice.sticks;
    is_tied.then_some(Choice { opens: false, sticks: true, slips })
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::contact::boundary::reaction;
    use crate::contact::{Gaps, MassChoice, Rayleigh, Rubs, State, Stress, Tangent};
    use crate::event::{Options, Report, Silent, SwitchKind, run};
    use crate::fem::{Body, ContactRows, Csr};
    use crate::flow::{Modal, RungeKutta, Tolerances, dop853::DOP853, exact};

    fn csr(a: &DMatrix<f64>) -> Csr {
        let all = (0..a.nrows()).flat_map(|i| (0..a.ncols()).map(move |j| (i, j, a[(i, j)])));
        Csr::from_triplets(a.nrows(), a.ncols(), all.filter(|e| e.2 != 0.0).collect())
    }

    /// Masses `m`, then normal and tangential displacement of one point without mass that is pressed against its obstacle by a force of one on some displacement.
    fn pressed(
        (masses, stiffness): (&[f64], &DMatrix<f64>),
        (friction, surface): (f64, f64),
        loaded: usize,
    ) -> System {
        let n = masses.len();
        let mut mass = DMatrix::zeros(n + 2, n + 2);
        masses.iter().enumerate().for_each(|(i, m)| mass[(i, i)] = *m);
        let rows = ContactRows {
            facing: vec![n],
            against: vec![vec![]],
            idle: vec![n + 1],
            tangents: vec![(n + 1, 0)],
            ..ContactRows::default()
        };
        let body = Body::from_matrices(&csr(&mass), &csr(stiffness), &rows, 1.0).unwrap();
        let body = body.with_memory(1);
        let operator = reaction(&body, vec![1.0; 2]);
        let tangent = Tangent {
            row: vec![],
            anchor: Some(Anchor { displacement: 1, memory: n }),
            coefficient: friction,
            surface,
            direction: [0.0, 1.0, 0.0],
            only_slips: false,
        };
        let rubs = Rubs { tangents: vec![Some(tangent)], sliders: vec![] };
        let choice = (Stress::Reaction, MassChoice::Condensed);
        let gaps = Gaps::front(vec![0.0]);
        let mut system = System::with_operator(body, operator, gaps, choice, rubs).unwrap();
        let mut load = vec![0.0; n + 3];
        load[loaded] = 1.0;
        system.loads_mut().push(load, None, 0.0);
        system
    }

    /// `m = k = 1`, the point behind a spring `k_t`.
    fn oscillator(k_t: f64, friction: (f64, f64)) -> System {
        let k = [[1.0 + k_t, 0.0, -k_t], [0.0, 1.0, 0.0], [-k_t, 0.0, k_t]];
        pressed((&[1.0], &DMatrix::from_fn(3, 3, |i, j| k[i][j])), friction, 2)
    }

    fn go(system: &System, start: (f64, f64), until: f64) -> [Report; 2] {
        let n_o = system.n_o();
        let mut state = State { u: vec![0.0; n_o], v: vec![0.0; n_o] };
        (state.u[0], state.v[0]) = start;
        let options = Options { until, samples: 0, switch_limit: 400.0 };
        let tight = Tolerances { rtol: 1e-13, atol: 1e-15 };
        let mut modal = exact(Box::new(Modal::new(system)), system);
        let mut steps = RungeKutta::new(system, &DOP853, tight);
        [
            run(system, &state, &options, &mut modal, &mut Silent).unwrap(),
            run(system, &state, &options, &mut steps, &mut Silent).unwrap(),
        ]
    }

    fn times(report: &Report, kind: SwitchKind) -> Vec<f64> {
        report.switches.iter().filter(|s| s.kind == kind).map(|s| s.t).collect()
    }

    /// Jenkins' element: free turning points `A ↦ −a + √((A − a)² + 4ab)`, `a = μN/k`, `b = μN/k_t`; times and the loss until t = 60 by an independent program.
    #[test]
    fn an_oscillator_behind_a_spring_turns_where_the_closed_form_says() {
        let system = oscillator(10.0, (0.3, 0.0));
        for report in go(&system, (5.0, 0.0), 60.0) {
            assert!(report.outcome.is_complete(), "{}", report.outcome);
            let sticks = times(&report, SwitchKind::Sticking);
            for (found, wanted) in sticks.iter().zip([3.128_744_981_404, 6.254_714_527_092]) {
                assert!((found - wanted).abs() < 1e-11, "{found} {wanted}");
            }
            let lost = report.rubbed.as_ref().unwrap().work();
            assert!((lost - 12.493_986_214_706).abs() < 1e-11, "{lost}");
            assert!(report.energy_drift_total < 1e-12, "{}", report.energy_drift_total);
        }
        let (a, b) = (0.3, 0.03);
        let mut amplitude: f64 = 5.0;
        for until in [3.128_744_981_404, 6.254_714_527_092] {
            amplitude = -a + ((amplitude - a).powi(2) + 4.0 * a * b).sqrt();
            for report in go(&system, (5.0, 0.0), until) {
                assert!((report.last.u[0].abs() - amplitude).abs() < 1e-11);
            }
        }
    }

    /// On a belt, from rest: switches by an independent program; what the belt brings is lost or held.
    #[test]
    fn a_belt_carries_what_sticks_without_mass() {
        let slides = [0.156_276_119_604, 0.807_140_286_437, 2.101_669_562_003];
        let stays = [
            0.092_836_379_377,
            0.429_932_563_450,
            1.381_821_561_399,
            1.652_509_375_837,
            2.532_607_171_483,
        ];
        for (k_t, friction, wanted) in
            [(10.0, (0.3, 0.2), &slides[..]), (30.0, (0.4, 0.15), &stays[..])]
        {
            for report in go(&oscillator(k_t, friction), (0.0, 0.0), 10.0) {
                assert!(report.outcome.is_complete(), "{}", report.outcome);
                let found: Vec<f64> = report.switches.iter().map(|s| s.t).collect();
                assert_eq!(found.len(), wanted.len(), "{found:?}");
                for (found, wanted) in found.iter().zip(wanted) {
                    assert!((found - wanted).abs() < 1e-11, "{found} {wanted}");
                }
                assert!(report.energy_drift_total < 1e-12, "{}", report.energy_drift_total);
            }
        }
    }

    /// Two displacements whose modes couple by friction come to a limit cycle that sticks, slips and lifts off: period and loss by an independent program.
    #[test]
    fn two_displacements_squeal_as_those_of_another_program() {
        let third = 3f64.sqrt();
        // springs of 11 and 20 at 150° and 30°, one of 11 at the contact
        let [k11, k12, k22] = [0.75 * 31.0, 0.25 * third * 9.0, 0.25 * 31.0 + 11.0];
        for ((friction, k_t, surface, alpha), period, lost) in [
            ((0.5, 100.0, 0.05, 0.02), 1.527_310_359_692, 0.020_915_953_837),
            ((0.6, 100.0, 0.02, 0.2), 1.437_388_653_474, 0.008_288_786_643),
            ((0.6, 20.0, 0.05, 0.1), 1.517_681_798_904, 0.010_695_837_525),
        ] {
            let k = [
                [k11 + k_t, k12, 0.0, -k_t],
                [k12, k22, -11.0, 0.0],
                [0.0, -11.0, 11.0, 0.0],
                [-k_t, 0.0, 0.0, k_t],
            ];
            let stiffness = DMatrix::from_fn(4, 4, |i, j| k[i][j]);
            let mut system = pressed((&[1.0; 2], &stiffness), (friction, surface), 1);
            system.damping = Some(Rayleigh { alpha, beta: 0.0 });
            let until = 800.0;
            let [report, _] = go(&system, (0.0, 0.0), until);
            assert!(report.outcome.is_complete(), "{}", report.outcome);
            assert!(report.energy_drift_total < 1e-11, "{}", report.energy_drift_total);
            let all = times(&report, SwitchKind::Slipping);
            let last = all[all.len() - 1];
            let off = |t: &f64| (last - t - period).abs();
            let before = *all.iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
            assert!(off(&before) < 1e-10, "{} {period}", last - before);
            let work = |t: f64| go(&system, (0.0, 0.0), t)[0].rubbed.as_ref().unwrap().work();
            let found = work(last) - work(before);
            assert!((found - lost).abs() < 1e-10, "{found} {lost}");
        }
    }
}
