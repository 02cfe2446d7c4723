//! Basins of attraction in HDF5: `/basins`, and the attractors that they lead to in `/attractors`.

use std::path::Path;

use super::careful::{Careful, open, reading};
use super::header::{Head, WriterOptions, read_problem, write_problem, write_whole};
use super::orbits::{matrix, read_scalar, scalar};
use super::{StoreError, read_text, write_text};
use crate::contact::System;
use crate::records::{
    AttractorFound, AttractorKind, AttractorRecord, Basins, ExtremesRecord, Fate, Starts,
    StateAxis, Status,
};
use crate::scenario::Scene;

/// A state that is not told yet.
const OPEN: i64 = -9;

/// Basins of a file.
#[derive(Debug, Clone)]
pub struct StoredBasins {
    /// Of which scene, and how it ended.
    pub head: Head,
    /// All that the equations depend on, as one number.
    pub problem: u64,
    /// The basins.
    pub basins: Basins,
    /// The coordinates of all states along their axes.
    pub at: Vec<Vec<f64>>,
}

/// Write the file of basins; `problem` is the fingerprint of what they are of, `at` the coordinates of all states.
pub fn write_basins(
    path: &Path,
    (scene, system, problem): (&Scene, &System, u64),
    options: &WriterOptions,
    (basins, at): (&Basins, &[Vec<f64>]),
    status: &Status,
) -> Result<(), StoreError> {
    let states: usize = basins.attractors.iter().map(|a| a.u0.len()).sum();
    let numbers = basins.fates.len() * (basins.axes.len() + 2);
    let columns = system.body.nodal_dofs().n_columns();
    let bytes = 8 * (numbers + 2 * states * columns);
    write_whole(path, (scene, system), options, (bytes, status), |file| {
        let g = file.create_group("basins")?;
        scalar(&g, "omega", basins.omega)?;
        write_problem(&g, problem)?;
        match basins.starts {
            Starts::Grid(n) => scalar(&g, "size", n as f64)?,
            Starts::Drawn { seed, .. } => {
                write_text(&g, "generator", "ChaCha8")?;
                write_text(&g, "seed", &seed.to_string())?;
            }
        }
        let names: Vec<String> = basins.axes.iter().map(StateAxis::name).collect();
        write_text(&g, "axes", &names.join(" "))?;
        let range = basins.axes.iter().flat_map(|a| [a.range.0, a.range.1]).collect();
        let range = matrix(basins.axes.len(), 2, range)?;
        g.new_dataset_builder().with_data(&range).create("range")?;
        let starts = matrix(at.len(), basins.axes.len(), at.concat())?;
        g.new_dataset_builder().deflate(4).with_data(&starts).create("starts")?;
        let codes: Vec<i64> = basins.fates.iter().map(|f| f.map_or(OPEN, Fate::code)).collect();
        g.new_dataset_builder().deflate(4).with_data(&codes).create("attractor")?;
        let maps: Vec<i64> = basins.maps.iter().map(|n| *n as i64).collect();
        g.new_dataset_builder().deflate(4).with_data(&maps).create("maps")?;
        let all = file.create_group("attractors")?;
        for (k, attractor) in basins.attractors.iter().enumerate() {
            write_attractor(&all.create_group(&k.to_string())?, (basins, k), attractor, system)?;
        }
        Ok(())
    })
}

