//! Writing a trajectory while it is computed.

use std::ops::ControlFlow;
use std::path::Path;
use std::time::{Duration, Instant};

use hdf5::types::FixedAscii;

use super::checkpoint;
use super::output::{Outputs, Staged, check_room};
use super::reader::{Careful, reading};
use super::table::Table;
use super::{StoreError, write_text};
use crate::contact::{ActiveSet, System};
use crate::event::{
    Checkpoint, Grazing, GrazingKind, Observer, Resumed, Sample, Switch, SwitchKind,
};
use crate::fem::DofMap;
use crate::records::Status;
use crate::scenario::Scene;

type Word = FixedAscii<32>;

/// Aim of a chunk's size in bytes.
const CHUNK_BYTES: usize = 256 * 1024;
/// Tables that are not compressed are appended and flushed at least this often.
const FLUSH_EVERY: Duration = Duration::from_secs(2);

/// How a file is made.
#[derive(Debug, Clone, Default)]
pub struct WriterOptions {
    /// What may be written where.
    pub outputs: Outputs,
    /// The command line, for the record.
    pub command: String,
}

/// The open file of a run.
pub struct Writer {
    staged: Staged,
    file: hdf5::File,
    dofs: DofMap,
    u: Table<f64>,
    v: Table<f64>,
    t: Table<f64>,
    active: Table<u8>,
    pressure: Table<f64>,
    energy: Vec<Table<f64>>,
    switch_t: Table<f64>,
    switch_node: Table<i64>,
    switch_kind: Table<Word>,
    switch_rate: Table<f64>,
    switch_jump: Table<f64>,
    switch_before: Table<u8>,
    switch_after: Table<u8>,
    grazing_t: Table<f64>,
    grazing_node: Table<i64>,
    grazing_distance: Table<f64>,
    grazing_kind: Table<Word>,
    flushed: Instant,
    problem: u64,
    checkpoint: Option<Checkpoint>,
}

const ENERGY: [&str; 6] = ["t", "kinetic", "elastic", "external", "dissipated", "jumps"];

fn word(text: &str) -> Word {
    Word::from_ascii(text.as_bytes()).unwrap_or_default()
}

fn flags(set: &ActiveSet) -> Vec<u8> {
    set.flags().iter().map(|&a| u8::from(a)).collect()
}

impl Writer {
    /// Create the file with everything that is known before the run.
    pub fn create(
        path: &Path,
        scene: &Scene,
        system: &System,
        options: &WriterOptions,
    ) -> Result<Writer, StoreError> {
        let staged = Staged::begin(&options.outputs, path)?;
        // a file that could not even be begun is of no use, and an old one stands untouched
        Self::begin(staged, scene, system, options)
    }

    fn begin(
        staged: Staged,
        scene: &Scene,
        system: &System,
        options: &WriterOptions,
    ) -> Result<Writer, StoreError> {
        let file = check_room(staged.at(), size_of_mesh(system))
            .and_then(|()| create_file(staged.at(), scene, system, options))
            .inspect_err(|_| staged.discard())?;
        let dofs = system.body.dofs.clone();
        let (n, n_c) = (system.n(), system.n_contact());
        let chunk = (CHUNK_BYTES / (8 * n.max(1))).clamp(1, 1024);
        let g = file.create_group("trajectory")?;
        let column = |name: &str, columns, compressed, units: &str| {
            Table::<f64>::create(&g, name, columns, chunk, compressed, units)
        };
        let t = column("t", None, false, "time")?;
        let u = column("u", Some(n), true, "length")?;
        let v = column("v", Some(n), true, "length/time")?;
        let pressure = column("pressure", Some(n_c), true, "stress")?;
        let active = Table::create(&g, "active", Some(n_c), chunk, true, "1 = contact")?;
        let g = file.create_group("energy")?;
        let units = |name: &str| if name == "t" { "time" } else { "energy" };
        let energy: Result<Vec<_>, _> = ENERGY
            .iter()
            .map(|name| Table::create(&g, name, None, chunk, false, units(name)))
            .collect();

        let g = file.create_group("switches")?;
        let few = 64;
        let switch_t = Table::create(&g, "t", None, few, false, "time")?;
        let switch_node = Table::create(&g, "node", None, few, false, "mesh node")?;
        let switch_kind = Table::create(&g, "kind", None, few, false, "close | open")?;
        let rate_units = "length/time (close) | stress/time (open)";
        let switch_rate = Table::create(&g, "monitor_rate", None, few, false, rate_units)?;
        let switch_jump = Table::create(&g, "energy_jump", None, few, false, "energy")?;
        let set_units = "1 = contact";
        let switch_before = Table::create(&g, "active_before", Some(n_c), few, false, set_units)?;
        let switch_after = Table::create(&g, "active_after", Some(n_c), few, false, set_units)?;
        let g = file.create_group("grazings")?;
        let grazing_t = Table::create(&g, "t", None, few, false, "time")?;
        let grazing_node = Table::create(&g, "node", None, few, false, "mesh node")?;
        let grazing_distance =
            Table::create(&g, "distance", None, few, false, "length (gap) | stress (pressure)")?;
        let grazing_kind = Table::create(&g, "kind", None, few, false, "words")?;
        file.flush()?;
        Ok(Writer {
            staged,
            file,
            dofs,
            u,
            v,
            t,
            active,
            pressure,
            energy: energy?,
            switch_t,
            switch_node,
            switch_kind,
            switch_rate,
            switch_jump,
            switch_before,
            switch_after,
            grazing_t,
            grazing_node,
            grazing_distance,
            grazing_kind,
            flushed: Instant::now(),
            problem: 0,
            checkpoint: None,
        })
    }

