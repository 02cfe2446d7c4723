//! Orbits in HDF5: `/orbit`, and the full record of a point of a family.

use std::path::Path;

use hdf5::types::FixedAscii;
use hdf5::{Group, Location};
use ndarray::Array2;

use super::careful::{Careful, open, reading};
use super::events::read_states;
use super::report::fresh_group;
use super::schema::ascii;
use super::{StoreError, Writer, read_text, write_text};
use crate::contact::{States, System};
use crate::event::SwitchKind;
use crate::records::{ExtremesRecord, FrictionRecord, OrbitRecord, PlaceRecord, ViscousRecord};

/// The name of a kind.
type Word = FixedAscii<128>;

pub(super) fn scalar(g: &Location, name: &str, value: f64) -> Result<(), StoreError> {
    g.new_attr::<f64>().create(name)?.write_scalar(&value)?;
    Ok(())
}

pub(super) fn read_scalar(g: &Location, name: &str) -> Result<f64, StoreError> {
    Ok(g.attr(name)?.read_scalar()?)
}

pub(super) fn matrix<T: Clone>(
    rows: usize,
    columns: usize,
    values: Vec<T>,
) -> Result<Array2<T>, StoreError> {
    Ok(Array2::from_shape_vec((rows, columns), values)
        .map_err(|e| hdf5::Error::from(e.to_string()))?)
}

const NUMBERS: [&str; 9] = [
    "period",
    "energy",
    "amplitude",
    "residual",
    "contact_time",
    "grazing_distance",
    "penetration",
    "tension",
    "energy_balance",
];

pub(super) fn write_orbit(g: &Group, o: &OrbitRecord, system: &System) -> Result<(), StoreError> {
    let dofs = system.body.nodal_dofs();
    let numbers = [
        o.period,
        o.energy,
        o.amplitude,
        o.residual,
        o.contact_time,
        o.grazing,
        o.penetration,
        o.tension,
        o.balance,
    ];
    NUMBERS.iter().zip(numbers).try_for_each(|(name, x)| scalar(g, name, x))?;
    scalar(g, "trivial_multipliers", o.trivial as f64)?;
    if o.periods > 1 {
        scalar(g, "forcing_periods", o.periods as f64)?;
    }
    let stable = o.stable.map_or("not computed", |s| if s { "yes" } else { "no" });
    write_text(g, "stable", stable)?;
    g.new_dataset_builder().with_data(&dofs.along_axes(&o.u0)).create("u0")?;
    g.new_dataset_builder().with_data(&dofs.along_axes(&o.v0)).create("v0")?;
    let flat: Vec<f64> = o.multipliers.iter().flatten().copied().collect();
    let multipliers = matrix(o.multipliers.len(), 2, flat)?;
    g.new_dataset_builder().with_data(&multipliers).create("multipliers")?;
    o.multipliers_within.map_or(Ok(()), |error| scalar(g, WITHIN, error))?;
    if o.no_orbit_near {
        scalar(g, NONE_NEAR, 1.0)?;
    }
    let s = g.create_group("switches")?;
    let column = |f: &dyn Fn(&(f64, usize, SwitchKind)) -> f64| {
        o.switches.iter().map(f).collect::<Vec<f64>>()
    };
    s.new_dataset_builder().with_data(&column(&|s| s.0)).create("t")?;
    let nodes: Vec<i64> = o.switches.iter().map(|s| s.1 as i64).collect();
    s.new_dataset_builder().with_data(&nodes).create("node")?;
    let kinds: Vec<Word> = o.switches.iter().map(|s| ascii(s.2.name())).collect();
    s.new_dataset_builder().with_data(&kinds).create("kind")?;
    s.new_dataset_builder().with_data(&o.jumps).create("energy_jump")?;
    o.viscous.as_ref().map_or(Ok(()), |v| write_viscous(g, v))?;
    o.friction.as_ref().map_or(Ok(()), |f| write_friction(g, f))
}

const WITHIN: &str = "multipliers_within";
const NONE_NEAR: &str = "no_orbit_near";
const OF_FRICTION: [&str; 2] = ["friction_work", "belt_work"];
const FAMILY_DIMENSION: &str = "family_dimension";
const DRIFT: &str = "drift";

fn write_friction(g: &Group, f: &FrictionRecord) -> Result<(), StoreError> {
    OF_FRICTION.iter().zip([f.work, f.belt]).try_for_each(|(name, x)| scalar(g, name, x))?;
    f.family.map_or(Ok(()), |k| scalar(g, FAMILY_DIMENSION, k as f64))?;
    f.drift.map_or(Ok(()), |d| scalar(g, DRIFT, d))
}

fn read_friction(g: &Group) -> Result<Option<FrictionRecord>, StoreError> {
    if g.attr(OF_FRICTION[0]).is_err() {
        return Ok(None);
    }
    let [work, belt] = [read_scalar(g, OF_FRICTION[0])?, read_scalar(g, OF_FRICTION[1])?];
    let family = read_scalar(g, FAMILY_DIMENSION).ok().map(|k| k as usize);
    let drift = read_scalar(g, DRIFT).ok();
    Ok(Some(FrictionRecord { work, belt, family, drift }))
}

const OF_VISCOUS: [&str; 3] = ["alpha", "beta", "energy_turned_over"];

fn write_viscous(g: &Group, v: &ViscousRecord) -> Result<(), StoreError> {
    let numbers = [v.alpha, v.beta, v.turned_over];
    OF_VISCOUS.iter().zip(numbers).try_for_each(|(name, x)| scalar(g, name, x))?;
    let flat: Vec<f64> = v.under_load.iter().flatten().copied().collect();
    let multipliers = matrix(v.under_load.len(), 2, flat)?;
    g.new_dataset_builder().with_data(&multipliers).create("multipliers_under_load")?;
    Ok(())
}

