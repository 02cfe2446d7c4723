//! XDMF: one XML file over all states, its numbers in an HDF5 file beside it.
//!
//! The mesh is a grid of its own, to which every state of the temporal collection refers (XInclude): meshio wants it so, and VTK
//! and ParaView resolve the reference (they show the undeformed mesh as a block of its own, which can be switched off). The
//! run's own HDF5 file cannot serve: it stores the displacements that are not prescribed, in the solver's order, all states
//! in one dataset, and meshio takes whole datasets only.

use std::fmt::Write as _;
use std::fs::OpenOptions;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use hdf5::{Group, H5Type};

use super::fields::{Cell, Centre, Field, Fields, Values};
use super::put::{escape, number, put, replace};
use crate::store::{MARK, StoreError};

/// Datasets from this many bytes on are compressed; smaller ones would not gain.
const LARGE: usize = 2048;

/// `files`: the XML file and the HDF5 file. The one that refers to the other comes last.
pub(super) fn write(fields: &Fields, rows: &[usize], files: &[PathBuf]) -> io::Result<()> {
    let [light, heavy] = files else { return Ok(()) };
    let name = heavy.file_name().unwrap_or_default().to_string_lossy();
    let source = escape(&name);
    let (points, cells) = (fields.n_nodes(), fields.cells().len());
    let topology = fields.kind().map_or("Mixed", |kind| kind.xdmf().1);
    let (table, columns) = connectivity(fields);
    let shape = [table.len() / columns, columns];
    let shape = if columns == 1 { &shape[..1] } else { &shape[..] };
    let mut out = format!(
        "<?xml version=\"1.0\"?>\n{MARK}\n<Xdmf Version=\"3.0\" xmlns:xi=\"http://www.w3.org/2001/XInclude\">\n<Domain>\n\
         <Grid Name=\"mesh\" GridType=\"Uniform\">\n\
         <Topology TopologyType=\"{topology}\" NumberOfElements=\"{cells}\">{}</Topology>\n\
         <Geometry GeometryType=\"XYZ\">{}</Geometry>\n</Grid>\n\
         <Grid Name=\"{}\" GridType=\"Collection\" CollectionType=\"Temporal\">\n",
        item("Int", 8, shape, &source, "/mesh/elements"),
        item("Float", 8, &[points, 3], &source, "/mesh/nodes"),
        escape(if fields.stored.title.is_empty() { "states" } else { &fields.stored.title }),
    );
    replace(heavy, |part| {
        numbers(part, fields, rows, |k, row, all| {
            light_state(&mut out, fields, k, row, all, &source);
        })
        .map_err(|e| reason(part, &e))
    })?;
    out.push_str("</Grid>\n</Domain>\n</Xdmf>\n");
    put(light, out.as_bytes())
}

/// The nodes of the elements, one row each; of several kinds in one row, each behind the number of its kind.
fn connectivity(fields: &Fields) -> (Vec<i64>, usize) {
    if let Some(kind) = fields.kind() {
        return (fields.cells().iter().flat_map(Cell::ordered).collect(), kind.nodes());
    }
    let of_cell = |c: &Cell| [vec![c.kind.xdmf().0], c.ordered()].concat();
    (fields.cells().iter().flat_map(of_cell).collect(), 1)
}

/// Why the HDF5 file could not be written. The library does not pass on the system's words, but another write to the file
/// fails in the same way.
fn reason(part: &Path, error: &StoreError) -> io::Error {
    let file = OpenOptions::new().append(true).open(part);
    let again = file.and_then(|mut f| f.write_all(&vec![0; 1 << 20]).and_then(|()| f.sync_all()));
    again.err().unwrap_or_else(|| io::Error::other(error.to_string()))
}

/// One state of the collection.
fn light_state(
    out: &mut String,
    fields: &Fields,
    k: usize,
    row: usize,
    all: &[Field],
    source: &str,
) {
    let (points, cells) = (fields.n_nodes(), fields.cells().len());
    let _ = writeln!(
        out,
        "<Grid Name=\"state {k}\" GridType=\"Uniform\">\n\
         <xi:include xpointer=\"xpointer(//Grid[@Name=&quot;mesh&quot;]/*[self::Topology or self::Geometry])\"/>\n\
         <Time Value=\"{}\"/>",
        number(fields.stored.t[row])
    );
    for f in all {
        let (centre, count) = match f.place {
            Centre::Point => ("Node", points),
            Centre::Cell => ("Cell", cells),
        };
        let kind = match f.components {
            1 => "Scalar",
            3 => "Vector",
            _ => "Tensor",
        };
        let shape = [count, f.components];
        let shape = if f.components == 1 { &shape[..1] } else { &shape[..] };
        let path = format!("/states/{k:06}/{}", f.name);
        let values = match f.values {
            Values::Real(_) => item("Float", 8, shape, source, &path),
            Values::Whole(_) => item("Int", 4, shape, source, &path),
        };
        let name = f.name;
        let _ = writeln!(
            out,
            "<Attribute Name=\"{name}\" AttributeType=\"{kind}\" Center=\"{centre}\">{values}</Attribute>"
        );
    }
    out.push_str("</Grid>\n");
}

/// A reference to a dataset.
fn item(kind: &str, precision: usize, shape: &[usize], source: &str, path: &str) -> String {
    let shape = shape.iter().map(usize::to_string).collect::<Vec<_>>().join(" ");
    format!(
        "<DataItem Format=\"HDF\" NumberType=\"{kind}\" Precision=\"{precision}\" Dimensions=\"{shape}\">{source}:{path}</DataItem>"
    )
}

/// The HDF5 file; `each` is told of every state that it holds.
fn numbers(
    path: &Path,
    fields: &Fields,
    rows: &[usize],
    mut each: impl FnMut(usize, usize, &[Field]),
) -> Result<(), StoreError> {
    let file = hdf5::File::create(path)?;
    crate::store::write_text(&file, "signorini_version", env!("CARGO_PKG_VERSION"))?;
    crate::store::write_text(&file, "title", &fields.stored.title)?;
    let mesh = file.create_group("mesh")?;
    let (points, cells) = (fields.n_nodes(), fields.cells().len());
    dataset(&mesh, "nodes", points, 3, &fields.points())?;
    let (table, columns) = connectivity(fields);
    dataset(&mesh, "elements", table.len() / columns, columns, &table)?;
    let states = file.create_group("states")?;
    for (k, &row) in rows.iter().enumerate() {
        let group = states.create_group(&format!("{k:06}"))?;
        let all = fields.at(row);
        for f in &all {
            let count = if f.place == Centre::Point { points } else { cells };
            match &f.values {
                Values::Real(v) => dataset(&group, f.name, count, f.components, v)?,
                Values::Whole(v) => dataset(&group, f.name, count, f.components, v)?,
            }
        }
        each(k, row, &all);
    }
    // closing would swallow the error of a full disk
    file.flush()?;
    Ok(())
}

fn dataset<T: H5Type>(
    group: &Group,
    name: &str,
    rows: usize,
    columns: usize,
    values: &[T],
) -> Result<(), hdf5::Error> {
    let shape = if columns == 1 { vec![rows] } else { vec![rows, columns] };
    let builder = group.new_dataset::<T>();
    let builder = match std::mem::size_of_val(values) {
        bytes if bytes >= LARGE => builder.chunk(shape.clone()).shuffle().deflate(1),
        _ => builder,
    };
    builder.shape(shape).create(name)?.write_raw(values)
}