/// Numbers of an attractor, by their names.
fn numbers(seen: &AttractorRecord) -> [(&'static str, f64); 8] {
    [
        ("period_number", seen.kind.periods() as f64),
        ("lyapunov", seen.exponent),
        ("lyapunov_error", seen.exponent_error),
        ("amplitude", seen.amplitude()),
        ("force", seen.force),
        ("energy", seen.energy),
        ("switches", seen.switches),
        ("maps", seen.maps as f64),
    ]
}

fn write_attractor(
    g: &hdf5::Group,
    (basins, k): (&Basins, usize),
    attractor: &AttractorFound,
    system: &System,
) -> Result<(), StoreError> {
    let AttractorFound { seen, rotation, x, u0, v0, at } = attractor;
    write_text(g, "kind", seen.kind.word())?;
    write_text(g, "note", &seen.note)?;
    numbers(seen).iter().try_for_each(|(name, x)| scalar(g, name, *x))?;
    if let Some((rho, error)) = rotation {
        scalar(g, "rotation_number", *rho)?;
        scalar(g, "rotation_error", *error)?;
    }
    let share = basins.share(Fate::Attractor(k));
    scalar(g, "share", share.share)?;
    scalar(g, "share_error", share.error)?;
    scalar(g, "share_low", share.interval.0)?;
    scalar(g, "share_high", share.interval.1)?;
    for (name, values) in [
        ("peak", &seen.peak),
        ("trough", &seen.trough),
        ("sections", &seen.sections),
        ("least", &seen.least),
        ("spectrum", &seen.spectrum),
        ("x", x),
    ] {
        g.new_dataset_builder().with_data(values).create(name)?;
    }
    let dofs = system.body.nodal_dofs();
    for (name, states) in [("u0", u0), ("v0", v0)] {
        let rows: Vec<Vec<f64>> = states.iter().map(|s| dofs.along_axes(s)).collect();
        let states = matrix(rows.len(), rows.first().map_or(0, Vec::len), rows.concat())?;
        g.new_dataset_builder().with_data(&states).create(name)?;
    }
    let at = matrix(at.len(), basins.axes.len(), at.concat())?;
    g.new_dataset_builder().with_data(&at).create("at")?;
    Ok(())
}

/// Read the basins of a file.
pub fn read_basins(path: &Path) -> Result<StoredBasins, StoreError> {
    reading(path, || {
        let file = open(path)?;
        let missing = |_| StoreError::Missing { path: path.to_owned(), what: "/basins".into() };
        let g = file.group("basins").map_err(missing)?;
        let bad = |what: &str| StoreError::unusable(path, format!("/basins: {what}"));
        let codes: Vec<i64> = g.dataset("attractor")?.values()?;
        let maps: Vec<i64> = g.dataset("maps")?.values()?;
        let range = g.dataset("range")?.table::<f64>()?;
        let names = read_text(&g, "axes").unwrap_or_default();
        let axis = |(name, ends): (&str, ndarray::ArrayView1<f64>)| {
            let (kind, mode) = name.split_at_checked(1)?;
            let range = (*ends.first()?, *ends.get(1)?);
            Some(StateAxis { mode: mode.parse().ok()?, is_velocity: kind == "v", range })
        };
        let axes = names.split_whitespace().zip(range.rows()).map(axis);
        let axes: Option<Vec<StateAxis>> = axes.collect();
        let starts = match read_scalar(&g, "size") {
            Ok(n) => Starts::Grid(n as usize),
            Err(_) => {
                let seed = read_text(&g, "seed").and_then(|s| s.parse().ok());
                let seed = seed.ok_or_else(|| bad("neither a size nor a seed"))?;
                Starts::Drawn { count: codes.len(), seed }
            }
        };
        let mut attractors = vec![];
        let all = file.group("attractors")?;
        for k in 0.. {
            if !all.link_exists(&k.to_string()) {
                break;
            }
            attractors.push(read_attractor(&all.group(&k.to_string())?)?);
        }
        let basins = Basins {
            omega: read_scalar(&g, "omega")?,
            axes: axes.filter(|a| !a.is_empty()).ok_or_else(|| bad("axes are damaged"))?,
            starts,
            fates: codes.iter().map(|c| Fate::of_code(*c)).collect(),
            maps: maps.iter().map(|n| usize::try_from(*n).unwrap_or(0)).collect(),
            attractors,
        };
        let at = rows(&g, "starts")?;
        let count = Basins::count(starts);
        let is_known = |f: &Fate| match f {
            Fate::Attractor(k) => *k < basins.attractors.len(),
            _ => true,
        };
        if basins.fates.len() != count
            || basins.maps.len() != count
            || at.len() != count
            || at.iter().any(|x| x.len() != basins.axes.len())
            || !basins.fates.iter().flatten().all(is_known)
        {
            return Err(bad("states and attractors do not fit each other"));
        }
        let ends = basins.axes.iter().flat_map(|a| [a.range.0, a.range.1]);
        if !ends.chain(at.iter().flatten().copied()).all(f64::is_finite) {
            return Err(bad("a range or a state is damaged"));
        }
        for (k, a) in basins.attractors.iter().enumerate() {
            let rows = a.seen.kind.periods().max(1);
            let enough = a.u0.len() == rows && a.v0.len() == rows && a.at.len() >= rows;
            if !enough || a.at.iter().any(|x| x.len() != basins.axes.len()) {
                return Err(bad(&format!(
                    "the states of attractor {k} do not fit its period number"
                )));
            }
        }
        Ok(StoredBasins {
            head: Head::read(&file),
            problem: read_problem(&g).ok_or_else(|| bad("no fingerprint of the problem"))?,
            basins,
            at,
        })
    })
}

fn rows(g: &hdf5::Group, name: &str) -> Result<Vec<Vec<f64>>, StoreError> {
    Ok(g.dataset(name)?.table::<f64>()?.rows().into_iter().map(|r| r.to_vec()).collect())
}

fn read_attractor(g: &hdf5::Group) -> Result<AttractorFound, StoreError> {
    let list = |name: &str| g.dataset(name)?.values::<f64>();
    let number = |name: &str| read_scalar(g, name);
    let word = read_text(g, "kind").unwrap_or_default();
    let kind = AttractorKind::of_word(&word, number("period_number")? as usize);
    let seen = AttractorRecord {
        kind: kind.unwrap_or(AttractorKind::Lost),
        exponent: number("lyapunov")?,
        exponent_error: number("lyapunov_error")?,
        peak: list("peak")?,
        trough: list("trough")?,
        force: number("force")?,
        energy: number("energy")?,
        switches: number("switches")?,
        sections: list("sections")?,
        least: list("least")?,
        spectrum: list("spectrum")?,
        extremes: ExtremesRecord::default(),
        maps: number("maps")? as usize,
        note: read_text(g, "note").unwrap_or_default(),
    };
    let rotation = number("rotation_number").and_then(|rho| Ok((rho, number("rotation_error")?)));
    Ok(AttractorFound {
        seen,
        rotation: rotation.ok(),
        x: list("x")?,
        u0: rows(g, "u0")?,
        v0: rows(g, "v0")?,
        at: rows(g, "at")?,
    })
}
