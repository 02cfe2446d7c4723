//! The largest and the least of some numbers over a motion: at its states, on both sides of its switches, and at the tops of the parabolas through three states in a row.

use crate::contact::{States, System};
use crate::event::{Sample, Watch};
use crate::records::{ExtremesRecord, crest};

/// Extremes so far.
#[derive(Debug, Clone, Default)]
pub(crate) struct Extremes {
    /// Largest of each; not numbers before the first state.
    pub largest: Vec<f64>,
    /// Least of each.
    pub least: Vec<f64>,
    /// The last two states of the piece.
    last: Vec<(f64, Vec<f64>)>,
    /// The first two of all, before anything was cut.
    first: Vec<(f64, Vec<f64>)>,
    is_cut: bool,
}

impl Extremes {
    /// A state.
    pub fn note(&mut self, t: f64, now: Vec<f64>) {
        self.largest.resize(now.len(), f64::NAN);
        self.least.resize(now.len(), f64::NAN);
        for (i, &x) in now.iter().enumerate() {
            self.largest[i] = self.largest[i].max(x);
            self.least[i] = self.least[i].min(x);
            if let [(t0, a), (t1, b)] = &self.last[..]
                && t0 < t1
                && *t1 < t
            {
                let times = [*t0, *t1, t];
                self.largest[i] = self.largest[i].max(crest(times, [a[i], b[i], x]));
                self.least[i] = self.least[i].min(-crest(times, [-a[i], -b[i], -x]));
            }
        }
        if self.last.len() == 2 {
            self.last.remove(0);
        }
        if self.first.len() < 2 && !self.is_cut {
            self.first.push((t, now.clone()));
        }
        self.last.push((t, now));
    }

    /// The motion goes on as it began, its last state is its first: a top may lie there.
    pub fn close(&mut self, period: f64) {
        if let [_, (t, second)] = &self.first[..] {
            self.note(t + period, second.clone());
        }
    }

    /// What comes is another piece: numbers may jump.
    pub fn cut(&mut self) {
        self.last.clear();
        self.is_cut = true;
    }
}

/// Extremes of what is watched of a body.
#[derive(Debug)]
pub(crate) struct Watching<'s> {
    system: &'s System,
    watch: Watch,
    extremes: Extremes,
    /// A switch that has been told: its time, and the states before it.
    switched: Option<(f64, States)>,
}

impl<'s> Watching<'s> {
    pub fn new(system: &'s System) -> Watching<'s> {
        let watch = Watch::new(system);
        Watching { system, watch, extremes: Extremes::default(), switched: None }
    }

    /// Whether there is nothing to watch.
    pub fn is_idle(&self) -> bool {
        self.watch.all().is_empty()
    }

    /// Whether it needs accelerations.
    pub fn takes_accelerations(&self) -> bool {
        self.watch.takes_accelerations()
    }

    /// Numbers may jump from here.
    pub fn cut(&mut self) {
        self.extremes.cut();
    }

    /// The motion goes on as it began.
    pub fn close(&mut self, period: f64) {
        self.extremes.close(period);
    }

    /// A state; behind a switch it is looked at from both sides.
    pub fn note(&mut self, s: &Sample) {
        if let Some((t, before)) = self.switched.take() {
            if t == s.t {
                self.note_before(s, &before);
            }
            self.extremes.cut();
        }
        self.extremes.note(s.t, self.watch.at(s));
    }

    /// A switch: velocities and forces may jump.
    pub fn switch(&mut self, t: f64, before: &States) {
        match &self.switched {
            // of several at once the first knows what was before
            Some((told, _)) if *told == t => {}
            _ => self.switched = Some((t, before.clone())),
        }
    }

    /// A state at a switch as it is before it: `u_O` and `u̇_O` are continuous, all else follows from the phase. Not where velocities jump, or memories are set.
    fn note_before(&mut self, s: &Sample, before: &States) {
        let system = self.system;
        if system.impact().is_some() || system.n_remembered() > 0 {
            return;
        }
        let phase = system.phase(before);
        let n_o = system.n_o();
        let (u_o, v_o) = (&s.u[..n_o], &s.v[..n_o]);
        let [mut u, mut v] = [0; 2].map(|_| vec![0.0; system.n()]);
        phase.expand_displacement(s.t, u_o, &mut u);
        phase.expand_velocity(s.t, v_o, &mut v);
        let mut a = vec![];
        if !s.a.is_empty() {
            a.resize(system.n(), 0.0);
            phase.acceleration(s.t, u_o, v_o, &mut system.scratch(), &mut a[..n_o]);
            phase.complete_acceleration(s.t, &mut a);
        }
        let mut pressure = vec![0.0; system.n_contact()];
        phase.pressures(s.t, u_o, &mut pressure);
        let mut traction = vec![0.0; s.traction.len()];
        if !traction.is_empty() {
            phase.tractions(s.t, (u_o, v_o), &mut traction);
        }
        let own = Sample {
            u: &u,
            v: &v,
            a: &a,
            active: before,
            pressure: &pressure,
            traction: &traction,
            ..*s
        };
        self.extremes.note(s.t, self.watch.at(&own));
    }

    /// What has been seen.
    pub fn seen(self) -> ExtremesRecord {
        let Extremes { largest, least, .. } = self.extremes;
        ExtremesRecord { largest, least }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a parabola through three values of a sine misses at its top: `|f'''| ≤ 3h/2` there, `|(x − x_0)(x − x_1)(x − x_2)| ≤ 3h³/8`, over 6.
    fn missed(step: f64) -> f64 {
        1.5 * 0.375 / 6.0 * step.powi(4)
    }

    /// A sine at 40 places of its period, and some more: the tops lie between them.
    #[test]
    fn tops_between_states_are_those_of_parabolas() {
        let mut all = Extremes::default();
        let step = std::f64::consts::TAU / 40.0;
        for k in 0..=44 {
            let t = step * (f64::from(k) + 0.3);
            all.note(t, vec![t.sin(), 3.0, -2.0 - t.cos()]);
        }
        let error = missed(step);
        for (found, wanted) in [(0, [1.0, -1.0]), (1, [3.0, 3.0]), (2, [-1.0, -3.0])]
            .map(|(i, wanted)| ([all.largest[i], all.least[i]], wanted))
        {
            for (x, y) in found.iter().zip(wanted) {
                assert!((x - y).abs() < error, "{x} {y}");
            }
        }
    }

    /// A top at the end of a period that is the beginning of the next.
    #[test]
    fn a_period_goes_on_as_it_began() {
        let step = std::f64::consts::TAU / 40.0;
        let mut all = Extremes::default();
        let at = |k: u32| (step * (f64::from(k) + 0.4)).cos();
        (0..=40).for_each(|k| all.note(step * f64::from(k), vec![at(k)]));
        assert!(1.0 - all.largest[0] > 1e-4, "{:?}", all.largest);
        all.close(std::f64::consts::TAU);
        assert!((1.0 - all.largest[0]).abs() < missed(step), "{:?}", all.largest);
    }

    /// Over a jump no parabola is laid, and what nobody knows hides nothing.
    #[test]
    fn jumps_have_no_tops() {
        let mut all = Extremes::default();
        for (t, x) in [(0.0, f64::NAN), (1.0, 1.0), (2.0, 2.0)] {
            all.note(t, vec![x]);
        }
        all.cut();
        for (t, x) in [(2.0, -1.0), (3.0, -1.5)] {
            all.note(t, vec![x]);
        }
        assert_eq!((all.largest, all.least), (vec![2.0], vec![-1.5]));
    }
}
