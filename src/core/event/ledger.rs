//! The energy ledger (theory §5).
//!
//! `H = ½ (A*u̇_O)ᵀM(A*u̇_O) + ½ uᵀKu`. Inside a phase `H` changes by the work of the loads less what damping dissipates; at a switch it
//! jumps by `½ u̇_Oᵀ(M_α⁺ − M_α⁻)u̇_O`, which belongs to the method. What the ledger does not explain is integration error:
//!
//! ```text
//! defect(t) = H(t) − H(0) − Σ jumps − external work − belt work + dissipated energy + friction work
//! ```

/// Energies of one state.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Energies {
    /// `½ vᵀMv`
    pub kinetic: f64,
    /// `½ uᵀKu`
    pub elastic: f64,
    /// Work of all loads since the start.
    pub external: f64,
    /// Energy dissipated since the start.
    pub dissipated: f64,
    /// What friction took since the start.
    pub friction: f64,
    /// Work of the surfaces of obstacles that move along themselves.
    pub belt: f64,
}

impl Energies {
    /// `H`
    pub fn total(&self) -> f64 {
        self.kinetic + self.elastic
    }

    /// As columns of a file: no numbers where they are not known.
    pub fn numbers(of: Option<Energies>) -> [f64; 6] {
        let numbers =
            |e: Energies| [e.kinetic, e.elastic, e.external, e.dissipated, e.friction, e.belt];
        of.map_or([f64::NAN; 6], numbers)
    }

    /// What came from outside less what was taken.
    pub fn booked(&self) -> f64 {
        self.external + self.belt - self.dissipated - self.friction
    }
}

/// Running balance.
#[derive(Debug, Clone, Default)]
pub struct Ledger {
    start: f64,
    end: f64,
    scale: f64,
    jumps: f64,
    held_exchange: f64,
    phase_defect: f64,
    worst_in_phase: f64,
    worst: f64,
}

/// Of energies below this share of the terms that they are sums of rounding is no small part.
const LEAST: f64 = 1e-6;

impl Ledger {
    /// Open the ledger.
    pub fn new(energies: Energies) -> Self {
        let total = energies.total();
        Ledger { start: total, end: total, scale: total.abs(), ..Ledger::default() }
    }

    /// Judge its rest by no less than rounding of terms of this size leaves behind.
    pub(crate) fn among(self, size: f64) -> Ledger {
        self.above(LEAST * size)
    }

    /// Judge its rest by no less than an energy that is none.
    pub(crate) fn above(mut self, least: f64) -> Ledger {
        self.scale = self.scale.max(least);
        self
    }

    /// All that it knows, to be kept.
    pub fn numbers(&self) -> [f64; 8] {
        [
            self.start,
            self.end,
            self.scale,
            self.jumps,
            self.held_exchange,
            self.phase_defect,
            self.worst_in_phase,
            self.worst,
        ]
    }

    /// The ledger that had these numbers.
    pub(crate) fn of_numbers(x: [f64; 8]) -> Ledger {
        let [start, end, scale, jumps, held_exchange, phase_defect, worst_in_phase, worst] = x;
        Ledger { start, end, scale, jumps, held_exchange, phase_defect, worst_in_phase, worst }
    }

    fn defect(&self, e: &Energies) -> f64 {
        e.total() - self.start - self.jumps - self.held_exchange - e.booked()
    }

    /// Note a state inside a phase.
    pub fn note(&mut self, e: &Energies) {
        self.end = e.total();
        // what flows through the ledger is the size against which its rest is judged
        let flows = [e.total(), e.external, e.dissipated, e.friction, e.belt];
        self.scale = flows.iter().fold(self.scale, |m, x| m.max(x.abs()));
        let defect = self.defect(e);
        self.worst = self.worst.max(defect.abs());
        self.worst_in_phase = self.worst_in_phase.max((defect - self.phase_defect).abs());
    }

    /// A switch: the jump, then the first state of the new phase, where its energies are known.
    pub fn switch(&mut self, jump: f64, after: Option<&Energies>) {
        self.jumps += jump;
        let Some(after) = after else { return };
        self.phase_defect = self.defect(after);
        self.end = after.total();
        self.scale = self.scale.max(after.total().abs());
    }

    /// A phase with held nodes exchanges energy with the surface: book it apart.
    pub(crate) fn held_phase(&mut self, e: &Energies) {
        self.held_exchange += self.defect(e) - self.phase_defect;
        self.end = e.total();
    }

    /// `H` at the start.
    pub fn start(&self) -> f64 {
        self.start
    }

    /// `H` now.
    pub fn end(&self) -> f64 {
        self.end
    }

    /// Sum of the jumps at switches.
    pub fn jumps(&self) -> f64 {
        self.jumps
    }

    fn relative(&self, x: f64) -> f64 {
        if self.scale > 0.0 { x / self.scale } else { 0.0 }
    }

    /// Largest relative drift inside any one phase.
    pub(crate) fn drift_in_phase(&self) -> f64 {
        self.relative(self.worst_in_phase)
    }

    /// Largest relative defect since the start: drifts of all phases added up.
    pub(crate) fn drift_total(&self) -> f64 {
        self.relative(self.worst)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(kinetic: f64) -> Energies {
        Energies { kinetic, ..Energies::default() }
    }

    #[test]
    fn jumps_are_not_drift() {
        let mut ledger = Ledger::new(state(1.0));
        ledger.note(&state(1.0 + 1e-10));
        ledger.switch(-0.2, Some(&state(0.8 + 1e-10)));
        ledger.note(&state(0.8 + 1.5e-10));
        assert!((ledger.drift_total() - 1.5e-10).abs() < 1e-15);
        assert!((ledger.drift_in_phase() - 1e-10).abs() < 1e-15);
        assert_eq!(ledger.jumps(), -0.2);
    }

    /// A body at rest has energies that are rounding errors of forces that cancel: they do not drift.
    #[test]
    fn what_is_no_energy_does_not_drift() {
        let mut ledger = Ledger::new(state(0.0)).above(1e-24);
        ledger.note(&state(1e-33));
        assert!(ledger.drift_in_phase() < 2e-9);
        let mut ledger = Ledger::new(state(0.0)).among(1.0);
        ledger.note(&state(1e-9));
        assert_eq!(ledger.drift_total(), 1e-9 / LEAST);
    }

    #[test]
    fn work_and_dissipation_balance() {
        let mut ledger = Ledger::new(state(0.0));
        let e =
            Energies { kinetic: 2.0, elastic: 1.0, external: 4.0, dissipated: 1.0, ..state(0.0) };
        ledger.note(&e);
        assert_eq!(ledger.drift_total(), 0.0);
    }
}
