//! `/trajectory` and `/energy`: the tables of the stored states.

use super::events::codes;
use super::kept::Kept;
use super::table::{Form, Place, Table};
use super::{StoreError, write_text};
use crate::contact::States;
use crate::event::{Energies, Sample};

/// Aim of a chunk's size in bytes.
const CHUNK_BYTES: usize = 256 * 1024;

/// Columns of `/energy`.
const ENERGY: [&str; 6] = ["t", "kinetic", "elastic", "external", "dissipated", "jumps"];

/// A stored state as a file keeps it.
pub(super) struct Row {
    t: f64,
    u: Vec<f64>,
    v: Vec<f64>,
    active: States,
    pressure: Vec<f64>,
    energies: Option<Energies>,
    jumps: f64,
}

impl Row {
    pub fn of(kept: &Kept, s: &Sample) -> Row {
        Row {
            t: s.t,
            u: kept.row(s.u),
            v: kept.row(s.v),
            active: s.active.clone(),
            pressure: s.pressure.to_vec(),
            energies: s.energies,
            jumps: s.jumps,
        }
    }
}

impl Row {
    /// Whether what is stored in single precision fits in.
    pub(crate) fn is_single(&self) -> bool {
        let mut all = self.u.iter().chain(&self.v).chain(&self.pressure);
        all.all(|x| x.abs() <= f64::from(f32::MAX))
    }
}

/// The open tables of the stored states.
pub(super) struct Trajectory {
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
        kept: &Kept,
        (n_c, compressed): (usize, bool),
    ) -> Result<Self, StoreError> {
        let n = kept.len();
        let chunk = (CHUNK_BYTES / (8 * n.max(1))).clamp(1, 1024);
        let g = file.create_group("trajectory")?;
        if let Some(columns) = kept.columns() {
            g.new_dataset_builder().with_data(&columns).create("columns")?;
            let meaning = "which columns of all displacements (mesh/dof_map) u and v hold";
            let columns = g.dataset("columns")?;
            write_text(&columns, "meaning", meaning)?;
            let all = kept.all_columns() as i64;
            columns.new_attr::<i64>().create("of")?.write_scalar(&all)?;
        }
        let form = |columns: Option<usize>| Form {
            columns,
            chunk,
            compressed: compressed && columns.is_some(),
            single: kept.single && columns.is_some(),
        };
        let column =
            |name: &str, columns, units: &str| Table::<f64>::create(&g, name, form(columns), units);
        let t = column("t", None, "time")?;
        let u = column("u", Some(n), "length")?;
        let v = column("v", Some(n), "length/time")?;
        let pressure = column("pressure", Some(n_c), "stress")?;
        let active =
            Table::create(&g, "active", Form { single: false, ..form(Some(n_c)) }, "1 = contact")?;
        let g = file.create_group("energy")?;
        let units = |name: &str| if name == "t" { "time" } else { "energy" };
        let energy: Result<Vec<_>, _> =
            ENERGY.iter().map(|name| Table::create(&g, name, form(None), units(name))).collect();
        Ok(Trajectory { t, u, v, pressure, active, energy: energy? })
    }

    /// Go on with the tables of a file.
    pub(crate) fn reopen(file: &hdf5::File, states: Place) -> Result<Self, StoreError> {
        let g = file.group("trajectory")?;
        let column = |name: &str| Table::<f64>::reopen(&g, name, states);
        let (t, u, v, pressure) = (column("t")?, column("u")?, column("v")?, column("pressure")?);
        let active = Table::reopen(&g, "active", states)?;
        let g = file.group("energy")?;
        let energy: Result<Vec<_>, _> =
            ENERGY.iter().map(|name| Table::reopen(&g, name, states)).collect();
        Ok(Trajectory { t, u, v, pressure, active, energy: energy? })
    }

    pub fn push(&mut self, s: &Row) {
        self.t.push(&[s.t]);
        self.u.push(&s.u);
        self.v.push(&s.v);
        self.active.push(&codes(&s.active));
        self.pressure.push(&s.pressure);
        let [kinetic, elastic, external, dissipated] = Energies::numbers(s.energies);
        let row = [s.t, kinetic, elastic, external, dissipated, s.jumps];
        self.energy.iter_mut().zip(row).for_each(|(table, x)| table.push(&[x]));
    }

    /// Whether a chunk is complete.
    pub(crate) fn is_full(&self) -> bool {
        self.u.is_full()
    }

    /// Bytes of all rows that wait.
    pub(crate) fn waiting_bytes(&self) -> u64 {
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
