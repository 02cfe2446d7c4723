//! The table of a cross-check as CSV.

use std::fmt::Write as _;

use crate::records::CheckRow;
use crate::report::export::number;

/// A row a point of harmonic balance; what a point without an orbit does not have is empty.
pub fn csv(rows: &[CheckRow]) -> String {
    let mut out = String::from(
        "omega,harmonics,hbm_energy,residual,return_error,verdict,moved,orbit_energy,contact_change,same_sequence\n",
    );
    let finite = |v: f64| if v.is_finite() { number(v) } else { String::new() };
    for r in rows {
        let [energy, residual, back] = [r.energy, r.residual, r.return_error].map(finite);
        let _ =
            write!(out, "{},{},{energy},{residual},{back},{}", number(r.omega), r.n_h, r.verdict);
        let _ = match r.has_orbit() {
            true => {
                let [moved, energy, change] =
                    [r.moved, r.orbit_energy, r.contact_change].map(finite);
                writeln!(out, ",{moved},{energy},{change},{}", u8::from(r.same_sequence))
            }
            false => writeln!(out, ",,,,"),
        };
    }
    out
}
