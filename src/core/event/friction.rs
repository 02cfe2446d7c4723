//! Which points stick and which slip at a state (`v_t` relative to the obstacle's surface, `λ` the reaction that would hold a point).
//!
//! A point that moves along the surface slips, by the sign of its velocity. Those at rest, what sticks and what has just come to rest, are undecided:
//!
//! ```text
//! a_t = a_t⁰ − D (r_t − r_t⁰),      r_t = σ μ r_n with σ a_t ≥ 0,   or   a_t = 0 with |r_t| ≤ μ r_n
//! ```
//!
//! has one solution, for `D = E M⁻¹ Eᵀ` is positive definite. It is found by pivoting: in the phase of the present states every point that violates its own
//! condition moves to the neighbouring state. Where `|r_t| = μ r_n` and `a_t = 0` both hold, as they do when a point breaks loose, the rate of
//! `μ r_n ∓ r_t` in the phase in which it sticks decides.

use super::classify::{ClassifyError, Decision, Surface};
use crate::contact::{MonitorKind, Phase, PointState, Scratch, States, System};
use crate::fem::largest;

/// Rounds in which all violating points change together; after these one at a time.
const TOGETHER: usize = 10;
/// Acceleration of a point that has just broken loose, over the largest: as far as its reaction is from the limit at the instant that was found.
const LOOSE: f64 = 1e-7;
/// How far from zero the monitor may be that reached it, in rounding errors: as far as the flow is from the motion.
const FOUND: f64 = 1e5;
/// A slider at its limit is at rest below this velocity, over that of its spring.
const STILL: f64 = 1e-9;
/// Rounding errors of a velocity, of an acceleration and of a reaction, over their sizes.
const ROUNDING: f64 = 256.0 * f64::EPSILON;

/// What pivoting knows besides the states.
struct Pivoted<'a> {
    /// What has broken loose by its rate.
    loose: &'a [bool],
    /// Acceleration of the forces that stuck points take.
    of_forces: f64,
}

