//! The table of a family as CSV.

use std::fmt::Write as _;

use crate::records::ExtremesRecord;
use crate::report::export::{number, quoted};
use crate::store::StoredFamily;

/// A row a point of a family; a point without an orbit has empty cells, but for what a sweep saw there.
pub fn csv(family: &StoredFamily) -> String {
    let mut out = String::from(
        "omega,energy,amplitude,residual,contact_time,grazing_distance,switches,stable,branch,special",
    );
    for watched in &family.watched {
        for end in ["largest", "least"] {
            out += &format!(",{}", quoted(&format!("{end}_{}", watched.label)));
        }
    }
    out.push('\n');
    for p in &family.points {
        out.push_str(&number(p.omega));
        match &p.orbit {
            Some(o) => {
                for x in [o.energy, o.amplitude, o.residual, o.contact_time, o.grazing] {
                    let _ = write!(out, ",{}", number(x));
                }
                let stable = o.stable.map_or(-1, i32::from);
                let _ = write!(out, ",{},{stable}", o.switches.len());
            }
            None if p.attractor.is_some() => {
                let (energy, amplitude) = (number(p.energy()), number(p.amplitude()));
                let _ = write!(out, ",{energy},{amplitude},,,,{},-1", number(p.switches()));
            }
            None => out.push_str(",,,,,,,"),
        }
        let _ = write!(out, ",{},{}", p.branch, quoted(&p.special.to_string()));
        for i in 0..family.watched.len() {
            let ends: [fn(&ExtremesRecord) -> &[f64]; 2] = [|e| &e.largest, |e| &e.least];
            for end in ends {
                let known = p.extremes().and_then(|e| end(e).get(i)).filter(|x| !x.is_nan());
                let _ = write!(out, ",{}", known.map(|x| number(*x)).unwrap_or_default());
            }
        }
        out.push('\n');
    }
    out
}