    /// From now on the run can be gone on with after an interruption, as long as `problem`, the fingerprint of what is integrated, is
    /// the same.
    pub fn keep_checkpoints(&mut self, problem: u64) {
        self.problem = problem;
        self.checkpoint = None;
    }

    /// Open the file of a run that was interrupted, cut back to its checkpoint, and what the run needs to go on.
    pub fn resume(
        path: &Path,
        scene: &Scene,
        system: &System,
        options: &WriterOptions,
        problem: u64,
    ) -> Result<(Writer, Resumed), StoreError> {
        let mut staged = Staged::begin(&options.outputs.with_force(true), path)?;
        // a run over an old file was writing beside it
        if !checkpoint::name_of(staged.at()).exists() {
            staged.in_place();
        }
        let at = staged.at().to_owned();
        let (checkpoint, of) = checkpoint::read(&at)?;
        let refuse = |why: &str| {
            StoreError::unusable(&at, format!("cannot be gone on with: {why}; --force starts anew"))
        };
        if of != problem
            || checkpoint.y.len() < 2 * system.n_o()
            || checkpoint.armed.len() != system.n_contact()
        {
            return Err(refuse("the files that the scene names have changed since"));
        }
        let opened = || -> Result<(Writer, Resumed), StoreError> {
            let file = hdf5::File::open_rw(&at)?;
            if super::read_text(&file, "scene").as_deref() != Some(&scene.source.text) {
                return Err(refuse("it was made from another scene"));
            }
            let [states, switches, grazings] = checkpoint.rows;
            let g = file.group("trajectory")?;
            let column = |name: &str| Table::<f64>::reopen(&g, name, states);
            let (t, u, v, pressure) =
                (column("t")?, column("u")?, column("v")?, column("pressure")?);
            let active = Table::reopen(&g, "active", states)?;
            let g = file.group("energy")?;
            let energy: Result<Vec<_>, _> =
                ENERGY.iter().map(|name| Table::reopen(&g, name, states)).collect();
            let s = file.group("switches")?;
            let g = file.group("grazings")?;
            write_text(&file, "status", &Status::Running.to_string())?;
            let writer = Writer {
                dofs: system.body.dofs.clone(),
                u,
                v,
                t,
                active,
                pressure,
                energy: energy?,
                switch_t: Table::reopen(&s, "t", switches)?,
                switch_node: Table::reopen(&s, "node", switches)?,
                switch_kind: Table::reopen(&s, "kind", switches)?,
                switch_rate: Table::reopen(&s, "monitor_rate", switches)?,
                switch_jump: Table::reopen(&s, "energy_jump", switches)?,
                switch_before: Table::reopen(&s, "active_before", switches)?,
                switch_after: Table::reopen(&s, "active_after", switches)?,
                grazing_t: Table::reopen(&g, "t", grazings)?,
                grazing_node: Table::reopen(&g, "node", grazings)?,
                grazing_distance: Table::reopen(&g, "distance", grazings)?,
                grazing_kind: Table::reopen(&g, "kind", grazings)?,
                flushed: Instant::now(),
                problem,
                checkpoint: Some(checkpoint.clone()),
                file: file.clone(),
                staged,
            };
            let resumed = Resumed {
                switches: read_switches(&file, system)?,
                grazings: read_grazings(&file, system)?,
                checkpoint: checkpoint.clone(),
            };
            Ok((writer, resumed))
        };
        reading(&at, opened)
    }

