//! `/trajectory` and `/energy`: the tables of the stored states.

use std::sync::Arc;

use super::StoreError;
use super::events::flags;
use super::table::Table;
use crate::event::Sample;
use crate::fem::Body;

/// Aim of a chunk's size in bytes.
const CHUNK_BYTES: usize = 256 * 1024;

/// Columns of `/energy`.
const ENERGY: [&str; 6] = ["t", "kinetic", "elastic", "external", "dissipated", "jumps"];

/// The open tables of the stored states.
pub(super) struct Trajectory {
    body: Arc<Body>,
    t: Table<f64>,
    u: Table<f64>,
    v: Table<f64>,
    pressure: Table<f64>,
    active: Table<u8>,
    energy: Vec<Table<f64>>,
}

impl Trajectory {
    /// Create both groups, for `n_c` contact nodes, the states compressed or not.
    pub fn create(
        file: &hdf5::File,
        body: &Arc<Body>,
        (n_c, compressed): (usize, bool),
    ) -> Result<Self, StoreError> {
        let n = body.nodal_dofs().n_columns();
        let chunk = (CHUNK_BYTES / (8 * n.max(1))).clamp(1, 1024);
        let g = file.create_group("trajectory")?;
        let column = |name: &str, columns, units: &str| {
            Table::<f64>::create(&g, name, columns, chunk, compressed && columns.is_some(), units)
        };
        let t = column("t", None, "time")?;
        let u = column("u", Some(n), "length")?;
        let v = column("v", Some(n), "length/time")?;
        let pressure = column("pressure", Some(n_c), "stress")?;
        let active = Table::create(&g, "active", Some(n_c), chunk, compressed, "1 = contact")?;
        let g = file.create_group("energy")?;
        let units = |name: &str| if name == "t" { "time" } else { "energy" };
        let energy: Result<Vec<_>, _> = ENERGY
            .iter()
            .map(|name| Table::create(&g, name, None, chunk, false, units(name)))
            .collect();
        Ok(Trajectory { body: body.clone(), t, u, v, pressure, active, energy: energy? })
    }

    /// Go on behind so many states.
    pub fn reopen(file: &hdf5::File, body: &Arc<Body>, states: usize) -> Result<Self, StoreError> {
        let g = file.group("trajectory")?;
        let column = |name: &str| Table::<f64>::reopen(&g, name, states);
        let (t, u, v, pressure) = (column("t")?, column("u")?, column("v")?, column("pressure")?);
        let active = Table::reopen(&g, "active", states)?;
        let g = file.group("energy")?;
        let energy: Result<Vec<_>, _> =
            ENERGY.iter().map(|name| Table::reopen(&g, name, states)).collect();
        Ok(Trajectory { body: body.clone(), t, u, v, pressure, active, energy: energy? })
    }

    pub fn push(&mut self, s: &Sample) {
        self.t.push(&[s.t]);
        let of_mesh = |x| self.body.nodal_dofs().along_axes(&self.body.nodal(x));
        let (u, v) = (of_mesh(s.u), of_mesh(s.v));
        self.u.push(&u);
        self.v.push(&v);
        self.active.push(&flags(s.active));
        self.pressure.push(s.pressure);
        let e = &s.energies;
        let row = [s.t, e.kinetic, e.elastic, e.external, e.dissipated, s.jumps];
        self.energy.iter_mut().zip(row).for_each(|(table, x)| table.push(&[x]));
    }

    /// Whether a chunk is complete.
    pub fn is_full(&self) -> bool {
        self.u.is_full()
    }

    /// Bytes of all rows that wait.
    pub fn waiting_bytes(&self) -> u64 {
        let numbers = [&self.t, &self.u, &self.v, &self.pressure];
        let numbers = numbers.into_iter().chain(&self.energy).map(Table::waiting_bytes);
        numbers.chain([self.active.waiting_bytes()]).sum()
    }

    /// Append all rows that wait.
    pub fn append(&mut self) -> Result<(), StoreError> {
        for table in [&mut self.t, &mut self.u, &mut self.v, &mut self.pressure] {
            table.append()?;
        }
        self.active.append()?;
        self.energy.iter_mut().try_for_each(|t| t.append())
    }
}
