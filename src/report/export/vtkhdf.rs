//! VTKHDF: one HDF5 file with the mesh once and all states behind one another, which ParaView and VTK read as a series in time.
//!
//! Format 2.0, `UnstructuredGrid` with `Steps`: points and cells are those of every step, so their offsets stay zero, and those of the data grow by a
//! mesh a step. Cells count their nodes in VTK's order.

use std::io;
use std::path::PathBuf;

use hdf5::types::FixedAscii;
use hdf5::{Group, H5Type};

use super::fields::{Cell, Centre, Field, Fields, Values};
use super::put::replace;

/// Data from this many bytes a state on are compressed; smaller ones would not gain.
const LARGE: usize = 2048;

/// Write the states into `files[0]`.
pub(super) fn write(fields: &Fields, rows: &[usize], files: &[PathBuf]) -> io::Result<()> {
    let [file] = files else { return Ok(()) };
    replace(file, |part| {
        let written = all(part, fields, rows);
        written.map_err(|e| io::Error::other(e.to_string()))
    })
}

fn all(part: &std::path::Path, fields: &Fields, rows: &[usize]) -> Result<(), hdf5::Error> {
    let file = hdf5::File::create(part)?;
    let root = file.create_group("VTKHDF")?;
    whole(&root, "Version", &[2i64, 0])?;
    // readers want the bytes themselves, not a string of variable length
    let kind = FixedAscii::<16>::from_ascii("UnstructuredGrid")
        .map_err(|e| hdf5::Error::from(e.to_string()))?;
    root.new_attr::<FixedAscii<16>>().create("Type")?.write_scalar(&kind)?;
    let text = |name: &str, text: &str| {
        crate::store::write_text(&file, name, text).map_err(|e| hdf5::Error::from(e.to_string()))
    };
    text("signorini_version", env!("CARGO_PKG_VERSION"))?;
    text("title", &fields.stored.title)?;
    let (points, cells, steps) = (fields.n_nodes(), fields.cells().len(), rows.len());
    let connectivity: Vec<i64> = fields.cells().iter().flat_map(Cell::ordered).collect();
    let mut offsets = vec![0i64];
    for cell in fields.cells() {
        offsets.push(offsets[offsets.len() - 1] + cell.nodes.len() as i64);
    }
    let types: Vec<u8> = fields.cells().iter().map(|c| c.kind.vtk()).collect();
    column(&root, "NumberOfPoints", &[points as i64])?;
    column(&root, "NumberOfCells", &[cells as i64])?;
    column(&root, "NumberOfConnectivityIds", &[connectivity.len() as i64])?;
    let places = root.new_dataset::<f64>().shape((points, 3)).create("Points")?;
    places.write_raw(&fields.points())?;
    column(&root, "Connectivity", &connectivity)?;
    column(&root, "Offsets", &offsets)?;
    column(&root, "Types", &types)?;
    let course = root.create_group("Steps")?;
    course.new_attr::<i64>().create("NSteps")?.write_scalar(&(steps as i64))?;
    let times: Vec<f64> = rows.iter().map(|&r| fields.stored.t[r]).collect();
    column(&course, "Values", &times)?;
    column(&course, "NumberOfParts", &vec![1i64; steps])?;
    let zeros = vec![0i64; steps];
    column(&course, "PartOffsets", &zeros)?;
    column(&course, "PointOffsets", &zeros)?;
    for name in ["CellOffsets", "ConnectivityIdOffsets"] {
        course.new_dataset::<i64>().shape((steps, 1)).create(name)?.write_raw(&zeros)?;
    }
    let of = |place: Centre| match place {
        Centre::Point => ("PointData", points),
        Centre::Cell => ("CellData", cells),
    };
    for place in [Centre::Point, Centre::Cell] {
        root.create_group(of(place).0)?;
        course.create_group(&format!("{}Offsets", of(place).0))?;
    }
    for (k, &row) in rows.iter().enumerate() {
        for field in fields.at(row) {
            let (name, count) = of(field.place);
            let group = root.group(name)?;
            if k == 0 {
                create(&group, &field, count, steps)?;
                let offsets: Vec<i64> = (0..steps).map(|k| (k * count) as i64).collect();
                column(&course.group(&format!("{name}Offsets"))?, field.name, &offsets)?;
            }
            let dataset = group.dataset(field.name)?;
            match &field.values {
                Values::Real(v) => append(&dataset, v, field.components, k * count)?,
                Values::Whole(v) => append(&dataset, v, field.components, k * count)?,
            }
        }
    }
    // closing would swallow the error of a full disk
    file.flush()
}

/// An attribute of several whole numbers.
fn whole(group: &Group, name: &str, values: &[i64]) -> Result<(), hdf5::Error> {
    group.new_attr::<i64>().shape(values.len()).create(name)?.write_raw(values)
}

fn column<T: H5Type>(group: &Group, name: &str, values: &[T]) -> Result<(), hdf5::Error> {
    group.new_dataset::<T>().shape(values.len()).create(name)?.write_raw(values)
}

/// Room for a field at all states.
fn create(group: &Group, f: &Field, count: usize, steps: usize) -> Result<(), hdf5::Error> {
    let shape = |rows: usize| match f.components {
        1 => vec![rows],
        n => vec![rows, n],
    };
    let builder = |bytes: usize| {
        let builder = group.new_dataset_builder();
        match count * f.components * bytes {
            size if size >= LARGE => builder.chunk(shape(count)).shuffle().deflate(1),
            _ => builder,
        }
    };
    match f.values {
        Values::Real(_) => builder(8).empty::<f64>().shape(shape(steps * count)).create(f.name)?,
        Values::Whole(_) => builder(4).empty::<i32>().shape(shape(steps * count)).create(f.name)?,
    };
    Ok(())
}

/// Put the values of a state behind those before it.
fn append<T: H5Type>(
    dataset: &hdf5::Dataset,
    values: &[T],
    components: usize,
    first: usize,
) -> Result<(), hdf5::Error> {
    let rows = first..first + values.len() / components;
    match components {
        1 => dataset.write_slice(ndarray::ArrayView1::from(values), rows),
        n => {
            let table = ndarray::ArrayView2::from_shape((rows.len(), n), values)
                .map_err(|e| hdf5::Error::from(e.to_string()))?;
            dataset.write_slice(table, (rows, ..))
        }
    }
}
