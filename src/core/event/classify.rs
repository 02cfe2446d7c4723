//! Which active set is next (theory §5).
//!
//! At a switch the indices with `w_i = p_i = 0` are degenerate. First the complementarity problem one order up,
//! `0 ≤ ẇ ⟂ ṗ ≥ 0` with `ṗ = S ẇ + q̇` (S the Schur complement of `N_C` on the degenerate indices, again a P-matrix). Where that
//! too is degenerate (grazing), the accelerations decide, and these differ from one set to the next: a set is admissible
//! if in *its own* phase the second derivatives of its monitors are ≥ 0. One admissible set is the rule; with several the
//! present one is kept and the event recorded; with none the node is held on the surface (Filippov).

use thiserror::Error;

use super::held::is_weight;
use crate::contact::lcp::UNITS;
use crate::contact::{
    ContactError, Degenerate, Phase, PointState, Scratch, Selection, States, System,
};
use crate::fem::largest;

/// How a switch was decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Order {
    /// By displacements alone.
    Displacement,
    /// By the velocities.
    Velocity,
    /// By the accelerations: grazing.
    Acceleration,
}

/// The next phase.
#[derive(Debug, Clone, PartialEq)]
pub struct Decision {
    /// Active set (held nodes count as in contact).
    pub set: States,
    /// Nodes held on the surface.
    pub held: Vec<usize>,
    /// What decided.
    pub order: Order,
    /// Nodes decided by accelerations.
    pub grazing: Vec<usize>,
    /// Whether more than one continuation was admissible; none where not all were tried.
    pub ambiguous: Option<bool>,
}

/// No rule applies.
#[derive(Debug, Error, Clone, PartialEq)]
pub enum ClassifyError {
    /// An operator failed.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// No admissible continuation was found among the sets that could be tried.
    #[error("no admissible continuation at t = {t:.12} for the contact nodes {nodes:?}")]
    Unresolved {
        /// Time.
        t: f64,
        /// Degenerate contact nodes (index in `u_C`).
        nodes: Vec<usize>,
    },
    /// A point that can but slip has come to rest on the surface.
    #[error("the contact node {node} comes to rest on the surface at t = {t:.12}")]
    Rests {
        /// Time.
        t: f64,
        /// Contact node (index in `u_C`).
        node: usize,
    },
}

/// A state on a switching surface.
pub struct Surface<'a> {
    /// Operators.
    pub system: &'a System,
    /// The phase that ends here.
    pub phase: &'a Phase,
    /// Time.
    pub t: f64,
    /// Displacements.
    pub u_o: &'a [f64],
    /// Velocities.
    pub v_o: &'a [f64],
    /// Time differences below this are rounding errors.
    pub resolution: f64,
}

/// Up to this many nodes all `2^k` sets are tried at the level of accelerations.
const ENUMERATION_LIMIT: usize = 10;

