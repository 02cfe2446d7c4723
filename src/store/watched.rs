//! `/probes`: motion and stress at places, groups and nodes over time, a group a probe.

use ndarray::Array2;

use super::StoreError;
use super::careful::Careful;
use super::kept::Kept;
use super::table::{Form, Resume, Table};
use super::write_text;
use crate::event::Sample;
use crate::fem::{Probe, Quantity};

/// A quantity of a probe at stored states.
#[derive(Debug, Clone)]
pub struct StoredProbe {
    /// The probe.
    pub name: String,
    /// What it watches.
    pub quantity: Quantity,
    /// Its components.
    pub components: Vec<String>,
    /// A row a state.
    pub values: Array2<f64>,
}

/// Unit and meaning of a quantity.
fn about(quantity: Quantity) -> [&'static str; 2] {
    match quantity {
        Quantity::Displacement => ["length", "displacement along the axes"],
        Quantity::Velocity => ["length/time", "velocity along the axes"],
        Quantity::Acceleration => [
            "length/time²",
            "acceleration along the axes; not a number where the scheme knows none",
        ],
        Quantity::Stress => ["stress", "stress, positive in tension"],
        Quantity::RecoveredStress => [
            "stress",
            "stress, positive in tension, by polynomial preserving recovery (Zhang and Naga)",
        ],
    }
}

/// The values of all probes at a state, in the order of the tables.
pub(super) fn values(kept: &Kept, s: &Sample) -> Vec<Vec<f64>> {
    if kept.watch.probes.is_empty() {
        return vec![];
    }
    let [u, v, a] = s.at_rest(&kept.watch.loads);
    let moving = (&kept.watch.loads.carried, s.t);
    let of_quantity = |p: &Probe, q: &Quantity| p.of(*q, [&u, &v, &a], moving);
    let of = |p: &Probe| p.quantities.iter().map(|q| of_quantity(p, q)).collect::<Vec<_>>();
    kept.watch.probes.iter().flat_map(of).collect()
}

/// The open tables.
pub(super) struct Watched(Vec<Table<f64>>);

impl Watched {
    /// Create all groups.
    pub fn create(file: &hdf5::File, kept: &Kept, chunk: usize) -> Result<Self, StoreError> {
        let mut tables = vec![];
        if kept.watch.probes.is_empty() {
            return Ok(Watched(tables));
        }
        let all = file.create_group("probes")?;
        for probe in kept.watch.probes.iter() {
            let group = all.create_group(&probe.name)?;
            for quantity in &probe.quantities {
                let components = probe.components(*quantity);
                let table = Table::create(
                    &group,
                    quantity.name(),
                    Form::plain(Some(components.len()), chunk),
                )?;
                let dataset = group.dataset(quantity.name())?;
                let [units, what] = about(*quantity);
                write_text(&dataset, "units", units)?;
                write_text(&dataset, "description", what)?;
                write_text(&dataset, "components", &components.join(" "))?;
                tables.push(table);
            }
        }
        Ok(Watched(tables))
    }

    /// Go on with the tables of a file.
    pub fn reopen(file: &hdf5::File, kept: &Kept, place: Resume) -> Result<Self, StoreError> {
        let mut tables = vec![];
        for probe in kept.watch.probes.iter() {
            let group = file.group(&format!("probes/{}", probe.name))?;
            for quantity in &probe.quantities {
                tables.push(Table::reopen(&group, quantity.name(), place)?);
            }
        }
        Ok(Watched(tables))
    }

    pub fn push(&mut self, values: &[Vec<f64>]) {
        self.0.iter_mut().zip(values).for_each(|(table, row)| table.push(row));
    }

    pub fn waiting_bytes(&self) -> u64 {
        self.0.iter().map(Table::waiting_bytes).sum()
    }

    pub fn append(&mut self) -> Result<(), StoreError> {
        self.0.iter_mut().try_for_each(Table::append)
    }
}

/// All that a file has of probes.
pub(super) fn read(file: &hdf5::File) -> Result<Vec<StoredProbe>, StoreError> {
    let mut all = vec![];
    let Ok(group) = file.group("probes") else { return Ok(all) };
    for name in group.member_names()? {
        let own = group.group(&name)?;
        for quantity in Quantity::ALL.into_iter().filter(|q| own.link_exists(q.name())) {
            let dataset = own.dataset(quantity.name())?;
            let components = super::read_text(&dataset, "components").unwrap_or_default();
            let components = components.split_whitespace().map(str::to_owned).collect();
            let values = dataset.table()?;
            all.push(StoredProbe { name: name.clone(), quantity, components, values });
        }
    }
    Ok(all)
}

impl StoredProbe {
    /// Whether it has so many states, and names for its components.
    pub(super) fn fits(&self, rows: usize) -> bool {
        self.values.dim() == (rows, self.components.len())
    }

    /// Its components that are more than rounding, as far as they are known.
    pub fn components_that_act(&self) -> Vec<usize> {
        columns_that_act(&self.values)
    }
}

/// Columns whose largest entry is more than rounding beside that of all; what nobody knows counts for nothing.
pub(super) fn columns_that_act(values: &Array2<f64>) -> Vec<usize> {
    let largest = |values: &mut dyn Iterator<Item = &f64>| {
        values.filter(|x| x.is_finite()).fold(0.0f64, |m, x| m.max(x.abs()))
    };
    let floor = ROUNDING * largest(&mut values.iter());
    let acts = |c: &usize| largest(&mut values.column(*c).iter()) > floor;
    (0..values.ncols()).filter(acts).collect()
}

/// Columns below this part of the largest are rounding.
const ROUNDING: f64 = 1e-9;