impl Surface<'_> {
    /// The decision with the states along the tangents put in; `trigger` is the monitor along a tangent that reached zero.
    pub(super) fn rub(
        &self,
        mut decision: Decision,
        trigger: Option<(usize, MonitorKind)>,
        scratch: &mut Scratch,
    ) -> Result<Decision, ClassifyError> {
        let Some(tangents) = self.system.tangents() else { return Ok(decision) };
        let size = largest(self.v_o);
        // where one comes to rest others may, within what an instant is known to
        let slows = match trigger {
            Some((_, MonitorKind::Slip)) => self.acceleration(self.phase, scratch),
            _ => vec![0.0; self.v_o.len()],
        };
        let mut undecided = vec![];
        for (i, tangent) in tangents.iter().enumerate() {
            let Some(tangent) = tangent.as_ref().filter(|_| decision.set.touches(i)) else {
                continue;
            };
            let slip = tangent.slip_velocity(self.v_o);
            let blur = 8.0 * self.resolution * tangent.along(&slows).abs();
            if let Some(trial) = self.system.slider(i).and_then(|s| s.trial(self.u_o)) {
                let least = blur.max(ROUNDING * size);
                let state = self.of_spring(i, (trial, slip, least), trigger, &slows);
                decision.set.set(i, state);
                continue;
            }
            let rests = slip.abs() <= blur.max(ROUNDING * size.max(tangent.surface.abs()));
            let stuck = self.phase.set.at(i) == PointState::Stick;
            let is_undecided = rests || stuck || trigger.is_some_and(|t| t.0 == i);
            if is_undecided && tangent.only_slips {
                return Err(ClassifyError::Rests { t: self.t, node: i });
            }
            if is_undecided {
                undecided.push(i);
                decision.set.set(i, PointState::Stick);
            } else {
                decision.set.set(i, PointState::of_slip(slip));
            }
        }
        if !undecided.is_empty() {
            // reactions are those of springs that are at their limits at the most
            let mut u_o = self.u_o.to_vec();
            remember(self.system, &decision.set, &mut u_o);
            let settled = Surface { u_o: &u_o, ..*self };
            decision.set = settled.pivot(decision.set, &undecided, trigger, scratch)?;
        }
        Ok(decision)
    }

    /// What a slider with a spring does, whose trial force is `k (w u − z)`: it slides where that is at its limit or beyond, and grows. It is at rest below the velocity
    /// `least`; `slows` are the accelerations where some slip ends.
    fn of_spring(
        &self,
        point: usize,
        (trial, slip, least): (f64, f64, f64),
        trigger: Option<(usize, MonitorKind)>,
        slows: &[f64],
    ) -> PointState {
        let Some(slider) = self.system.slider(point) else { return PointState::Stick };
        let stiffness = slider.elastic.map_or(0.0, |e| e.stiffness);
        let sigma = trial.signum();
        let found = trigger.filter(|t| t.0 == point).map(|t| t.1);
        if found == Some(MonitorKind::Slip) {
            // it comes to rest, or its velocity only touches zero
            let goes_on = sigma * slider.along(slows) > LOOSE * largest(slows);
            return if goes_on { PointState::of_slip(sigma) } else { PointState::Stick };
        }
        // of several sliders that come to rest at one instant each ends by itself
        let slides = self.phase.set.at(point).slip().is_some();
        let least = match slides || found.is_some() {
            true => least,
            false => STILL * self.system.units.frequency * slider.limit / stiffness,
        };
        let blur = ROUNDING * slider.limit + 8.0 * self.resolution * stiffness * slip.abs();
        let at_limit = slides || found.is_some() || trial.abs() >= slider.limit - blur;
        match at_limit && sigma * slip > least {
            true => PointState::of_slip(sigma),
            false => PointState::Stick,
        }
    }

    fn pivot(
        &self,
        mut set: States,
        points: &[usize],
        trigger: Option<(usize, MonitorKind)>,
        scratch: &mut Scratch,
    ) -> Result<States, ClassifyError> {
        // what has broken loose by its rate, and stays so
        let mut loose = vec![false; points.len()];
        // accelerations that are but what cancelled forces leave by rounding decide nothing: where it goes round in circles, their sizes are asked for
        let mut of_forces = 0.0;
        for round in 0..TOGETHER + 8 * points.len() {
            if round == TOGETHER {
                let mut all_slip = set.clone();
                points.iter().for_each(|i| all_slip.set(*i, PointState::SlipPlus));
                of_forces = self.unhindered(&self.system.phase(&all_slip), scratch);
            }
            let phase = self.system.phase(&set);
            let known = Pivoted { loose: &loose, of_forces };
            let moves = self.violations(&phase, points, trigger, &known, scratch);
            let few = if round < TOGETHER { moves.len() } else { moves.len().min(1) };
            if few == 0 {
                return Ok(set);
            }
            for &(k, to, by_rate) in &moves[..few] {
                set.set(points[k], to);
                loose[k] = by_rate;
            }
        }
        Err(ClassifyError::Unresolved { t: self.t, nodes: points.to_vec() })
    }

    /// The points that leave their state: place in the list, whereto, and whether a rate decides that.
    fn violations(
        &self,
        phase: &Phase,
        points: &[usize],
        trigger: Option<(usize, MonitorKind)>,
        known: &Pivoted,
        scratch: &mut Scratch,
    ) -> Vec<(usize, PointState, bool)> {
        let a = self.acceleration(phase, scratch);
        // accelerations of the body's own forces: of one that rests there are no others
        let units = &self.system.units;
        let own = units.frequency * largest(self.v_o).max(units.frequency * largest(self.u_o));
        let scale = largest(&a).max(own).max(known.of_forces);
        let blur = ROUNDING * scale;
        let h = phase.monitor_values(self.t, self.u_o, self.v_o);
        let rates = phase.monitor_rates(self.t, self.v_o, &a);
        let rounding =
            phase.monitor_rounding(largest(self.u_o).max(units.length), largest(self.v_o));
        let mut moves = vec![];
        for (k, &i) in points.iter().enumerate() {
            let Some(tangent) = self.system.tangent(i) else { continue };
            let state = phase.set.at(i);
            if let Some(sigma) = state.slip() {
                let along = sigma * tangent.along(&a);
                // what broke loose by its rate starts without an acceleration
                let stays = if known.loose[k] { along >= -LOOSE * scale } else { along > blur };
                if !stays {
                    moves.push((k, PointState::Stick, false));
                }
                continue;
            }
            let of = phase.monitors.iter().enumerate().filter(|(_, m)| m.point == i);
            let sides = of.filter(|(_, m)| {
                [MonitorKind::StickPlus, MonitorKind::StickMinus].contains(&m.kind)
            });
            // the side that is violated most, or leaves zero fastest
            let worst = sides
                .filter_map(|(m, monitor)| {
                    let slack = 16.0 * rounding[m] + 8.0 * self.resolution * rates[m].abs();
                    let found = trigger == Some((i, monitor.kind));
                    let tied = h[m].abs() <= if found { FOUND * slack } else { slack };
                    match tied {
                        true => (rates[m] < 0.0).then_some((monitor.to, 0.0, true)),
                        false => (h[m] < 0.0).then_some((monitor.to, h[m], false)),
                    }
                })
                .min_by(|a, b| a.1.total_cmp(&b.1));
            if let Some((to, _, by_rate)) = worst {
                moves.push((k, to, by_rate));
            }
        }
        moves
    }
}

