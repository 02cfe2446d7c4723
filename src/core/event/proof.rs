//! What is proved of the search for switches (theory §12): every count that ends the certificate, and why.

/// What a run did that its certificate forbids.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Proof {
    /// Phases whose search rests on an interpolant of the flow (theory §12, H1), or whose monitors are not known well enough (theory §12, H4).
    pub uncertified: usize,
    /// How far the monitors of a phase may have been at its end from those of the equations that start in the same state, over their sizes: what the errors of
    /// modes and truncated sums add up to, estimated (theory §12, H4).
    pub state_error: f64,
    /// Monitors that began a phase, or were left by a touch, further below zero than rounding explains: the search for their next
    /// switch is the blinder for it (theory §12, H3).
    pub loosened: usize,
    /// Tangencies that stayed undecided at the time resolution, and were taken for no switch; recorded among the grazings (theory §12, H5).
    pub undecided: usize,
    /// Switches that the search missed and only the complementarity problem showed: none, or a defect (theory §12, H6).
    pub missed: usize,
    /// The largest penetration or tension of the method's own conditions, over the size of what it is a rounding error of (theory §12, H6).
    pub violation: f64,
}

/// A phase whose monitors are not known to this fraction of their sizes is not certified. The estimate is a product of norms, larger than the errors: 1e-5 for a
/// slender beam, whose energy drifts by 2e-10.
const KNOWN: f64 = 1e-4;
/// Violations of the contact conditions up to here, relative, are rounding errors.
const VIOLATION: f64 = 1e-9;

/// The larger of two; what is not a number stays.
fn largest_or_nan(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

impl Proof {
    /// Of a scheme that has no proof in so many phases.
    pub fn none(phases: usize) -> Proof {
        Proof { uncertified: phases, ..Proof::default() }
    }

    /// Every switch so far was found by proof.
    pub fn holds(&self) -> bool {
        let Proof { uncertified, undecided, loosened, missed, violation, state_error: _ } = *self;
        uncertified + undecided + loosened + missed == 0 && violation <= VIOLATION
    }

    /// A phase begins, in closed form or by interpolants.
    pub(super) fn begin_phase(&mut self, is_exact: bool) {
        self.uncertified += usize::from(!is_exact);
    }

    /// A phase in closed form ends, its monitors as far off as this, over their sizes.
    pub(super) fn end_phase(&mut self, deviations: impl Iterator<Item = f64>) {
        let largest = deviations.fold(0.0, largest_or_nan);
        self.uncertified += usize::from(largest.is_nan() || largest > KNOWN);
        self.state_error = largest_or_nan(self.state_error, largest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_count_ends_the_certificate() {
        let holds = |change: fn(&mut Proof)| {
            let mut proof = Proof { violation: 1e-10, ..Proof::default() };
            change(&mut proof);
            proof.holds()
        };
        assert!(holds(|_| ()) && holds(|p| p.begin_phase(true)));
        assert!(holds(|p| p.end_phase([1e-5, 9e-5].into_iter())));
        for change in [
            (|p| p.begin_phase(false)) as fn(&mut Proof),
            |p| p.end_phase([1e-5, 2e-4].into_iter()),
            |p| p.end_phase([1e-5, f64::NAN, 1e-6].into_iter()),
            |p| p.undecided = 1,
            |p| p.loosened = 1,
            |p| p.missed = 1,
            |p| p.violation = 2e-9,
            |p| p.violation = f64::NAN,
        ] {
            assert!(!holds(change));
        }
        assert_eq!(Proof::none(3).uncertified, 3);
    }
}
