//! `/switches` and `/grazings`: their tables, and what an interrupted run reads back from them.

use std::ops::Range;
use std::path::Path;

use hdf5::types::FixedAscii;
use ndarray::Array2;

use super::StoreError;
use super::careful::Careful;
use super::columns::{GRAZINGS, SWITCHES};
use super::schema::Rows;
use super::table::{Form, Resume};
use crate::contact::{MonitorKind, States, System};
use crate::event::{Grazing, GrazingKind, Log, Switch, SwitchKind};

/// A word in a table.
type Word = FixedAscii<32>;

/// The name of a state or a monitor.
type Name = FixedAscii<8>;

/// Rows of a chunk: there are few as a rule, and a library that keeps an index of chunks where there are a million.
const CHUNK: usize = 512;

/// The open tables of switches and grazings.
pub(super) struct Events {
    switches: Rows<Switch>,
    grazings: Rows<Grazing>,
}

impl Events {
    /// Create both groups, for `n_c` contact nodes.
    pub fn create(file: &hdf5::File, n_c: usize) -> Result<Self, StoreError> {
        let switches = Rows::create(file, SWITCHES, &|about| {
            Form::plain((about.axes.len() == 2).then_some(n_c), CHUNK)
        })?;
        let grazings = Rows::create(file, GRAZINGS, &|_| Form::plain(None, CHUNK))?;
        Ok(Events { switches, grazings })
    }

    /// Go on with the tables of a file.
    pub(crate) fn reopen(
        file: &hdf5::File,
        switches: Resume,
        grazings: Resume,
    ) -> Result<Self, StoreError> {
        if !file.group("switches")?.link_exists("point") {
            let why = "its switches have the columns of an earlier version of the program: start anew with --force";
            return Err(StoreError::unusable(Path::new(&file.filename()), why));
        }
        let switches = Rows::reopen(file, SWITCHES, switches)?;
        Ok(Events { switches, grazings: Rows::reopen(file, GRAZINGS, grazings)? })
    }

    pub fn switch(&mut self, s: &Switch) {
        self.switches.push(s);
    }

    pub fn grazing(&mut self, g: &Grazing) {
        self.grazings.push(g);
    }

    /// Bytes of all rows that wait.
    pub(crate) fn waiting_bytes(&self) -> u64 {
        self.switches.waiting_bytes() + self.grazings.waiting_bytes()
    }

    /// Append all rows that wait.
    pub fn append(&mut self) -> Result<(), StoreError> {
        self.switches.append()?;
        self.grazings.append()
    }
}

/// The rows of a table of states.
pub(super) fn read_states(file: &hdf5::Group, name: &str) -> Result<Vec<States>, StoreError> {
    Ok(states_of(&file.dataset(name)?.table()?))
}

fn states_of(rows: &Array2<u8>) -> Vec<States> {
    let set = |r: ndarray::ArrayView1<u8>| States::of_codes(r.iter().copied());
    rows.rows().into_iter().map(set).collect()
}

/// The contact point that files name so.
fn contact_of(system: &System, node: i64) -> usize {
    system.constraints.iter().position(|c| c.node as i64 == node).unwrap_or(0)
}

/// The contact point that switches: that of the node whose flag changes, as a node may have two; without a change (an impact) the first.
pub(super) fn point_of(nodes: &[usize], node: usize, before: &States, after: &States) -> usize {
    let changing = before.changes(after).map(|(i, ..)| i);
    let is_node = |i: &usize| nodes.get(*i) == Some(&node);
    changing.chain(0..nodes.len()).find(is_node).unwrap_or(0)
}

/// So many first switches and grazings: with `lists` all of them, else their number.
pub(super) fn read_log(
    file: &hdf5::File,
    system: &System,
    (count, grazings): (usize, usize),
    lists: bool,
) -> Result<Log, StoreError> {
    if lists {
        let mut log = Log::new(true);
        read_switches(file, system, 0..count)?.into_iter().for_each(|s| log.add_switch(s));
        let all = read_grazings(file, system)?.into_iter().take(grazings);
        all.for_each(|g| log.add_grazing(g));
        return Ok(log);
    }
    let kinds = some::<Word>(file, "kind", &(0..count))?;
    let one = |k: usize| -> Result<Option<Switch>, StoreError> {
        Ok(read_switches(file, system, k..(k + 1).min(count))?.pop())
    };
    let ends = one(0)?.zip(one(count.saturating_sub(1))?).map(|(first, last)| [first, last]);
    let kinds = kinds.iter().map(|k| SwitchKind::of_name(k.as_str()));
    Ok(Log::counted(kinds, ends, grazings))
}

/// Some of the switches so far.
fn read_switches(
    file: &hdf5::File,
    system: &System,
    rows: Range<usize>,
) -> Result<Vec<Switch>, StoreError> {
    let numbers = |name: &str| some::<f64>(file, name, &rows);
    let (t, rate, jump) = (numbers("t")?, numbers("monitor_rate")?, numbers("energy_jump")?);
    let node = some::<i64>(file, "node", &rows)?;
    let kind = some::<Word>(file, "kind", &rows)?;
    let (point, monitor) =
        (some::<i64>(file, "point", &rows)?, some::<Name>(file, "monitor", &rows)?);
    let set = |name: &str| -> Result<Vec<States>, StoreError> {
        let table = file.dataset(&format!("switches/{name}"))?;
        Ok(states_of(&table.read_slice_2d::<u8, _>((rows.clone(), ..))?))
    };
    let (before, after) = (set("active_before")?, set("active_after")?);
    let last = system.n_contact().saturating_sub(1);
    let switch = |k: usize| Switch {
        t: t[k],
        point: usize::try_from(point[k]).unwrap_or(0).min(last),
        monitor: MonitorKind::of_word(monitor[k].as_str()).unwrap_or(MonitorKind::Gap),
        node: node[k] as usize,
        kind: SwitchKind::of_name(kind[k].as_str()),
        monitor_rate: rate[k],
        energy_jump: jump[k],
        struck: vec![],
        before: before[k].clone(),
        after: after[k].clone(),
    };
    Ok((0..rows.len()).map(switch).collect())
}

/// Some rows of a column of the switches.
fn some<T: hdf5::H5Type + Clone>(
    file: &hdf5::File,
    name: &str,
    rows: &Range<usize>,
) -> Result<Vec<T>, StoreError> {
    Ok(file.dataset(&format!("switches/{name}"))?.read_slice_1d::<T, _>(rows.clone())?.to_vec())
}

/// The grazings so far.
fn read_grazings(file: &hdf5::File, system: &System) -> Result<Vec<Grazing>, StoreError> {
    let t: Vec<f64> = file.dataset("grazings/t")?.values()?;
    let distance: Vec<f64> = file.dataset("grazings/distance")?.values()?;
    let node: Vec<i64> = file.dataset("grazings/node")?.values()?;
    let kind: Vec<Word> = file.dataset("grazings/kind")?.values()?;
    let grazing = |k: usize| Grazing {
        t: t[k],
        point: contact_of(system, node[k]),
        node: node[k] as usize,
        distance: distance[k],
        kind: GrazingKind::of_name(kind[k].as_str()).unwrap_or(GrazingKind::NearMiss),
    };
    Ok((0..t.len()).map(grazing).collect())
}