/// Where springs of sliders stick, none is beyond its limit.
pub(super) fn remember(system: &System, set: &States, u_o: &mut [f64]) {
    let first = system.facing().len();
    for (s, slider) in system.sliders().iter().enumerate() {
        if set.at(first + s) == PointState::Stick {
            slider.settle(u_o);
        }
    }
}

/// Give what sticks exactly the velocity of the surface; springs of sliders stick at any, and what they remember has none.
pub(super) fn settle(system: &System, set: &States, v_o: &mut [f64]) {
    system.sliders().iter().filter_map(|s| s.elastic).for_each(|e| v_o[e.memory] = 0.0);
    for (i, state) in set.iter().enumerate() {
        if let (Some(t), PointState::Stick) = (system.rigid_tangent(i), state) {
            t.settle(v_o);
        }
    }
}

/// Where a displacement without mass begins to stick, `z` is where it is; what sticks moves with the surface. `y` has displacements and velocities of `u_O`.
pub(super) fn anchor(
    system: &System,
    (before, after): (&States, &States),
    u: &[f64],
    y: &mut [f64],
) {
    let n_o = system.n_o();
    for (point, anchor) in system.anchors() {
        let sticks = after.at(point) == PointState::Stick;
        if sticks && before.at(point) != PointState::Stick {
            y[anchor.memory] = u[n_o + anchor.displacement];
        }
        let surface = system.tangent(point).filter(|_| sticks).map_or(0.0, |t| t.surface);
        y[n_o + anchor.memory] = surface;
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::contact::boundary::reaction;
    use crate::contact::{Elastic, Gaps, MassChoice, Rubs, Slider, Stress, Tangent};
    use crate::event::classify::Order;
    use crate::fem::{Body, ContactRows, Csr};

    const N: usize = 6;
    const POINTS: usize = 5;
    const RESOLUTION: f64 = 1e-12;

    /// Six displacements with mass and two without that are pressed against belts; three sliders. The equations of motion as dense matrices, and the same as a system.
    struct Joint {
        mass: DMatrix<f64>,
        stiffness: DMatrix<f64>,
        /// `f − K_OC g`
        force: DVector<f64>,
        rows: Vec<DVector<f64>>,
        /// `μ K_C`, `μ K_CC g`: limits are minus the first times `u` less the second; of sliders the second alone, with its sign turned.
        pressure: Vec<(DVector<f64>, f64)>,
        surface: [f64; POINTS],
    }

    struct Numbers(u64);

    impl Numbers {
        /// From −1 to 1.
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }

        fn vector(&mut self, n: usize) -> DVector<f64> {
            DVector::from_fn(n, |_, _| self.next())
        }

        fn positive(&mut self, n: usize) -> DMatrix<f64> {
            let a = DMatrix::from_fn(n, n, |_, _| self.next());
            &a * a.transpose() + DMatrix::identity(n, n)
        }
    }

    fn csr(a: &DMatrix<f64>) -> Csr {
        let entries = (0..a.nrows()).flat_map(|i| (0..a.ncols()).map(move |j| (i, j, a[(i, j)])));
        Csr::from_triplets(a.nrows(), a.ncols(), entries.filter(|e| e.2 != 0.0).collect())
    }

    /// A joint and a state of it, in which both points are pressed against their obstacles.
    fn joint(seed: u64, limits: Option<&[f64]>) -> (Joint, System, Vec<f64>) {
        let mut random = Numbers(seed);
        for _ in 0..10 {
            random.next();
        }
        let (mass, whole) = (random.positive(N), random.positive(N + 2));
        let rows: Vec<DVector<f64>> = (0..POINTS).map(|_| random.vector(N)).collect();
        let force = random.vector(N);
        let surface = [0.3 * random.next(), 0.0, 0.0, 0.0, 0.0];
        let u = random.vector(N);
        let of_contact = |i: usize| whole.row(N + i).columns(0, N).transpose();
        // gaps at which the reactions are what is wanted: K_C u + K_CC g = −r
        let r = DVector::from_fn(2, |_, _| 1.0 + 0.5 * random.next());
        let k_cc = whole.view((N, N), (2, 2)).clone_owned();
        let pulled = DVector::from_fn(2, |i, _| -r[i] - of_contact(i).dot(&u));
        let gap = k_cc.clone().lu().solve(&pulled).unwrap();
        let mut mu = [0.5 + 0.4 * random.next(), 0.5 + 0.4 * random.next()];
        let mut of_sliders: Vec<f64> = (0..3).map(|_| 1.0 + 0.9 * random.next()).collect();
        if let Some(limits) = limits {
            mu = [limits[0] / r[0], limits[1] / r[1]];
            of_sliders = limits[2..].to_vec();
        }
        let of_contacts = (0..2).map(|i| (mu[i] * of_contact(i), mu[i] * (&k_cc * &gap)[i]));
        let of_others = of_sliders.iter().map(|l| (DVector::zeros(N), -l));
        let pressure = of_contacts.chain(of_others).collect();

        let entries = |x: &DVector<f64>| x.iter().copied().enumerate().collect::<Vec<_>>();
        let tangent = |i: usize| {
            let (row, direction) = (entries(&rows[i]), [0.0, 1.0, 0.0]);
            let (coefficient, surface) = (mu[i], surface[i]);
            let (anchor, only_slips) = (None, false);
            Some(Tangent { row, anchor, coefficient, surface, direction, only_slips })
        };
        let slider = |k: usize| Slider {
            row: entries(&rows[2 + k]),
            limit: of_sliders[k],
            elastic: None,
            node: k,
            position: [0.0; 3],
            direction: [1.0, 0.0, 0.0],
        };
        let mut all = DMatrix::zeros(N + 2, N + 2);
        all.view_mut((0, 0), (N, N)).copy_from(&mass);
        let facing = ContactRows::facing(&[N, N + 1]);
        let body = Body::from_matrices(&csr(&all), &csr(&whole), &facing, 1.0).unwrap();
        let operator = reaction(&body, vec![1.0; 2]);
        let rubs =
            Rubs { tangents: vec![tangent(0), tangent(1)], sliders: (0..3).map(slider).collect() };
        let gaps = Gaps::front(gap.iter().copied().collect());
        let choice = (Stress::Reaction, MassChoice::Condensed);
        let mut system = System::with_operator(body, operator, gaps, choice, rubs).unwrap();
        system.loads_mut().push(
            entries(&force).into_iter().map(|e| e.1).chain([0.0; 2]).collect(),
            None,
            0.0,
        );
        let force = force - whole.view((0, N), (N, 2)) * gap;
        let stiffness = whole.view((0, 0), (N, N)).clone_owned();
        let joint = Joint { mass, stiffness, force, rows, pressure, surface };
        (joint, system, u.iter().copied().collect())
    }

    impl Joint {
        fn limit(&self, i: usize, u: &DVector<f64>) -> f64 {
            -self.pressure[i].0.dot(u) - self.pressure[i].1
        }

        /// `a`, and the reactions `r` of points in these states: `M a = f − K u − Σ e r`, `e a = 0` of those that stick.
        fn motion(&self, u: &DVector<f64>, states: &[PointState]) -> (DVector<f64>, Vec<f64>) {
            let stuck: Vec<usize> =
                (0..POINTS).filter(|&i| states[i] == PointState::Stick).collect();
            let n = N + stuck.len();
            let (mut a, mut b) = (DMatrix::zeros(n, n), DVector::zeros(n));
            a.view_mut((0, 0), (N, N)).copy_from(&self.mass);
            let mut forces = &self.force - &self.stiffness * u;
            for i in 0..POINTS {
                if let Some(sigma) = states[i].slip() {
                    forces -= sigma * self.limit(i, u) * &self.rows[i];
                }
            }
            b.rows_mut(0, N).copy_from(&forces);
            for (k, &i) in stuck.iter().enumerate() {
                a.view_mut((0, N + k), (N, 1)).copy_from(&self.rows[i]);
                a.view_mut((N + k, 0), (1, N)).copy_from(&self.rows[i].transpose());
            }
            let x = a.lu().solve(&b).unwrap();
            let reaction = |i: usize| match states[i].slip() {
                Some(sigma) => sigma * self.limit(i, u),
                None => x[N + stuck.iter().position(|&k| k == i).unwrap()],
            };
            (x.rows(0, N).clone_owned(), (0..POINTS).map(reaction).collect())
        }

        /// Rates of the reactions of what sticks, while everything else is in these states: `M ȧ = −K v − Σ e ṙ`.
        fn rates(&self, u: &DVector<f64>, v: &DVector<f64>, states: &[PointState]) -> Vec<f64> {
            let along = |t: f64| self.motion(&(u + t * v), states).1;
            // reactions are linear in u
            along(1.0).into_iter().zip(along(0.0)).map(|(b, a)| b - a).collect()
        }

        /// All states that Coulomb's law allows, of points at rest that are listed.
        fn allowed(
            &self,
            u: &DVector<f64>,
            base: &[PointState],
            rest: &[usize],
        ) -> Vec<Vec<PointState>> {
            let choices = [PointState::Stick, PointState::SlipPlus, PointState::SlipMinus];
            let mut found = vec![];
            for code in 0..3usize.pow(rest.len() as u32) {
                let mut states = base.to_vec();
                let mut left = code;
                for &i in rest {
                    states[i] = choices[left % 3];
                    left /= 3;
                }
                let (a, r) = self.motion(u, &states);
                let holds = |&i: &usize| match states[i].slip() {
                    Some(sigma) => sigma * self.rows[i].dot(&a) > 0.0,
                    None => r[i].abs() < self.limit(i, u),
                };
                if rest.iter().all(holds) {
                    found.push(states);
                }
            }
            found
        }

        /// Velocities at which the listed points are at rest on their surfaces.
        fn at_rest(&self, v: &DVector<f64>, rest: &[usize]) -> DVector<f64> {
            let e = DMatrix::from_fn(rest.len(), N, |k, j| self.rows[rest[k]][j]);
            let off = DVector::from_fn(rest.len(), |k, _| {
                self.rows[rest[k]].dot(v) - self.surface[rest[k]]
            });
            let gram = &e * e.transpose();
            v - e.transpose() * gram.lu().solve(&off).unwrap()
        }

        fn slips(&self, v: &DVector<f64>) -> Vec<PointState> {
            let of = |i: usize| PointState::of_slip(self.rows[i].dot(v) - self.surface[i]);
            (0..POINTS).map(of).collect()
        }
    }

    fn states(of: &[PointState]) -> States {
        let mut set = States::closed(of.len());
        of.iter().enumerate().for_each(|(i, s)| set.set(i, *s));
        set
    }

    fn rubbed(
        system: &System,
        (u, v): (&[f64], &[f64]),
        present: &[PointState],
        trigger: Option<(usize, MonitorKind)>,
    ) -> Result<Vec<PointState>, ClassifyError> {
        let phase = system.phase(&states(present));
        let surface =
            Surface { system, phase: &phase, t: 0.0, u_o: u, v_o: v, resolution: RESOLUTION };
        let (set, held, grazing) = (states(present), vec![], vec![]);
        let order = Order::Displacement;
        let decision = Decision { set, held, order, grazing, ambiguous: None };
        let done = surface.rub(decision, trigger, &mut system.scratch())?;
        Ok(done.set.iter().collect())
    }

    const STUCK: [PointState; POINTS] = [PointState::Stick; POINTS];

    /// What moves slips by its velocity; of what rests, whatever it did before, the one combination that Coulomb's law allows is found, among all that there are.
    #[test]
    fn points_at_rest_stick_or_slip_as_the_law_says() {
        let mut met = [0; 3];
        for seed in 0..200 {
            let (joint, system, u) = joint(seed, None);
            let mut random = Numbers(900 + seed);
            let rest: Vec<usize> = (0..POINTS).filter(|_| random.next() > -0.4).collect();
            let v = joint.at_rest(&random.vector(N), &rest);
            let slips = joint.slips(&v);
            let at = DVector::from_column_slice(&u);
            let allowed = joint.allowed(&at, &slips, &rest);
            assert_eq!(allowed.len(), 1, "{seed}");
            // from whatever they did before; what moves has slipped
            let before: Vec<PointState> = (0..POINTS)
                .map(|i| match rest.contains(&i) && random.next() > 0.0 {
                    true => PointState::Stick,
                    false => slips[i],
                })
                .collect();
            let found = rubbed(&system, (&u, v.as_slice()), &before, None).unwrap();
            assert_eq!(found, allowed[0], "{seed}: at rest {rest:?}");
            for i in rest {
                met[found[i].slip().map_or(0, |s| if s > 0.0 { 1 } else { 2 })] += 1;
            }
        }
        assert!(met.iter().all(|n| *n > 50), "{met:?}");
    }

    /// Where a reaction is at its limit to the last digit, and no acceleration is left, its rate decides.
    #[test]
    fn at_the_limit_rates_decide() {
        let mut met = [0; 2];
        for seed in 0..120 {
            let (first, _, u) = joint(seed, None);
            let at = DVector::from_column_slice(&u);
            let mut random = Numbers(seed);
            let (_, r) = first.motion(&at, &STUCK);
            let tied = (seed % 5) as usize;
            // limits change the limits alone
            let limits: Vec<f64> =
                (0..POINTS).map(|i| r[i].abs() * if i == tied { 1.0 } else { 1.5 }).collect();
            let (joint, system, same) = joint(seed, Some(&limits));
            assert_eq!(u, same);
            let v = joint.at_rest(&random.vector(N), &[0, 1, 2, 3, 4]);
            let sigma = r[tied].signum();
            let rate = sigma * joint.rates(&at, &v, &STUCK)[tied] + joint.pressure[tied].0.dot(&v);
            let kind = match sigma > 0.0 {
                true => MonitorKind::StickPlus,
                false => MonitorKind::StickMinus,
            };
            let mut expected = STUCK;
            if rate > 0.0 {
                expected[tied] = PointState::of_slip(sigma);
            }
            for trigger in [None, Some((tied, kind))] {
                let found = rubbed(&system, (&u, v.as_slice()), &STUCK, trigger).unwrap();
                assert_eq!(found, expected, "{seed} {tied} {trigger:?}: {rate}");
            }
            met[usize::from(rate > 0.0)] += 1;
        }
        assert!(met.iter().all(|n| *n > 30), "{met:?}");
    }

    /// Where one point comes to rest, others do that would within what the instant is known to, and no others.
    #[test]
    fn instants_are_known_to_their_resolution() {
        for seed in 0..60 {
            let (joint, system, u) = joint(seed, None);
            let at = DVector::from_column_slice(&u);
            let mut random = Numbers(seed);
            let v = joint.at_rest(&random.vector(N), &[1]);
            let mut before = joint.slips(&v);
            before[..2].fill(PointState::SlipPlus);
            let (a, _) = joint.motion(&at, &before);
            // the other one is so many resolutions before its rest, or behind it
            for (instants, rests) in [(4.0, true), (12.0, false)] {
                let e = &joint.rows[0];
                let slip = instants * RESOLUTION * e.dot(&a).abs();
                let v = joint.at_rest(&v, &[0, 1]);
                let both = DMatrix::from_fn(2, N, |k, j| joint.rows[k][j]);
                let lift = both.transpose()
                    * (&both * both.transpose())
                        .lu()
                        .solve(&DVector::from_vec(vec![slip, 0.0]))
                        .unwrap();
                let v = v + lift;
                let trigger = Some((1, MonitorKind::Slip));
                let found = rubbed(&system, (&u, v.as_slice()), &before, trigger).unwrap();
                let rest = if rests { vec![0, 1] } else { vec![1] };
                let allowed = joint.allowed(&at, &joint.slips(&v), &rest);
                assert_eq!(vec![found], allowed, "{seed}: {instants}");
                // where nothing came to rest there is no such doubt
                let found = rubbed(&system, (&u, v.as_slice()), &before, None).unwrap();
                let allowed = joint.allowed(&at, &joint.slips(&v), &[1]);
                assert_eq!(vec![found], allowed, "{seed}: {instants}");
            }
        }
    }

    /// A mass on a spring and a slider whose own spring has the stiffness 2 and the limit 3, and where that holds it.
    fn jenkins() -> System {
        let stiffness = DMatrix::from_diagonal(&DVector::from_vec(vec![5.0, 0.0]));
        let mass = DMatrix::identity(2, 2);
        let rows = ContactRows::facing(&[]);
        let body = Body::from_matrices(&csr(&mass), &csr(&stiffness), &rows, 1.0).unwrap();
        let elastic = Some(Elastic { stiffness: 2.0, memory: 1, preload: 0.0 });
        let (position, direction) = ([0.0; 3], [1.0, 0.0, 0.0]);
        let slider =
            Slider { row: vec![(0, 1.0)], limit: 3.0, elastic, node: 0, position, direction };
        let rubs = Rubs { tangents: vec![], sliders: vec![slider] };
        let choice = (Stress::Reaction, MassChoice::Condensed);
        let operator = reaction(&body, vec![]);
        System::with_operator(body, operator, Gaps::front(vec![]), choice, rubs).unwrap()
    }

    /// Jenkins' element: it slides where its spring is at the limit and is drawn further.
    #[test]
    fn a_slider_with_a_spring_slides_at_its_limit() {
        use PointState::{SlipMinus, SlipPlus, Stick};
        let system = jenkins();
        let slow = STILL * system.units.frequency * 1.5;
        let said = |present: PointState, force: f64, v: f64, trigger: Option<MonitorKind>| {
            // the place that holds it stands at zero
            let (u, v) = ([0.5 * force, 0.0], [v, 0.0]);
            let trigger = trigger.map(|kind| (0, kind));
            rubbed(&system, (&u, &v), &[present], trigger).unwrap()[0]
        };
        for (sigma, slips) in [(1.0, SlipPlus), (-1.0, SlipMinus)] {
            // within its limit it sticks, whatever the velocity
            assert_eq!(said(Stick, sigma * 2.9, sigma, None), Stick);
            assert_eq!(said(Stick, sigma * 2.9, -sigma, None), Stick);
            // at it it slides where it is drawn on, and not where it is let back
            assert_eq!(said(Stick, sigma * 3.0, sigma, None), slips);
            assert_eq!(said(Stick, sigma * 3.0, -sigma, None), Stick);
            // what starts at its limit rests below a velocity that no motion has
            assert_eq!(said(Stick, sigma * 3.0, sigma * 0.5 * slow, None), Stick);
            assert_eq!(said(Stick, sigma * 3.0, sigma * 2.0 * slow, None), slips);
            // what was found at its limit, or slides, does not
            let found =
                Some(if sigma > 0.0 { MonitorKind::StickPlus } else { MonitorKind::StickMinus });
            assert_eq!(said(Stick, sigma * 3.0, sigma * 0.5 * slow, found), slips);
            assert_eq!(said(slips, sigma * 3.0, sigma * 0.5 * slow, None), slips);
            assert_eq!(said(slips, sigma * 3.0, -sigma * slow, None), Stick);
            // a limit is known to what a velocity makes of the resolution
            let v = sigma * 1e3;
            assert_eq!(said(Stick, sigma * (3.0 - 1e-8), v, None), slips);
            assert_eq!(said(Stick, sigma * (3.0 - 3e-8), v, None), Stick);
            // beyond it while it slides: where the velocity comes to zero the springs draw it back, and it sticks
            assert_eq!(said(slips, sigma * 4.0, 0.0, Some(MonitorKind::Slip)), Stick);
        }
        // drawn by its own spring alone, a load that goes on, the velocity but touches zero
        let mut driven = jenkins();
        driven.loads_mut().push(vec![20.0, 0.0], None, 0.0);
        let (u, v) = ([2.0, 0.0], [0.0, 0.0]);
        let trigger = Some((0, MonitorKind::Slip));
        assert_eq!(rubbed(&driven, (&u, &v), &[SlipPlus], trigger).unwrap(), [SlipPlus]);
    }

    /// What sticks moves with its surface to the last digit; springs that stick are within their limits, and what they remember has no velocity.
    #[test]
    fn what_sticks_is_set_to_its_surface() {
        let (joint, system, _) = joint(3, None);
        let mut v: Vec<f64> = Numbers(5).vector(N).as_slice().to_vec();
        let before = v.clone();
        let set = states(&[
            PointState::Stick,
            PointState::SlipPlus,
            PointState::SlipPlus,
            PointState::SlipPlus,
            PointState::SlipPlus,
        ]);
        settle(&system, &set, &mut v);
        let slip = joint.rows[0].dot(&DVector::from_column_slice(&v)) - joint.surface[0];
        assert!(slip.abs() < 1e-15, "{slip}");
        assert_eq!(v.iter().zip(&before).filter(|(a, b)| a != b).count(), 1);

        let system = jenkins();
        let (mut u, mut v) = (vec![2.0, 0.25], vec![1.0, 1.0]);
        settle(&system, &states(&[PointState::Stick]), &mut v);
        assert_eq!(v, [1.0, 0.0]);
        // 2 (2 − 1/4) = 3.5 is beyond 3: z is set where it is at it; while it slides nothing is
        remember(&system, &states(&[PointState::SlipPlus]), &mut u);
        assert_eq!(u, [2.0, 0.25]);
        remember(&system, &states(&[PointState::Stick]), &mut u);
        assert_eq!(u, [2.0, 0.5]);
    }
}