impl Surface<'_> {
    /// Decide the degenerate nodes; the others keep their place in `present`.
    pub fn decide(
        &self,
        present: &States,
        degenerate: &[usize],
        scratch: &mut Scratch,
    ) -> Result<Decision, ClassifyError> {
        let decision = |set, order| Decision {
            set,
            held: vec![],
            order,
            grazing: vec![],
            ambiguous: Some(false),
        };
        if degenerate.is_empty() {
            return Ok(decision(present.clone(), Order::Displacement));
        }
        let Selection { set, degenerate: undecided } =
            self.by_velocity(present, degenerate, scratch)?;
        if undecided.is_empty() {
            return Ok(decision(set, Order::Velocity));
        }
        // undecided nodes enter as they are in the present phase, but for what would hold them
        let mut base = set;
        undecided.iter().for_each(|&i| base.set(i, self.state_of(i, present.touches(i))));
        match self.system.is_lipschitz() {
            true => self.by_common_acceleration(&base, &undecided, scratch),
            false => self.by_acceleration(&base, &undecided, scratch),
        }
    }

    /// What a degenerate point does if it touches: without a pressure nothing holds it, and it slips by its velocity.
    pub(super) fn state_of(&self, point: usize, touches: bool) -> PointState {
        match (touches, self.system.tangent(point)) {
            (true, Some(t)) => PointState::of_slip(t.slip_velocity(self.v_o)),
            _ => PointState::of_contact(touches),
        }
    }

    pub(super) fn acceleration(&self, phase: &Phase, scratch: &mut Scratch) -> Vec<f64> {
        let mut a = vec![0.0; self.system.n_o()];
        phase.acceleration(self.t, self.u_o, self.v_o, scratch, &mut a);
        a
    }

    /// `0 ≤ ẇ ⟂ ṗ ≥ 0` on the degenerate nodes; returns the set and the nodes that stay degenerate.
    fn by_velocity(
        &self,
        present: &States,
        points: &[usize],
        scratch: &mut Scratch,
    ) -> Result<Selection, ClassifyError> {
        let a = match self.phase.set == *present && self.phase.held.is_empty() {
            true => self.acceleration(self.phase, scratch),
            false => self.acceleration(&self.system.phase(present), scratch),
        };
        let blur = largest(&a) * self.resolution / UNITS;
        let at = Degenerate { present, points, t: self.t, x: self.v_o, order: 1, blur };
        Ok(self.system.select_rates(at)?)
    }

    /// Where the acceleration is the same on both sides of the surface, it decides as the velocity did: `0 ≤ ẅ ⟂ p̈ ≥ 0`. What is degenerate even
    /// then stays as it is: every continuation is the same.
    fn by_common_acceleration(
        &self,
        base: &States,
        points: &[usize],
        scratch: &mut Scratch,
    ) -> Result<Decision, ClassifyError> {
        let a = self.acceleration(&self.system.phase(base), scratch);
        let at = Degenerate { present: base, points, t: self.t, x: &a, order: 2, blur: 0.0 };
        let Selection { mut set, degenerate } = self.system.select_rates(at)?;
        degenerate.iter().for_each(|&i| set.set(i, base.at(i)));
        let grazing = points.to_vec();
        let order = Order::Acceleration;
        Ok(Decision { set, held: vec![], order, grazing, ambiguous: Some(false) })
    }

    /// Second derivatives of the monitors of `nodes` in a phase, over their rounding error: that of accelerations in which forces of this size cancelled.
    pub(super) fn curvatures(
        &self,
        (phase, unhindered): (&Phase, f64),
        nodes: &[usize],
        scratch: &mut Scratch,
    ) -> Vec<f64> {
        let a = self.acceleration(phase, scratch);
        let largest = largest(&a).max(unhindered);
        let curvatures = phase.monitor_curvatures_at(self.t, &a);
        let rounding = phase.rate_rounding(largest);
        let of = |&i: &usize| {
            let k = phase.monitor_of(i).unwrap_or(0);
            curvatures[k] / (16.0 * rounding[k]).max(f64::MIN_POSITIVE)
        };
        nodes.iter().map(of).collect()
    }

    /// The largest acceleration in a phase now and a unit of time on: what obstacles and friction take of it, and what is about to begin, is known to rounding errors
    /// of this.
    pub(super) fn unhindered(&self, phase: &Phase, scratch: &mut Scratch) -> f64 {
        let later = Surface { t: self.t + 1.0 / self.system.units.frequency, ..*self };
        let both = [self, &later].map(|at| largest(&at.acceleration(phase, scratch)));
        both[0].max(both[1])
    }

    fn by_acceleration(
        &self,
        base: &States,
        nodes: &[usize],
        scratch: &mut Scratch,
    ) -> Result<Decision, ClassifyError> {
        let decision = |set: States, ambiguous| Decision {
            set,
            held: vec![],
            order: Order::Acceleration,
            grazing: nodes.to_vec(),
            ambiguous,
        };
        let unhindered = self.unhindered(&self.system.open_phase(), scratch);
        if nodes.len() > ENUMERATION_LIMIT {
            return self.by_iteration((base, unhindered), nodes, scratch);
        }
        let mut best: Option<(usize, States)> = None;
        let mut strict = 0;
        for bits in 0..1usize << nodes.len() {
            let mut set = base.clone();
            nodes
                .iter()
                .enumerate()
                .for_each(|(k, &i)| set.set(i, self.state_of(i, bits >> k & 1 == 1)));
            let curvature = self.curvatures((&self.system.phase(&set), unhindered), nodes, scratch);
            if curvature.iter().any(|&c| c < -1.0) {
                continue;
            }
            strict += usize::from(curvature.iter().all(|&c| c > 1.0));
            let changes = nodes.iter().filter(|&&i| set.at(i) != base.at(i)).count();
            if best.as_ref().is_none_or(|(least, _)| changes < *least) {
                best = Some((changes, set));
            }
        }
        match best {
            Some((_, set)) => Ok(decision(set, Some(strict > 1))),
            None => self.held((base, unhindered), nodes, scratch),
        }
    }

    /// Many nodes at once: change all inadmissible ones together, then one by one, until none is left. What changes again and again is attracted from both
    /// sides: it is held, and let go where its weight leaves `[0, 1]`. Whether there are other solutions is not asked.
    fn by_iteration(
        &self,
        (base, unhindered): (&States, f64),
        nodes: &[usize],
        scratch: &mut Scratch,
    ) -> Result<Decision, ClassifyError> {
        /// Rounds in which all change together.
        const TOGETHER: usize = 4;
        /// Changes one by one after which a node is held.
        const RESTLESS: usize = 2;
        let (mut set, mut held) = (base.clone(), vec![]);
        let mut changes = vec![0; self.system.n_contact()];
        for round in 0..8 * nodes.len() {
            let phase = self.system.held_phase(&set, &held);
            let free: Vec<usize> = nodes.iter().copied().filter(|i| !held.contains(i)).collect();
            let curvature = self.curvatures((&phase, unhindered), &free, scratch);
            let wrong: Vec<usize> =
                free.iter().zip(&curvature).filter(|(_, c)| **c < -1.0).map(|(&i, _)| i).collect();
            let Some(&first) = wrong.first() else {
                let theta = match held.is_empty() {
                    true => vec![],
                    false => phase.held_theta(self.t, self.u_o, self.v_o, scratch),
                };
                let Some(k) = theta.iter().position(|t| !is_weight(*t)) else {
                    let (order, grazing) = (Order::Acceleration, nodes.to_vec());
                    return Ok(Decision { set, held, order, grazing, ambiguous: None });
                };
                // one is free, zero in contact
                let released = held.remove(k);
                set.set(released, self.state_of(released, theta[k] < 0.5));
                changes[released] = 0;
                continue;
            };
            let change = if round < TOGETHER { &wrong[..] } else { &[first][..] };
            for &i in change {
                let to = phase.monitor_of(i).map_or(set.at(i), |k| phase.monitors[k].to);
                set.set(i, self.state_of(i, to.touches()));
                changes[i] += usize::from(round >= TOGETHER);
                if changes[i] > RESTLESS {
                    set.set(i, PointState::Closed);
                    held.push(i);
                }
            }
        }
        Err(ClassifyError::Unresolved { t: self.t, nodes: nodes.to_vec() })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::contact::{MassChoice, Stress};
    use crate::fem::{Csr, Material};
    use crate::model::Model;

    /// A plate, its matrices outright, and what rests on the switching surface with all of its points.
    struct Plate {
        system: System,
        mass: DMatrix<f64>,
        stiffness: DMatrix<f64>,
        n_o: DMatrix<f64>,
        n_c: DMatrix<f64>,
        gap: DVector<f64>,
    }

    fn dense(a: &Csr) -> DMatrix<f64> {
        let mut d = DMatrix::zeros(a.n_rows(), a.n_cols());
        a.triplets().for_each(|(i, j, x)| d[(i, j)] += x);
        d
    }

    fn plate(elements: [usize; 2], choice: (Stress, MassChoice)) -> Plate {
        plate_at(1.0, elements, choice)
    }

    fn plate_at(gap: f64, elements: [usize; 2], choice: (Stress, MassChoice)) -> Plate {
        let material = Material::plate(1.0, 0.3, 1.0, 1.0);
        let model = Model::plate([1.0, 0.4], elements, material).hold("left", &[0, 1]);
        let model = model.obstacle("right", gap).discretise(choice.0, choice.1);
        let system = model.build().unwrap();
        let c = system.conditions();
        Plate {
            mass: dense(system.mass()),
            stiffness: dense(&system.body.stiffness),
            n_o: dense(&c.n_o),
            n_c: c.n_c.dense(),
            gap: DVector::from_column_slice(&c.gap),
            system,
        }
    }

    const OWN: (Stress, MassChoice) = (Stress::Projection, MassChoice::Paper);
    const COMMON: (Stress, MassChoice) = (Stress::Reaction, MassChoice::Condensed);

    fn random(n: usize, seed: usize) -> DVector<f64> {
        let of = |i: usize| {
            let x = (12.9898 * (seed * 131 + i + 1) as f64).sin() * 43758.5453;
            2.0 * (x - x.floor()) - 1.0
        };
        DVector::from_fn(n, |i, _| of(i))
    }

    impl Plate {
        fn points(&self) -> usize {
            self.gap.len()
        }

        /// Of `x` what has `N_O x + c = 0`.
        fn onto(&self, x: DVector<f64>, c: &DVector<f64>) -> DVector<f64> {
            let gram = (&self.n_o * self.n_o.transpose()).try_inverse().unwrap();
            let off = |x: &DVector<f64>| &gram * (&self.n_o * x + c);
            let x = &x - self.n_o.transpose() * off(&x);
            &x - self.n_o.transpose() * off(&x)
        }

        /// `w = p = 0`, `ẇ = ṗ = 0` of all points.
        fn grazing(&self, seed: usize) -> [DVector<f64>; 2] {
            let n = self.n_o.ncols();
            let still = DVector::zeros(self.points());
            let u = self.onto(random(n, 2 * seed), &(&self.n_c * &self.gap));
            [u, self.onto(random(n, 2 * seed + 1), &still)]
        }

        /// `A* x` where these points touch: `x_C` of the others from `p = 0`.
        fn whole(&self, touches: &[bool], x: &DVector<f64>) -> DVector<f64> {
            let open: Vec<usize> = (0..self.points()).filter(|&i| !touches[i]).collect();
            let n = x.len();
            let mut all = x.clone().resize_vertically(n + self.points(), 0.0);
            if open.is_empty() {
                return all;
            }
            let block = self.n_c.select_rows(&open).select_columns(&open);
            let right = -self.n_o.select_rows(&open) * x;
            let x_c = block.lu().solve(&right).unwrap();
            open.iter().enumerate().for_each(|(k, &i)| all[n + i] = x_c[k]);
            all
        }

        /// `A*ᵀMA* a = −A*ᵀ K u` where `u_C` are the gaps, whatever touches.
        fn acceleration(&self, touches: &[bool], u: &DVector<f64>) -> DVector<f64> {
            let n = u.len();
            let columns: Vec<DVector<f64>> = (0..n)
                .map(|j| {
                    self.whole(touches, &DVector::from_fn(n, |i, _| f64::from(u8::from(i == j))))
                })
                .collect();
            let a_star = DMatrix::from_columns(&columns);
            let mut all = u.clone().resize_vertically(n + self.points(), 0.0);
            all.rows_mut(n, self.points()).copy_from(&self.gap);
            let force = -a_star.transpose() * (&self.stiffness * all);
            (a_star.transpose() * &self.mass * a_star).lu().solve(&force).unwrap()
        }

        /// Of rates `x`, `ẍ` or `ẋ`: how each monitor changes, `−(x_C)_i` of an open point, `−(N x)_i` of one that touches.
        fn change(&self, touches: &[bool], x: &DVector<f64>) -> Vec<f64> {
            let all = self.whole(touches, x);
            let x_c = all.rows(x.len(), self.points()).clone_owned();
            let pressure = -(&self.n_o * x + &self.n_c * &x_c);
            (0..self.points()).map(|i| if touches[i] { pressure[i] } else { -x_c[i] }).collect()
        }

        /// The sets whose own phase leads into them.
        fn admissible(&self, u: &DVector<f64>) -> Vec<Vec<bool>> {
            let leads = |set: &Vec<bool>| {
                self.change(set, &self.acceleration(set, u)).iter().all(|c| *c > 0.0)
            };
            sets(self.points()).filter(leads).collect()
        }

        fn decide(
            &self,
            present: &[bool],
            [u, v]: [&DVector<f64>; 2],
        ) -> Result<Decision, ClassifyError> {
            let present = States::of_contact(present.iter().copied());
            let phase = self.system.phase(&present);
            let (system, phase) = (&self.system, &phase);
            let (u_o, v_o) = (u.as_slice(), v.as_slice());
            let surface = Surface { system, phase, t: 0.0, u_o, v_o, resolution: 1e-14 };
            let all: Vec<usize> = (0..self.points()).collect();
            surface.decide(&present, &all, &mut system.scratch())
        }
    }

    fn touching(set: &States) -> Vec<bool> {
        set.iter().map(|s| s.touches()).collect()
    }

    fn sets(points: usize) -> impl Iterator<Item = Vec<bool>> {
        (0..1usize << points).map(move |bits| (0..points).map(|i| bits >> i & 1 == 1).collect())
    }

    /// Velocities decide where they can: `0 ≤ ẇ ⟂ ṗ ≥ 0` has one solution, found among all sets; it does not depend on the present one.
    #[test]
    fn velocities_decide_as_all_sets_tried() {
        for choice in [OWN, COMMON] {
            let plate = plate([3, 2], choice);
            for seed in 0..40 {
                let [u, _] = plate.grazing(seed);
                let v = random(u.len(), 900 + seed);
                let leads = |set: &Vec<bool>| plate.change(set, &v).iter().all(|c| *c > 0.0);
                let allowed: Vec<_> = sets(plate.points()).filter(leads).collect();
                assert_eq!(allowed.len(), 1);
                for present in sets(plate.points()) {
                    let found = plate.decide(&present, [&u, &v]).unwrap();
                    assert_eq!(touching(&found.set), allowed[0], "{seed}");
                    assert_eq!((found.order, found.ambiguous), (Order::Velocity, Some(false)));
                    assert!(found.held.is_empty() && found.grazing.is_empty());
                }
            }
        }
    }

    /// Where they cannot, accelerations do: of the sets whose own phase leads into them the one that changes least; several are told; where there is none, as few
    /// points as possible are held.
    #[test]
    fn accelerations_decide_as_all_sets_tried() {
        let plate = plate([3, 2], OWN);
        let mut met = [0; 3];
        for seed in 0..600 {
            let [u, v] = plate.grazing(seed);
            let allowed = plate.admissible(&u);
            met[allowed.len().min(2)] += 1;
            let present: Vec<bool> = random(3, 5000 + seed).iter().map(|x| *x > 0.0).collect();
            let Ok(found) = plate.decide(&present, [&u, &v]) else {
                assert!(allowed.is_empty(), "{seed}");
                continue;
            };
            assert_eq!((found.order, &found.grazing[..]), (Order::Acceleration, &[0, 1, 2][..]));
            let set = touching(&found.set);
            if allowed.is_empty() {
                assert!(!found.held.is_empty(), "{seed}");
                continue;
            }
            let changes = |set: &[bool]| set.iter().zip(&present).filter(|(a, b)| a != b).count();
            let least = allowed.iter().map(|s| changes(s)).min().unwrap();
            assert!(
                allowed.contains(&set) && changes(&set) == least,
                "{seed}: {set:?} {allowed:?}"
            );
            assert_eq!(found.ambiguous, Some(allowed.len() > 1), "{seed}");
            assert!(found.held.is_empty());
        }
        // states with two continuations are rare
        assert!(met[0] > 100 && met[1] > 300 && met[2] > 0, "{met:?}");
    }

    /// With one acceleration for all sets there is one solution, and it is found.
    #[test]
    fn a_common_acceleration_decides_alone() {
        let plate = plate([3, 3], COMMON);
        let (mut open, mut touch) = (0, 0);
        for seed in 0..100 {
            let [u, v] = plate.grazing(seed);
            let allowed = plate.admissible(&u);
            assert_eq!(allowed.len(), 1);
            let present: Vec<bool> = random(4, 5000 + seed).iter().map(|x| *x > 0.0).collect();
            let found = plate.decide(&present, [&u, &v]).unwrap();
            let set = touching(&found.set);
            assert_eq!((&set, found.ambiguous), (&allowed[0], Some(false)));
            assert_eq!((found.order, found.grazing.len()), (Order::Acceleration, 4));
            touch += set.iter().filter(|t| **t).count();
            open += set.iter().filter(|t| !**t).count();
        }
        assert!(open > 50 && touch > 50, "{open} {touch}");
    }

    /// At rest without a force there is nothing to decide: what was, stays.
    #[test]
    fn what_nothing_decides_stays() {
        for choice in [OWN, COMMON] {
            let plate = plate_at(0.0, [3, 2], choice);
            let still = DVector::zeros(plate.n_o.ncols());
            for present in sets(plate.points()) {
                let found = plate.decide(&present, [&still, &still]).unwrap();
                assert_eq!(touching(&found.set), present);
                assert_eq!((found.order, found.held.len()), (Order::Acceleration, 0));
            }
        }
    }

    /// Neither side can be entered: one point is held by the convex combination of its two accelerations that leaves it where it is, if both of its sides are
    /// entered from, and what the others do is admissible in it; two or three only where no single one can be.
    #[test]
    fn what_neither_side_lets_in_is_held_by_a_combination() {
        let plate = plate([3, 2], OWN);
        let (mut one, mut more, mut ended) = (0, 0, 0);
        for seed in 0..600 {
            let [u, v] = plate.grazing(seed);
            if !plate.admissible(&u).is_empty() {
                continue;
            }
            let mut single = vec![];
            for i in 0..3 {
                for others in sets(3).filter(|s| s[i]) {
                    let mut free = others.clone();
                    free[i] = false;
                    let both = [&free, &others].map(|s| plate.acceleration(s, &u));
                    // p̈_i of both, where the point stays at its gap
                    let [f, c] = [0, 1].map(|k| plate.change(&others, &both[k])[i]);
                    let theta = c / (c - f);
                    let a = theta * &both[0] + (1.0 - theta) * &both[1];
                    let change = plate.change(&others, &a);
                    let admissible = (0..3).filter(|&k| k != i).all(|k| change[k] >= 0.0);
                    if (0.0..=1.0).contains(&theta) && admissible {
                        single.push((i, others));
                    }
                }
            }
            let Ok(found) = plate.decide(&[false; 3], [&u, &v]) else {
                assert!(single.is_empty(), "{seed}: {single:?}");
                ended += 1;
                continue;
            };
            assert!(!found.held.is_empty() && found.ambiguous == Some(false));
            let set = touching(&found.set);
            match &found.held[..] {
                &[i] => {
                    one += 1;
                    assert!(single.contains(&(i, set)), "{seed}: {i} of {single:?}");
                }
                _ => {
                    more += 1;
                    assert!(single.is_empty(), "{seed}: {:?}, {single:?}", found.held);
                }
            }
        }
        assert!(one > 100 && more > 1 && ended < 5, "{one} {more} {ended}");
    }

    /// More points than sets can be tried for: what comes out leads into itself.
    #[test]
    fn many_points_come_to_a_set_that_leads_into_itself() {
        let plate = plate([2, 11], OWN);
        assert!(plate.points() > ENUMERATION_LIMIT);
        let (mut decided, mut held, mut ended) = (0, 0, 0);
        for seed in 0..120 {
            let [u, v] = plate.grazing(seed);
            let present: Vec<bool> = random(12, 5000 + seed).iter().map(|x| *x > 0.0).collect();
            let Ok(found) = plate.decide(&present, [&u, &v]) else {
                ended += 1;
                continue;
            };
            assert_eq!((found.order, found.ambiguous), (Order::Acceleration, None));
            if !found.held.is_empty() {
                held += 1;
                continue;
            }
            decided += 1;
            let set = touching(&found.set);
            let change = plate.change(&set, &plate.acceleration(&set, &u));
            assert!(change.iter().all(|c| *c > -1e-10), "{seed}: {change:?}");
        }
        assert!(decided > 2 && held > 5, "{decided} {held} {ended}");
    }
}