    /// Whether there is a run at `path` that can be gone on with.
    pub fn is_interrupted(path: &Path) -> bool {
        let beside = super::output::beside(path, ".part");
        [path, &beside].iter().any(|p| checkpoint::name_of(p).exists())
    }

    /// The file as it is named now: beside an old one until it is whole.
    pub fn at(&self) -> &Path {
        self.staged.at()
    }

    /// The file, for what else belongs into it.
    pub(super) fn file(&self) -> &hdf5::File {
        &self.file
    }

    /// Append and flush all rows that wait.
    fn flush(&mut self) -> Result<(), StoreError> {
        check_room(self.staged.at(), self.waiting())?;
        for table in [&mut self.t, &mut self.u, &mut self.v, &mut self.pressure] {
            table.append()?;
        }
        self.active.append()?;
        self.energy.iter_mut().try_for_each(|t| t.append())?;
        self.append_events()?;
        self.file.flush()?;
        self.flushed = Instant::now();
        match &self.checkpoint {
            Some(c) => checkpoint::write(self.staged.at(), self.problem, c),
            None => Ok(()),
        }
    }

    /// Bytes of all rows that wait.
    fn waiting(&self) -> u64 {
        let numbers = [&self.t, &self.u, &self.v, &self.pressure];
        let more = [
            &self.switch_t,
            &self.switch_rate,
            &self.switch_jump,
            &self.grazing_t,
            &self.grazing_distance,
        ];
        let numbers = numbers.into_iter().chain(&self.energy).chain(more).map(Table::waiting_bytes);
        let flags =
            [&self.active, &self.switch_before, &self.switch_after].map(Table::waiting_bytes);
        let nodes = [&self.switch_node, &self.grazing_node].map(Table::waiting_bytes);
        let words = [&self.switch_kind, &self.grazing_kind].map(Table::waiting_bytes);
        numbers.chain(flags).chain(nodes).chain(words).sum()
    }

    fn append_events(&mut self) -> Result<(), StoreError> {
        for table in [
            &mut self.switch_t,
            &mut self.switch_rate,
            &mut self.switch_jump,
            &mut self.grazing_t,
            &mut self.grazing_distance,
        ] {
            table.append()?;
        }
        for table in [&mut self.switch_before, &mut self.switch_after] {
            table.append()?;
        }
        for table in [&mut self.switch_node, &mut self.grazing_node] {
            table.append()?;
        }
        for table in [&mut self.switch_kind, &mut self.grazing_kind] {
            table.append()?;
        }
        Ok(())
    }

    /// Give the file up: nothing of it is worth keeping.
    pub fn discard(self) {
        let Writer { staged, file, .. } = self;
        drop(file);
        staged.discard();
    }

    /// Write what waits and the final status.
    pub fn finish(mut self, status: &Status) -> Result<(), StoreError> {
        self.flush()?;
        write_text(&self.file, "status", &status.to_string())?;
        self.file.flush()?;
        let Writer { mut staged, file, checkpoint, problem, .. } = self;
        drop(file);
        let old = checkpoint::name_of(staged.at());
        staged.commit()?;
        let name = checkpoint::name_of(staged.at());
        match checkpoint.filter(|_| *status == Status::Interrupted) {
            Some(c) => {
                checkpoint::write(staged.at(), problem, &c)?;
                if old != name {
                    let _ = std::fs::remove_file(old);
                }
            }
            // there is nothing to go on with; a checkpoint that stays does no harm
            None => {
                let _ = (std::fs::remove_file(old), std::fs::remove_file(name));
            }
        }
        Ok(())
    }
}

fn sets(file: &hdf5::File, name: &str) -> Result<Vec<ActiveSet>, StoreError> {
    let rows: ndarray::Array2<u8> = file.dataset(name)?.table()?;
    let set = |r: ndarray::ArrayView1<u8>| ActiveSet::new(r.iter().map(|&a| a == 1).collect());
    Ok(rows.rows().into_iter().map(set).collect())
}

/// Contact node of a mesh node.
fn contact_of(system: &System, node: i64) -> usize {
    system.body.dofs.contact_nodes.iter().position(|&n| n as i64 == node).unwrap_or(0)
}

