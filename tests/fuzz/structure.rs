//! Mutations of HDF5 files by means of HDF5: what stays a proper file and is not what this program wrote.

use std::path::Path;

use hdf5::types::{FixedAscii, FixedUnicode, TypeDescriptor, VarLenArray, VarLenUnicode};
use hdf5::{File, Group, H5Type, LocationType, Result};
use ndarray::{ArrayD, IxDyn};

use crate::common::Splitmix;

/// Numbers that stand in place of others.
const NUMBERS: &[f64] = &[
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    -1.0,
    -2.0,
    0.0,
    -0.0,
    0.5,
    1.0,
    2.0,
    3.0,
    7.0,
    1e6,
    1e9,
    1e19,
    1e300,
    -1e300,
    1e-300,
    f64::MAX,
    4_294_967_296.0,
    9.3e18,
    -9.3e18,
];

/// Integers that stand in place of others.
const INTEGERS: &[i64] =
    &[-1, -2, 0, 1, 2, 3, 7, 1_000_000, 4_294_967_296, i64::MAX, i64::MAX / 2, i64::MIN];

/// Words that stand in place of others.
const WORDS: &[&str] =
    &["", "close", "open", "orbit", "gap: x", "regular", "fold", "start", "end of range", "-", "?"];

/// Texts of attributes.
const TEXTS: &[&str] = &[
    "",
    "\n",
    "-x",
    "yes",
    "[body]",
    "a\nb\nc\nd\ne\nf\ng\nh",
    "hbm sequential",
    "crosscheck sequential",
    "é→∂ \u{1b}[31m\u{7}",
];

/// All objects below a group, groups with `true`. Links may go in rings: not deeper than `depth`.
fn objects(group: &Group, path: &str, depth: usize, found: &mut Vec<(String, bool)>) {
    for name in group.member_names().unwrap_or_default() {
        let full = format!("{path}/{name}");
        match group.loc_type_by_name(&name) {
            Ok(LocationType::Group) => {
                found.push((full.clone(), true));
                if let (Ok(inner), true) = (group.group(&name), depth > 0) {
                    objects(&inner, &full, depth - 1, found);
                }
            }
            Ok(LocationType::Dataset) => found.push((full, false)),
            _ => {}
        }
    }
}

/// Put a dataset in place of what is there.
fn put<T: H5Type + Clone>(file: &File, path: &str, shape: &[usize], values: Vec<T>) -> Result<()> {
    let array = ArrayD::from_shape_vec(IxDyn(shape), values).map_err(|e| e.to_string())?;
    file.unlink(path)?;
    file.new_dataset_builder().with_data(&array).create(path)?;
    Ok(())
}

/// The same data in another number or another order, values drawn by `fill`.
fn reshape<T: H5Type + Clone>(
    rng: &Splitmix,
    file: &File,
    path: &str,
    mut fill: impl FnMut(&Splitmix) -> T,
) -> Result<()> {
    let dataset = file.dataset(path)?;
    let (mut shape, mut values) = (dataset.shape(), dataset.read_raw::<T>()?);
    drop(dataset);
    match rng.below(8) {
        // longer or shorter
        0..=3 if !shape.is_empty() => {
            let axis = if rng.below(4) == 0 { rng.below(shape.len()) } else { 0 };
            let length = shape[axis];
            shape[axis] =
                rng.pick(&[0, 1, length.saturating_sub(1), length + 1, 2 * length, length / 2]);
        }
        // other dimensions
        4 => shape = vec![values.len()],
        5 => shape.reverse(),
        6 => shape.push(1),
        _ => shape = vec![],
    }
    values.resize_with(shape.iter().product(), || fill(rng));
    put(file, path, &shape, values)
}

/// Single values replaced, or all.
fn revalue<T: H5Type + Clone>(
    rng: &Splitmix,
    file: &File,
    path: &str,
    mut fill: impl FnMut(&Splitmix) -> T,
) -> Result<()> {
    let dataset = file.dataset(path)?;
    let (shape, mut values) = (dataset.shape(), dataset.read_raw::<T>()?);
    drop(dataset);
    if !values.is_empty() {
        for _ in 0..1 + rng.below(3) {
            let at = rng.below(values.len());
            values[at] = fill(rng);
        }
        if rng.below(5) == 0 {
            let all = fill(rng);
            values.fill(all);
        }
    }
    put(file, path, &shape, values)
}

