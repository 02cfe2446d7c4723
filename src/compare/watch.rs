//! What an engineer reads off a motion: the largest forces, impulses, displacement, energy, and what probes see.

use crate::contact::{Resultants, System};
use crate::continuation::Go;
use crate::event::{Observer, Sample};

/// A number that is read off: its kind, its name, its value.
pub(super) type Reading = (&'static str, String, f64);

/// Sees a motion go by.
pub(super) struct Watch<'a> {
    system: &'a System,
    resultants: Resultants,
    /// What of the last state is still needed: its time and forces.
    before: Option<(f64, [Vec<f64>; 2])>,
    forces: Vec<f64>,
    impulses: Vec<f64>,
    /// Of supports, and their impulses.
    supports: [Vec<f64>; 2],
    springs: Vec<f64>,
    displacement: f64,
    energy: f64,
    probes: Vec<Vec<f64>>,
    go: &'a mut dyn FnMut(f64) -> Go,
}

fn size(x: &[f64]) -> f64 {
    x.iter().fold(0.0f64, |m, x| m.hypot(*x))
}

impl<'a> Watch<'a> {
    /// Of a body, before its motion; `go` hears the time.
    pub fn new(system: &'a System, go: &'a mut dyn FnMut(f64) -> Go) -> Watch<'a> {
        let resultants = Resultants::new(system);
        let (groups, dim) = (resultants.names.len(), resultants.dim);
        let quantities =
            system.probes.iter().flat_map(|p| p.quantities.iter().map(move |q| (p, q)));
        Watch {
            system,
            before: None,
            forces: vec![0.0; groups],
            impulses: vec![0.0; groups * dim],
            supports: {
                let count = system.bearings.supports.len();
                [vec![0.0; count], vec![0.0; count * system.bearings.dim.max(1)]]
            },
            springs: vec![0.0; system.bearings.springs.len()],
            displacement: 0.0,
            energy: 0.0,
            probes: quantities.map(|(p, q)| vec![0.0; p.components(*q).len()]).collect(),
            resultants,
            go,
        }
    }

    /// What was seen.
    pub fn figures(self) -> Vec<Reading> {
        let mut all = vec![];
        let dim = self.resultants.dim.max(1);
        let impulses = self.impulses.chunks_exact(dim).map(size);
        for ((group, force), impulse) in self.resultants.names.iter().zip(self.forces).zip(impulses)
        {
            all.push(("force", format!("contact \"{group}\""), force));
            all.push(("impulse", format!("contact \"{group}\""), impulse));
        }
        let [forces, impulses] = self.supports;
        let impulses = impulses.chunks_exact(self.system.bearings.dim.max(1)).map(size);
        for ((group, force), impulse) in
            self.system.bearings.supports.iter().zip(forces).zip(impulses)
        {
            all.push(("force", format!("support \"{group}\""), force));
            all.push(("impulse", format!("support \"{group}\""), impulse));
        }
        for (name, force) in self.system.bearings.springs.iter().zip(self.springs) {
            all.push(("force", format!("spring \"{name}\""), force));
        }
        if self.system.n_contact() > 0 {
            all.push(("displacement", "at the contact".into(), self.displacement));
        }
        all.push(("energy", "largest".into(), self.energy));
        let mut seen = self.probes.into_iter();
        for probe in self.system.probes.iter() {
            for quantity in &probe.quantities {
                let values = seen.next().unwrap_or_default();
                for (component, value) in probe.components(*quantity).iter().zip(values) {
                    let name = format!("\"{}\" {} {component}", probe.name, quantity.name());
                    all.push(("probe", name, value));
                }
            }
        }
        all.retain(|(_, _, value)| value.is_finite());
        all
    }
}

impl Observer for Watch<'_> {
    type Error = std::convert::Infallible;

    fn sample(&mut self, s: &Sample) -> Result<(), Self::Error> {
        let dim = self.resultants.dim.max(1);
        let [force, _] = self.resultants.of(s.pressure, s.traction, s.u);
        for (most, own) in self.forces.iter_mut().zip(force.chunks_exact(dim)) {
            *most = most.max(size(own));
        }
        let loads = (self.system.loads.as_ref(), s.t);
        let [u, v, a] = s.at_rest(loads.0);
        let borne = self.system.bearings.of(&self.system.body, loads, [&u, &v, &a]);
        // what nobody knows stays unknown
        let largest =
            |most: &mut f64, own: f64| *most = if own.is_nan() { own } else { most.max(own) };
        let sizes = borne.supports.chunks_exact(dim).map(size);
        self.supports[0].iter_mut().zip(sizes).for_each(|(most, own)| largest(most, own));
        let pulls = self.springs.iter_mut().zip(&borne.springs);
        pulls.for_each(|(most, own)| largest(most, own.abs()));
        let now = [force, borne.supports];
        if let Some((t, before)) = &self.before {
            let half = 0.5 * (s.t - t);
            let sums = [&mut self.impulses, &mut self.supports[1]];
            for ((sum, before), now) in sums.into_iter().zip(before).zip(&now) {
                let both = sum.iter_mut().zip(before.iter().zip(now));
                both.for_each(|(sum, (a, b))| *sum += half * (a + b));
            }
        }
        self.before = Some((s.t, now));
        let normal = self.system.along_normals(&u);
        self.displacement = normal.iter().fold(self.displacement, |m, u| m.max(u.abs()));
        if let Some(e) = s.energies {
            self.energy = self.energy.max(e.total());
        }
        let mut place = 0;
        for probe in self.system.probes.iter() {
            for quantity in &probe.quantities {
                let values = probe.of(*quantity, [&u, &v, &a], (&loads.0.carried, s.t));
                let most = self.probes[place].iter_mut().zip(values);
                most.for_each(|(m, x)| *m = if x.is_nan() { x } else { m.max(x.abs()) });
                place += 1;
            }
        }
        Ok(())
    }

    fn takes_accelerations(&self) -> bool {
        true
    }

    fn progress(&mut self, t: f64) -> Result<Go, Self::Error> {
        Ok((self.go)(t))
    }
}
