//! `/switches` and `/grazings`: their tables, and what an interrupted run reads back from them.

use std::ops::Range;
use std::path::Path;

use hdf5::types::FixedAscii;
use ndarray::Array2;

use super::StoreError;
use super::reader::Careful;
use super::table::{Form, Place, Table};
use crate::contact::{MonitorKind, States, System};
use crate::event::{Grazing, GrazingKind, Log, Switch, SwitchKind};

/// A word in a table.
type Word = FixedAscii<32>;

/// The name of a state or a monitor.
type Name = FixedAscii<8>;

const MONITORS: &str = "gap | pressure | closing | opening";
const STATES: &str = "open | closed";

/// Rows of a chunk: there are few as a rule, and a library that keeps an index of chunks where there are a million.
const CHUNK: usize = 512;

fn word<const N: usize>(text: &str) -> FixedAscii<N> {
    FixedAscii::from_ascii(text.as_bytes()).unwrap_or_default()
}

/// The open tables of switches and grazings.
pub(super) struct Events {
    switch_t: Table<f64>,
    switch_node: Table<i64>,
    switch_point: Table<i64>,
    switch_kind: Table<Word>,
    switch_monitor: Table<Name>,
    switch_from: Table<Name>,
    switch_to: Table<Name>,
    switch_rate: Table<f64>,
    switch_jump: Table<f64>,
    switch_before: Table<u8>,
    switch_after: Table<u8>,
    grazing_t: Table<f64>,
    grazing_node: Table<i64>,
    grazing_distance: Table<f64>,
    grazing_kind: Table<Word>,
}

impl Events {
    /// Create both groups, for `n_c` contact nodes.
    pub fn create(file: &hdf5::File, n_c: usize) -> Result<Self, StoreError> {
        let s = file.create_group("switches")?;
        let set =
            |name: &str| Table::create(&s, name, Form::plain(Some(n_c), CHUNK), "1 = contact");
        let form = Form::plain(None, CHUNK);
        let rate_units = "length/time (close) | stress/time (open)";
        let switch_t = Table::create(&s, "t", form, "time")?;
        let switch_node = Table::create(&s, "node", form, "mesh node")?;
        let switch_kind = Table::create(&s, "kind", form, "close | open | impact | rest")?;
        let switch_point = Table::create(&s, "point", form, "contact point")?;
        let switch_monitor = Table::create(&s, "monitor", form, MONITORS)?;
        let switch_from = Table::create(&s, "from", form, STATES)?;
        let switch_to = Table::create(&s, "to", form, STATES)?;
        let switch_rate = Table::create(&s, "monitor_rate", form, rate_units)?;
        let switch_jump = Table::create(&s, "energy_jump", form, "energy")?;
        let (switch_before, switch_after) = (set("active_before")?, set("active_after")?);
        let g = file.create_group("grazings")?;
        let distance_units = "length (gap) | stress (pressure)";
        Ok(Events {
            switch_t,
            switch_node,
            switch_point,
            switch_kind,
            switch_monitor,
            switch_from,
            switch_to,
            switch_rate,
            switch_jump,
            switch_before,
            switch_after,
            grazing_t: Table::create(&g, "t", form, "time")?,
            grazing_node: Table::create(&g, "node", form, "mesh node")?,
            grazing_distance: Table::create(&g, "distance", form, distance_units)?,
            grazing_kind: Table::create(&g, "kind", form, "words")?,
        })
    }

    /// Go on with the tables of a file.
    pub(crate) fn reopen(
        file: &hdf5::File,
        switches: Place,
        grazings: Place,
    ) -> Result<Self, StoreError> {
        let s = file.group("switches")?;
        let g = file.group("grazings")?;
        if !s.link_exists("point") {
            let why = "its switches have the columns of an earlier version of the program: start anew with --force";
            return Err(StoreError::unusable(Path::new(&file.filename()), why));
        }
        Ok(Events {
            switch_t: Table::reopen(&s, "t", switches)?,
            switch_node: Table::reopen(&s, "node", switches)?,
            switch_point: Table::reopen(&s, "point", switches)?,
            switch_kind: Table::reopen(&s, "kind", switches)?,
            switch_monitor: Table::reopen(&s, "monitor", switches)?,
            switch_from: Table::reopen(&s, "from", switches)?,
            switch_to: Table::reopen(&s, "to", switches)?,
            switch_rate: Table::reopen(&s, "monitor_rate", switches)?,
            switch_jump: Table::reopen(&s, "energy_jump", switches)?,
            switch_before: Table::reopen(&s, "active_before", switches)?,
            switch_after: Table::reopen(&s, "active_after", switches)?,
            grazing_t: Table::reopen(&g, "t", grazings)?,
            grazing_node: Table::reopen(&g, "node", grazings)?,
            grazing_distance: Table::reopen(&g, "distance", grazings)?,
            grazing_kind: Table::reopen(&g, "kind", grazings)?,
        })
    }

    pub fn switch(&mut self, s: &Switch) {
        self.switch_t.push(&[s.t]);
        self.switch_node.push(&[s.node as i64]);
        self.switch_point.push(&[s.point as i64]);
        self.switch_monitor.push(&[word(s.monitor.word())]);
        self.switch_from.push(&[word(s.from().word())]);
        self.switch_to.push(&[word(s.to().word())]);
        self.switch_kind.push(&[word(s.kind.name())]);
        self.switch_rate.push(&[s.monitor_rate]);
        self.switch_jump.push(&[s.energy_jump]);
        self.switch_before.push(&codes(&s.before));
        self.switch_after.push(&codes(&s.after));
    }

    pub fn grazing(&mut self, g: &Grazing) {
        self.grazing_t.push(&[g.t]);
        self.grazing_node.push(&[g.node as i64]);
        self.grazing_distance.push(&[g.distance]);
        self.grazing_kind.push(&[word(g.kind.name())]);
    }

    /// Bytes of all rows that wait.
    pub(crate) fn waiting_bytes(&self) -> u64 {
        let numbers = [
            &self.switch_t,
            &self.switch_rate,
            &self.switch_jump,
            &self.grazing_t,
            &self.grazing_distance,
        ];
        let numbers = numbers.map(Table::waiting_bytes);
        let states = [&self.switch_before, &self.switch_after].map(Table::waiting_bytes);
        let nodes = [&self.switch_node, &self.switch_point, &self.grazing_node];
        let nodes = nodes.map(Table::waiting_bytes);
        let names = [&self.switch_monitor, &self.switch_from, &self.switch_to];
        let names = names.map(Table::waiting_bytes);
        let words = [&self.switch_kind, &self.grazing_kind].map(Table::waiting_bytes);
        numbers.into_iter().chain(states).chain(nodes).chain(names).chain(words).sum()
    }

    /// Append all rows that wait.
    pub fn append(&mut self) -> Result<(), StoreError> {
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
        for table in [&mut self.switch_node, &mut self.switch_point, &mut self.grazing_node] {
            table.append()?;
        }
        for table in [&mut self.switch_monitor, &mut self.switch_from, &mut self.switch_to] {
            table.append()?;
        }
        for table in [&mut self.switch_kind, &mut self.grazing_kind] {
            table.append()?;
        }
        Ok(())
    }
}

/// A row of a table of states.
pub(super) fn codes(states: &States) -> Vec<u8> {
    states.codes().collect()
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