fn word<const N: usize>(rng: &Splitmix) -> FixedAscii<N> {
    FixedAscii::from_ascii(rng.pick(WORDS)).unwrap_or_default()
}

/// Change a dataset, keeping its type.
fn content(rng: &Splitmix, file: &File, path: &str, shape: bool) -> Result<()> {
    let number = |rng: &Splitmix| rng.pick(NUMBERS);
    let integer = |rng: &Splitmix| rng.pick(INTEGERS);
    let flag = |rng: &Splitmix| rng.bits() as u8;
    let kind = file.dataset(path)?.dtype()?.to_descriptor()?;
    match (kind, shape) {
        (TypeDescriptor::Integer(_), true) => reshape::<i64>(rng, file, path, integer),
        (TypeDescriptor::Integer(_), false) => revalue::<i64>(rng, file, path, integer),
        (TypeDescriptor::Unsigned(_), true) => reshape::<u8>(rng, file, path, flag),
        (TypeDescriptor::Unsigned(_), false) => revalue::<u8>(rng, file, path, flag),
        (TypeDescriptor::FixedAscii(32), true) => reshape(rng, file, path, word::<32>),
        (TypeDescriptor::FixedAscii(32), false) => revalue(rng, file, path, word::<32>),
        (TypeDescriptor::FixedAscii(_), true) => reshape(rng, file, path, word::<64>),
        (TypeDescriptor::FixedAscii(_), false) => revalue(rng, file, path, word::<64>),
        (_, true) => reshape::<f64>(rng, file, path, number),
        (_, false) => revalue::<f64>(rng, file, path, number),
    }
}

/// The same place with another type.
fn retype(rng: &Splitmix, file: &File, path: &str) -> Result<()> {
    let dataset = file.dataset(path)?;
    let shape = dataset.shape();
    let n: usize = shape.iter().product();
    let numbers = dataset.read_raw::<f64>().unwrap_or_else(|_| vec![1.0; n]);
    drop(dataset);
    let text = |rng: &Splitmix| rng.pick(TEXTS).parse::<VarLenUnicode>().unwrap_or_default();
    match rng.below(10) {
        0 => put(file, path, &shape, numbers),
        1 => put(file, path, &shape, numbers.iter().map(|x| *x as f32).collect()),
        2 => put(file, path, &shape, numbers.iter().map(|x| *x as i64).collect()),
        3 => put(file, path, &shape, numbers.iter().map(|x| *x as i8).collect()),
        4 => put(file, path, &shape, numbers.iter().map(|x| *x as u64).collect()),
        5 => put(file, path, &shape, numbers.iter().map(|x| *x > 0.5).collect()),
        6 => put(file, path, &shape, (0..n).map(|_| word::<8>(rng)).collect()),
        7 => put(file, path, &shape, (0..n).map(|_| text(rng)).collect()),
        8 => put(file, path, &shape, numbers.iter().map(|x| [*x, 0.0]).collect()),
        _ => {
            let lists = numbers.iter().map(|x| VarLenArray::from_slice(&[*x, 1.0]));
            put(file, path, &shape, lists.collect())
        }
    }
}

/// A dataset that says to be larger than any memory, in a small file.
fn absurd(rng: &Splitmix, file: &File, path: &str) -> Result<()> {
    let dataset = file.dataset(path)?;
    let (mut shape, kind) = (dataset.shape(), dataset.dtype()?.to_descriptor()?);
    drop(dataset);
    if shape.is_empty() {
        shape = vec![1];
    }
    let axis = rng.below(shape.len());
    shape[axis] = rng.pick(&[1 << 34, 1 << 40, 1 << 61, (1 << 63) - 1]);
    let chunk: Vec<usize> = shape.iter().map(|n| (*n).clamp(1, 16)).collect();
    file.unlink(path)?;
    file.new_dataset_builder().empty_as(&kind).chunk(chunk).shape(shape).create(path)?;
    Ok(())
}