fn read_switches(file: &hdf5::File, system: &System) -> Result<Vec<Switch>, StoreError> {
    let numbers = |name: &str| -> Result<Vec<f64>, StoreError> {
        Ok(file.dataset(&format!("switches/{name}"))?.values()?)
    };
    let (t, rate, jump) = (numbers("t")?, numbers("monitor_rate")?, numbers("energy_jump")?);
    let node: Vec<i64> = file.dataset("switches/node")?.values()?;
    let kind: Vec<Word> = file.dataset("switches/kind")?.values()?;
    let (before, after) =
        (sets(file, "switches/active_before")?, sets(file, "switches/active_after")?);
    let switch = |k: usize| Switch {
        t: t[k],
        contact: contact_of(system, node[k]),
        node: node[k] as usize,
        kind: if kind[k].as_str() == "close" { SwitchKind::Close } else { SwitchKind::Open },
        monitor_rate: rate[k],
        energy_jump: jump[k],
        before: before[k].clone(),
        after: after[k].clone(),
    };
    Ok((0..t.len()).map(switch).collect())
}

fn read_grazings(file: &hdf5::File, system: &System) -> Result<Vec<Grazing>, StoreError> {
    let t: Vec<f64> = file.dataset("grazings/t")?.values()?;
    let distance: Vec<f64> = file.dataset("grazings/distance")?.values()?;
    let node: Vec<i64> = file.dataset("grazings/node")?.values()?;
    let kind: Vec<Word> = file.dataset("grazings/kind")?.values()?;
    let grazing = |k: usize| Grazing {
        t: t[k],
        contact: contact_of(system, node[k]),
        node: node[k] as usize,
        distance: distance[k],
        kind: GrazingKind::of_name(kind[k].as_str()).unwrap_or(GrazingKind::NearMiss),
    };
    Ok((0..t.len()).map(grazing).collect())
}

/// `u_C` points along the outward normal; files hold displacements along the axes.
pub(super) fn along_axes(dofs: &DofMap, x: &[f64]) -> Vec<f64> {
    let mut x = x.to_vec();
    x[dofs.n_o..].iter_mut().for_each(|x| *x *= dofs.contact_sign);
    x
}

/// Bytes that the mesh and the attributes of a file take at the most.
pub(super) fn size_of_mesh(system: &System) -> u64 {
    let mesh = &system.body.mesh;
    let numbers: usize = mesh.blocks().iter().map(|b| b.connectivity.len()).sum();
    (40 * mesh.n_nodes() + 8 * numbers + (64 << 10)) as u64
}

/// A new file with everything that every file says of its origin, and the mesh.
pub(super) fn create_file(
    path: &Path,
    scene: &Scene,
    system: &System,
    options: &WriterOptions,
) -> Result<hdf5::File, StoreError> {
    let file = hdf5::File::create(path)
        .map_err(|e| StoreError::write(path, std::io::Error::other(e.to_string())))?;
    write_text(&file, "signorini_version", env!("CARGO_PKG_VERSION"))?;
    write_text(&file, "title", &scene.title)?;
    write_text(&file, "scene", &scene.source.text)?;
    write_text(&file, "scene_file", &scene.source.file.display().to_string())?;
    write_text(&file, "command", &options.command)?;
    write_text(&file, "created", &timestamp())?;
    write_text(&file, "status", &Status::Running.to_string())?;
    write_mesh(&file, system)?;
    Ok(file)
}