fn read_viscous(g: &Group) -> Result<Option<ViscousRecord>, StoreError> {
    if g.attr(OF_VISCOUS[0]).is_err() {
        return Ok(None);
    }
    let [mut alpha, mut beta, mut turned_over] = [0.0; 3];
    for (x, name) in [&mut alpha, &mut beta, &mut turned_over].into_iter().zip(OF_VISCOUS) {
        *x = read_scalar(g, name)?;
    }
    let under_load = read_pairs(g, "multipliers_under_load")?;
    Ok(Some(ViscousRecord { alpha, beta, turned_over, under_load }))
}

fn read_pairs(g: &Group, name: &str) -> Result<Vec<[f64; 2]>, StoreError> {
    let table: Array2<f64> = g.dataset(name)?.table()?;
    if table.ncols() != 2 {
        return Err(hdf5::Error::from(format!("{name} are no pairs")).into());
    }
    Ok(table.rows().into_iter().map(|r| [r[0], r[1]]).collect())
}

pub(super) fn read_orbit(g: &Group) -> Result<OrbitRecord, StoreError> {
    let mut n = [0.0; 9];
    for (x, name) in n.iter_mut().zip(NUMBERS) {
        *x = read_scalar(g, name)?;
    }
    let s = g.group("switches")?;
    let t: Vec<f64> = s.dataset("t")?.values()?;
    let node: Vec<i64> = s.dataset("node")?.values()?;
    let kind: Vec<Word> = s.dataset("kind")?.values()?;
    let switches = t.iter().zip(&node).zip(&kind);
    Ok(OrbitRecord {
        period: n[0],
        periods: read_scalar(g, "forcing_periods").map_or(1, |k| k as usize),
        energy: n[1],
        amplitude: n[2],
        residual: n[3],
        contact_time: n[4],
        grazing: n[5],
        penetration: n[6],
        tension: n[7],
        balance: n[8],
        u0: g.dataset("u0")?.values()?,
        v0: g.dataset("v0")?.values()?,
        multipliers: read_pairs(g, "multipliers")?,
        no_orbit_near: g.attr(NONE_NEAR).is_ok(),
        multipliers_within: read_scalar(g, WITHIN).ok(),
        trivial: read_scalar(g, "trivial_multipliers")? as usize,
        stable: match read_text(g, "stable").as_deref() {
            Some("yes") => Some(true),
            Some("no") => Some(false),
            _ => None,
        },
        switches: switches
            .map(|((&t, &n), k)| (t, n as usize, SwitchKind::of_name(k.as_str())))
            .collect(),
        jumps: s.dataset("energy_jump")?.values()?,
        viscous: read_viscous(g)?,
        friction: read_friction(g)?,
        extremes: ExtremesRecord::default(),
    })
}

pub(super) fn write_place(g: &Group, place: &PlaceRecord) -> Result<(), StoreError> {
    let c = g.create_group("continuation")?;
    scalar(&c, "step", place.step)?;
    scalar(&c, "orientation", place.orientation)?;
    c.new_dataset_builder().with_data(&place.x).create("x")?;
    c.new_dataset_builder().with_data(&place.tangent).create("tangent")?;
    c.new_dataset_builder().with_data(&place.signature).create("signature")?;
    let n_c = place.sets.first().map_or(0, States::len);
    let codes = place.sets.iter().flat_map(States::codes).collect();
    let sets = matrix(place.sets.len(), n_c, codes)?;
    c.new_dataset_builder().with_data(&sets).create("active")?;
    let points: Vec<i64> = place.points.iter().map(|&p| p as i64).collect();
    c.new_dataset_builder().with_data(&points).create("node")?;
    if !place.base.is_empty() {
        c.new_dataset_builder().with_data(&place.base).create("base")?;
    }
    if !place.memory.is_empty() {
        c.new_dataset_builder().with_data(&place.memory).create("memory")?;
    }
    Ok(())
}

pub(super) fn read_place(g: &Group) -> Result<Option<PlaceRecord>, StoreError> {
    let Ok(c) = g.group("continuation") else { return Ok(None) };
    let points: Vec<i64> = c.dataset("node")?.values()?;
    let optional = |name: &str| c.dataset(name).and_then(|d| d.values()).unwrap_or_default();
    Ok(Some(PlaceRecord {
        x: c.dataset("x")?.values()?,
        tangent: c.dataset("tangent")?.values()?,
        step: read_scalar(&c, "step")?,
        orientation: read_scalar(&c, "orientation")?,
        signature: c.dataset("signature")?.values()?,
        sets: read_states(&c, "active")?,
        points: points.iter().map(|&p| p as usize).collect(),
        base: optional("base"),
        memory: optional("memory"),
    }))
}

impl Writer {
    /// Write `/orbit` beside the trajectory of its period.
    pub fn orbit(&mut self, orbit: &OrbitRecord, system: &System) -> Result<(), StoreError> {
        write_orbit(&fresh_group(self.file(), "orbit")?, orbit, system)
    }
}

/// The orbit of a file, if it holds one.
pub fn read_stored_orbit(path: &Path) -> Result<Option<OrbitRecord>, StoreError> {
    reading(path, || {
        let file = open(path)?;
        match file.group("orbit") {
            Ok(g) => Ok(Some(read_orbit(&g)?)),
            Err(_) => Ok(None),
        }
    })
}