/// Whether a dataset can be read to be changed: a former change may have made it larger than any memory.
fn is_small(file: &File, path: &str) -> bool {
    let sizes = |d: hdf5::Dataset| d.shape().iter().all(|n| *n < 100_000);
    file.dataset(path).is_ok_and(sizes)
}

/// Something else under the name: nothing, a group, a dataset, a link to elsewhere or to itself.
fn relink(rng: &Splitmix, file: &File, path: &str, others: &[(String, bool)]) -> Result<()> {
    let other = || rng.any(others).map_or_else(|| "/".to_owned(), |o| o.0);
    file.unlink(path)?;
    match rng.below(8) {
        0..=3 => Ok(()),
        4 => file.create_group(path).map(drop),
        5 => file.link_soft(&other(), path),
        6 => file.link_soft(rng.pick(&[path, "/", "/nothing"]), path),
        _ => {
            let target = &other();
            // a parent of itself is a ring: only beside it
            if path.starts_with(target.as_str()) { Ok(()) } else { file.link_hard(target, path) }
        }
    }
}

/// An attribute of an object removed, or with another value or type, or never written.
fn attribute(rng: &Splitmix, file: &File, path: &str) -> Result<()> {
    // a group, a dataset and the root all carry attributes
    let place: hdf5::Location = match (file.group(path), file.dataset(path)) {
        (Ok(group), _) => (*group).clone(),
        (_, Ok(dataset)) => (**dataset).clone(),
        _ => return Ok(()),
    };
    if rng.below(8) == 0 {
        // which says that the dimensions stand in reverse
        return place.new_attr::<f64>().create("MATLAB_class").map(drop);
    }
    let Some(name) = rng.any(&place.attr_names()?) else { return Ok(()) };
    let name = name.as_str();
    place.delete_attr(name)?;
    let text: VarLenUnicode = rng.pick(TEXTS).parse().unwrap_or_default();
    let number = rng.pick(NUMBERS);
    match rng.below(9) {
        0 | 1 => Ok(()),
        2 | 3 => place.new_attr::<f64>().create(name)?.write_scalar(&number),
        4 => place.new_attr::<i64>().create(name)?.write_scalar(&rng.pick(INTEGERS)),
        5 => place.new_attr::<VarLenUnicode>().create(name)?.write_scalar(&text),
        6 => place.new_attr::<VarLenUnicode>().create(name).map(drop),
        7 => {
            let fixed: FixedUnicode<32> = text.parse().unwrap_or_default();
            place.new_attr::<FixedUnicode<32>>().create(name)?.write_scalar(&fixed)
        }
        _ => place.new_attr::<f64>().shape([2]).create(name).map(drop),
    }
}

/// One to three changes of a proper file. A change that HDF5 does not take is left out.
pub fn mutate(rng: &Splitmix, path: &Path) -> Result<()> {
    let file = crate::common::hdf5_files().open_rw(path)?;
    for _ in 0..1 + rng.below(3) {
        let mut all = vec![];
        objects(&file, "", 4, &mut all);
        if all.is_empty() {
            break;
        }
        // a family has most of its objects in its points: as often one of its tables, or of the point it goes on from
        let is_point = |o: &str| o.contains("/points/");
        let last = all.iter().map(|o| o.0.as_str()).filter(|o| is_point(o)).max();
        let last = last.and_then(|o| o.get(..o.find("/points/")? + 12)).unwrap_or("").to_owned();
        match rng.below(4) {
            0 | 1 => all.retain(|o| !is_point(&o.0)),
            2 => all.retain(|o| o.0.starts_with(&last)),
            _ => {}
        }
        let Some((name, is_group)) = rng.any(&all) else { continue };
        let _ = match rng.below(16) {
            0..=1 => relink(rng, &file, &name, &all),
            2..=3 => attribute(rng, &file, if rng.below(2) == 0 { "/" } else { &name }),
            _ if is_group || !is_small(&file, &name) => attribute(rng, &file, &name),
            4..=8 => content(rng, &file, &name, true),
            9..=12 => content(rng, &file, &name, false),
            13..=14 => retype(rng, &file, &name),
            _ => absurd(rng, &file, &name),
        };
    }
    Ok(())
}
