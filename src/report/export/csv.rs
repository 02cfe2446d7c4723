//! CSV: energies and contact, one row a stored state; switches in a second file.

use std::fmt::Write as _;
use std::io;
use std::path::PathBuf;

use super::{number, put};
use crate::store::Stored;

/// The states `rows` and the switches `switches`, into the two files.
pub(super) fn write(
    stored: &Stored,
    rows: &[usize],
    switches: &[usize],
    files: &[PathBuf],
) -> io::Result<()> {
    let texts = [states(stored, rows), events(stored, switches)];
    files.iter().zip(texts).try_for_each(|(path, text)| put(path, text.as_bytes()))
}

fn states(stored: &Stored, rows: &[usize]) -> String {
    let mut out = String::from("t,kinetic,elastic,external,dissipated,jumps");
    for node in &stored.contact_nodes {
        let _ = write!(out, ",u_n[{node}],pressure[{node}],active[{node}]");
    }
    out.push('\n');
    for &row in rows {
        out.push_str(&number(stored.t[row]));
        for column in &stored.energy {
            // not known where the run followed the surroundings of the contact alone
            let known = Some(column[row]).filter(|e| !e.is_nan()).map(number);
            let _ = write!(out, ",{}", known.unwrap_or_default());
        }
        for i in 0..stored.gap.len() {
            let (u, p) = (stored.contact_displacement(row, i), stored.pressure[(row, i)]);
            let _ = write!(out, ",{},{},{}", number(u), number(p), stored.active[(row, i)]);
        }
        out.push('\n');
    }
    out
}

fn events(stored: &Stored, switches: &[usize]) -> String {
    let mut out = String::from("t,node,kind,energy_jump\n");
    for &k in switches {
        let (t, jump) = (number(stored.switch_t[k]), number(stored.switch_jump[k]));
        let _ = writeln!(out, "{t},{},{},{jump}", stored.switch_node[k], stored.switch_kind[k]);
    }
    out
}
