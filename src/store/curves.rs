//! Curves over a number of the scene in HDF5: `/curves`.

use std::path::Path;

use hdf5::types::VarLenUnicode;

use super::bodies::words;
use super::careful::{Careful, open, reading};
use super::header::{Head, WriterOptions, write_whole};
use super::orbits::{matrix, read_scalar, scalar};
use super::{StoreError, read_text, write_text};
use crate::contact::System;
use crate::records::{Curve, CurveOf, CurvePoint, CurvePointKind, Curves, Status};
use crate::scenario::Scene;

/// Write the file of curves.
pub fn write_curves(
    path: &Path,
    scene: &Scene,
    system: &System,
    options: &WriterOptions,
    found: &Curves,
    status: &Status,
) -> Result<(), StoreError> {
    let dofs = system.body.nodal_dofs();
    let points: usize = found.all.iter().map(|c| c.points.len()).sum();
    let bytes = 16 * points * dofs.n_o;
    write_whole(path, (scene, system), options, (bytes, status), |file| {
        let all = file.create_group("curves")?;
        write_text(&all, "of", found.of.word())?;
        write_text(&all, "key", &found.key)?;
        if !found.lost.is_empty() {
            write_text(&all, "lost", &found.lost.join("\n"))?;
        }
        for (name, range) in [("range", found.range), ("frequencies", found.frequencies)] {
            all.new_dataset_builder().with_data(&range).create(name)?;
        }
        for (k, curve) in found.all.iter().enumerate() {
            let g = all.create_group(&k.to_string())?;
            let numbers = |name: &str, of: &dyn Fn(&CurvePoint) -> f64| {
                let values: Vec<f64> = curve.points.iter().map(of).collect();
                g.new_dataset_builder().with_data(&values).create(name).map(drop)
            };
            numbers("omega", &|p| p.omega)?;
            numbers("value", &|p| p.value)?;
            numbers("theta", &|p| p.theta.unwrap_or(f64::NAN))?;
            numbers("amplitude", &|p| p.amplitude)?;
            numbers("energy", &|p| p.energy)?;
            numbers("outside", &|p| p.outside.map_or(f64::NAN, |n| n as f64))?;
            let kinds: Vec<&str> = curve.points.iter().map(|p| p.kind.word()).collect();
            words(&g, "special", &kinds)?;
            scalar(&g, "periods", curve.periods as f64)?;
            curve.node.map_or(Ok(()), |node| scalar(&g, "node", node as f64))?;
            scalar(&g, "closed", f64::from(u8::from(curve.closed)))?;
            words(&g, "ends", &[&curve.ends[0], &curve.ends[1]])?;
            let states = |name: &str, of: fn(&CurvePoint) -> &Vec<f64>| {
                let rows: Vec<Vec<f64>> =
                    curve.points.iter().map(|p| dofs.along_axes(of(p))).collect();
                let columns = rows.first().map_or(0, Vec::len);
                let states = matrix(rows.len(), columns, rows.concat())?;
                g.new_dataset_builder().with_data(&states).create(name)?;
                Ok::<_, StoreError>(())
            };
            states("u0", |p| &p.u0)?;
            states("v0", |p| &p.v0)?;
        }
        Ok(())
    })
}

/// The curves of a file.
#[derive(Debug, Clone)]
pub struct StoredCurves {
    /// Of which scene, and how it ended.
    pub head: Head,
    /// The curves.
    pub curves: Curves,
}

/// Read the curves of a file.
pub fn read_curves(path: &Path) -> Result<StoredCurves, StoreError> {
    reading(path, || {
        let file = open(path)?;
        let missing = |_| StoreError::Missing { path: path.to_owned(), what: "/curves".into() };
        let all = file.group("curves").map_err(missing)?;
        let bad = |what: &str| StoreError::unusable(path, format!("/curves: {what}"));
        let of = read_text(&all, "of").and_then(|word| CurveOf::of_word(&word));
        let pair = |name: &str| -> Result<[f64; 2], StoreError> {
            let values: Vec<f64> = all.dataset(name)?.values()?;
            <[f64; 2]>::try_from(values).map_err(|_| bad("a range is damaged"))
        };
        let mut curves = Curves {
            of: of.ok_or_else(|| bad("no word for what they are of"))?,
            key: read_text(&all, "key").unwrap_or_default(),
            range: pair("range")?,
            frequencies: pair("frequencies")?,
            all: vec![],
            lost: read_text(&all, "lost")
                .map_or(vec![], |text| text.lines().map(str::to_owned).collect()),
        };
        for k in 0.. {
            if !all.link_exists(&k.to_string()) {
                break;
            }
            curves.all.push(read_curve(&all.group(&k.to_string())?)?);
        }
        Ok(StoredCurves { head: Head::read(&file), curves })
    })
}

fn read_curve(g: &hdf5::Group) -> Result<Curve, StoreError> {
    let numbers = |name: &str| g.dataset(name)?.values::<f64>();
    let [omega, value, theta, amplitude, energy, outside] =
        ["omega", "value", "theta", "amplitude", "energy", "outside"].map(numbers);
    let (omega, value, theta) = (omega?, value?, theta?);
    let (amplitude, energy, outside) = (amplitude?, energy?, outside?);
    let words = |name: &str| -> Result<Vec<String>, StoreError> {
        let all: Vec<VarLenUnicode> = g.dataset(name)?.values()?;
        Ok(all.iter().map(|word| word.as_str().to_owned()).collect())
    };
    let kinds = words("special")?;
    let (u0, v0) = (g.dataset("u0")?.table::<f64>()?, g.dataset("v0")?.table::<f64>()?);
    let finite = |list: &[f64], k: usize| list.get(k).copied().filter(|x| x.is_finite());
    let row = |table: &ndarray::Array2<f64>, k: usize| match k < table.nrows() {
        true => table.row(k).to_vec(),
        false => vec![],
    };
    let point = |k: usize| CurvePoint {
        omega: omega[k],
        value: finite(&value, k).unwrap_or(f64::NAN),
        theta: finite(&theta, k),
        kind: CurvePointKind::of_word(kinds.get(k).map_or("", String::as_str)),
        amplitude: finite(&amplitude, k).unwrap_or(f64::NAN),
        energy: finite(&energy, k).unwrap_or(f64::NAN),
        outside: finite(&outside, k).map(|n| n as usize),
        u0: row(&u0, k),
        v0: row(&v0, k),
    };
    let ends = words("ends")?;
    let end = |k: usize| ends.get(k).cloned().unwrap_or_default();
    Ok(Curve {
        periods: read_scalar(g, "periods")? as usize,
        node: read_scalar(g, "node").ok().map(|node| node as usize),
        points: (0..omega.len()).map(point).collect(),
        ends: [end(0), end(1)],
        closed: read_scalar(g, "closed")? == 1.0,
    })
}