fn write_mesh(file: &hdf5::File, system: &System) -> Result<(), StoreError> {
    let (mesh, dofs) = (&system.body.mesh, &system.body.dofs);
    let g = file.create_group("mesh")?;
    let array = |rows: usize, columns: usize, values: Vec<i64>| {
        ndarray::Array2::from_shape_vec((rows, columns), values)
            .map_err(|e| hdf5::Error::from(e.to_string()))
    };
    let nodes: Vec<f64> = mesh.nodes().iter().flat_map(|p| [p[0], p[1]]).collect();
    let nodes = ndarray::Array2::from_shape_vec((mesh.n_nodes(), 2), nodes)
        .map_err(|e| hdf5::Error::from(e.to_string()))?;
    g.new_dataset_builder().with_data(&nodes).create("nodes")?;
    // elements with fewer nodes than others are filled up with −1
    let width = mesh.blocks().iter().map(|b| b.kind.nodes()).max().unwrap_or(0);
    let elements = mesh
        .elements()
        .flat_map(|e| (0..width).map(move |k| e.nodes.get(k).map_or(-1, |&n| n as i64)));
    let elements = array(mesh.n_elements(), width, elements.collect())?;
    g.new_dataset_builder().with_data(&elements).create("elements")?;
    let index = |n: usize, c: usize| match (c < mesh.dim()).then(|| dofs.of(n, c)).flatten() {
        Some((i, _)) => i as i64,
        None => -1,
    };
    let map = (0..mesh.n_nodes()).flat_map(|n| [index(n, 0), index(n, 1)]).collect();
    g.new_dataset_builder().with_data(&array(mesh.n_nodes(), 2, map)?).create("dof_map")?;
    let contact_nodes: Vec<i64> = dofs.contact_nodes.iter().map(|&n| n as i64).collect();
    g.new_dataset_builder().with_data(&contact_nodes).create("contact_nodes")?;
    let contact_dofs: Vec<i64> = (dofs.n_o..dofs.n()).map(|i| i as i64).collect();
    g.new_dataset_builder().with_data(&contact_dofs).create("contact_dofs")?;
    g.new_dataset_builder().with_data(&system.gaps()).create("gap")?;
    let area: Vec<f64> = system.constraints.iter().map(|c| c.area).collect();
    g.new_dataset_builder().with_data(&area).create("contact_area")?;
    for (name, key, text) in [
        ("nodes", "units", "length"),
        ("gap", "units", "length along the outward normal"),
        ("dof_map", "meaning", "index into u of the x and y displacement, -1 prescribed"),
    ] {
        let dataset = g.dataset(name)?;
        write_text(&dataset, key, text)?;
    }
    let normal = if dofs.contact_sign > 0.0 { ["+x", "+y"] } else { ["-x", "-y"] };
    write_text(&g, "contact_normal", normal[dofs.contact_axis])
}

/// Seconds since 1970 as an ISO 8601 time in UTC.
fn timestamp() -> String {
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    let seconds = now.map_or(0, |d| d.as_secs());
    let (days, rest) = ((seconds / 86_400) as i64, seconds % 86_400);
    // civil date from days (Howard Hinnant's algorithm)
    let z = days + 719_468;
    let era = z.div_euclid(146_097);
    let doe = z.rem_euclid(146_097);
    let yoe = (doe - doe / 1_460 + doe / 36_524 - doe / 146_096) / 365;
    let doy = doe - (365 * yoe + yoe / 4 - yoe / 100);
    let mp = (5 * doy + 2) / 153;
    let (day, month) = (doy - (153 * mp + 2) / 5 + 1, if mp < 10 { mp + 3 } else { mp - 9 });
    let year = yoe + era * 400 + i64::from(month <= 2);
    let (h, m, s) = (rest / 3_600, rest / 60 % 60, rest % 60);
    format!("{year:04}-{month:02}-{day:02}T{h:02}:{m:02}:{s:02}Z")
}

impl Observer for Writer {
    type Error = StoreError;

    fn sample(&mut self, s: &Sample) -> Result<(), StoreError> {
        self.t.push(&[s.t]);
        let (u, v) = (along_axes(&self.dofs, s.u), along_axes(&self.dofs, s.v));
        self.u.push(&u);
        self.v.push(&v);
        self.active.push(&flags(s.active));
        self.pressure.push(s.pressure);
        let e = &s.energies;
        let row = [s.t, e.kinetic, e.elastic, e.external, e.dissipated, s.jumps];
        self.energy.iter_mut().zip(row).for_each(|(table, x)| table.push(&[x]));
        if self.u.is_full() { self.flush() } else { Ok(()) }
    }

    fn switch(&mut self, s: &Switch) -> Result<(), StoreError> {
        self.switch_t.push(&[s.t]);
        self.switch_node.push(&[s.node as i64]);
        self.switch_kind.push(&[word(s.kind.name())]);
        self.switch_rate.push(&[s.monitor_rate]);
        self.switch_jump.push(&[s.energy_jump]);
        self.switch_before.push(&flags(&s.before));
        self.switch_after.push(&flags(&s.after));
        Ok(())
    }

    fn grazing(&mut self, g: &Grazing) -> Result<(), StoreError> {
        self.grazing_t.push(&[g.t]);
        self.grazing_node.push(&[g.node as i64]);
        self.grazing_distance.push(&[g.distance]);
        self.grazing_kind.push(&[word(g.kind.name())]);
        Ok(())
    }

    fn progress(&mut self, _: f64) -> Result<ControlFlow<()>, StoreError> {
        if self.flushed.elapsed() >= FLUSH_EVERY {
            self.flush()?;
        }
        Ok(ControlFlow::Continue(()))
    }

    fn keeps_checkpoints(&self) -> bool {
        self.problem != 0
    }

    fn phase(&mut self, checkpoint: Checkpoint) {
        self.checkpoint = Some(checkpoint);
    }
}
