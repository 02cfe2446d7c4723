//! Stored runs in other formats: CSV for a spreadsheet, VTU and XDMF for ParaView.

use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};

use crate::store::Stored;

fn named(stem: &Path, ending: &str) -> PathBuf {
    let mut name = stem.as_os_str().to_owned();
    name.push(ending);
    PathBuf::from(name)
}

/// `STEM.csv` (a row a stored state) and `STEM-switches.csv`.
pub fn csv(stored: &Stored, stem: &Path) -> io::Result<Vec<PathBuf>> {
    let n_c = stored.gap.len();
    let mut out = String::from("t,kinetic,elastic,external,dissipated,jumps");
    for node in &stored.contact_nodes {
        let _ = write!(out, ",u_n[{node}],pressure[{node}],active[{node}]");
    }
    out.push('\n');
    for row in 0..stored.t.len() {
        let _ = write!(out, "{:e}", stored.t[row]);
        for column in &stored.energy {
            let _ = write!(out, ",{:e}", column[row]);
        }
        for i in 0..n_c {
            let (u, p) = (stored.contact_displacement(row, i), stored.pressure[(row, i)]);
            let _ = write!(out, ",{u:e},{p:e},{}", stored.active[(row, i)]);
        }
        out.push('\n');
    }
    let mut switches = String::from("t,node,kind,energy_jump\n");
    for k in 0..stored.switch_t.len() {
        let _ = writeln!(
            switches,
            "{:e},{},{},{:e}",
            stored.switch_t[k], stored.switch_node[k], stored.switch_kind[k], stored.switch_jump[k]
        );
    }
    let paths = vec![named(stem, ".csv"), named(stem, "-switches.csv")];
    std::fs::write(&paths[0], out)?;
    std::fs::write(&paths[1], switches)?;
    Ok(paths)
}

/// Displacement and velocity of all nodes at a stored state, three components each.
fn point_fields(stored: &Stored, row: usize) -> [(&'static str, String); 2] {
    let mut text = [String::new(), String::new()];
    for node in 0..stored.nodes.nrows() {
        for (out, table) in text.iter_mut().zip([&stored.u, &stored.v]) {
            for c in 0..2 {
                let value = match stored.dof_map[(node, c)] {
                    -1 => 0.0,
                    i => table[(row, i as usize)],
                };
                let _ = write!(out, "{value:e} ");
            }
            out.push_str("0 ");
        }
    }
    let [u, v] = text;
    [("displacement", u), ("velocity", v)]
}

fn points(stored: &Stored) -> String {
    let rows = stored.nodes.rows();
    rows.into_iter().fold(String::new(), |mut out, p| {
        let _ = write!(out, "{:e} {:e} 0 ", p[0], p[1]);
        out
    })
}

fn connectivity(stored: &Stored) -> String {
    stored.elements.iter().fold(String::new(), |mut out, n| {
        let _ = write!(out, "{n} ");
        out
    })
}

/// `STEM-NNNNNN.vtu`, one a stored state, and the collection `STEM.pvd`.
pub fn vtu(stored: &Stored, stem: &Path) -> io::Result<Vec<PathBuf>> {
    let (n_nodes, n_cells, per_cell) =
        (stored.nodes.nrows(), stored.elements.nrows(), stored.elements.ncols());
    let offsets = (1..=n_cells).map(|k| (k * per_cell).to_string()).collect::<Vec<_>>().join(" ");
    let kind = if per_cell == 2 { "3 " } else { "9 " }.repeat(n_cells);
    let (points, connectivity) = (points(stored), connectivity(stored));
    let mut written = vec![named(stem, ".pvd")];
    let mut collection = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\"><Collection>\n",
    );
    for row in 0..stored.t.len() {
        let path = named(stem, &format!("-{row:06}.vtu"));
        let mut out = format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"0.1\">\n<UnstructuredGrid>\n\
             <Piece NumberOfPoints=\"{n_nodes}\" NumberOfCells=\"{n_cells}\">\n<PointData>\n"
        );
        for (name, values) in point_fields(stored, row) {
            let _ = writeln!(
                out,
                "<DataArray type=\"Float64\" Name=\"{name}\" NumberOfComponents=\"3\" format=\"ascii\">{values}</DataArray>"
            );
        }
        let _ = writeln!(
            out,
            "</PointData>\n<Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">{points}</DataArray></Points>\n\
             <Cells>\n<DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">{connectivity}</DataArray>\n\
             <DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">{offsets}</DataArray>\n\
             <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">{kind}</DataArray>\n</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>"
        );
        std::fs::write(&path, out)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let _ = writeln!(
            collection,
            "<DataSet timestep=\"{:e}\" file=\"{}\"/>",
            stored.t[row],
            escape(&name)
        );
        written.push(path);
    }
    collection.push_str("</Collection></VTKFile>\n");
    std::fs::write(&written[0], collection)?;
    Ok(written)
}

/// `STEM.xdmf` with all stored states, numbers inline.
pub fn xdmf(stored: &Stored, stem: &Path) -> io::Result<Vec<PathBuf>> {
    let (n_nodes, n_cells, per_cell) =
        (stored.nodes.nrows(), stored.elements.nrows(), stored.elements.ncols());
    let topology = if per_cell == 2 { "Polyline\" NodesPerElement=\"2" } else { "Quadrilateral" };
    let (points, connectivity) = (points(stored), connectivity(stored));
    let mut out = format!(
        "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\"><Domain><Grid Name=\"{}\" GridType=\"Collection\" CollectionType=\"Temporal\">\n",
        escape(&stored.title)
    );
    for row in 0..stored.t.len() {
        let _ = write!(
            out,
            "<Grid Name=\"state {row}\"><Time Value=\"{:e}\"/>\n\
             <Topology TopologyType=\"{topology}\" NumberOfElements=\"{n_cells}\"><DataItem Format=\"XML\" NumberType=\"Int\" Dimensions=\"{n_cells} {per_cell}\">{connectivity}</DataItem></Topology>\n\
             <Geometry GeometryType=\"XYZ\"><DataItem Format=\"XML\" NumberType=\"Float\" Precision=\"8\" Dimensions=\"{n_nodes} 3\">{points}</DataItem></Geometry>\n",
            stored.t[row]
        );
        for (name, values) in point_fields(stored, row) {
            let _ = writeln!(
                out,
                "<Attribute Name=\"{name}\" AttributeType=\"Vector\" Center=\"Node\"><DataItem Format=\"XML\" NumberType=\"Float\" Precision=\"8\" Dimensions=\"{n_nodes} 3\">{values}</DataItem></Attribute>"
            );
        }
        out.push_str("</Grid>\n");
    }
    out.push_str("</Grid></Domain></Xdmf>\n");
    let path = named(stem, ".xdmf");
    std::fs::write(&path, out)?;
    Ok(vec![path])
}

/// Text for XML, which knows no control characters.
fn escape(text: &str) -> String {
    let text: String = text.chars().filter(|c| !c.is_control()).collect();
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
