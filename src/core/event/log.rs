//! The switches and grazings of a run: counted, and listed where the observer does not take them.

use super::checkpoint::Checkpoint;
use super::observer::Observer;
use super::switch::{Grazing, Switch, SwitchKind};

/// What has happened so far, in order of time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Log {
    counts: [usize; SwitchKind::ALL.len()],
    ends: Option<[Switch; 2]>,
    grazings: usize,
    lists: Option<(Vec<Switch>, Vec<Grazing>)>,
}

impl Log {
    /// Nothing yet; `lists`: everything is kept, not only counted.
    pub fn new(lists: bool) -> Log {
        Log { lists: lists.then(Default::default), ..Log::default() }
    }

    /// Of an earlier part of a run, whose events stand elsewhere: switches of each kind, the first and the last, grazings.
    pub fn counted(
        kinds: impl Iterator<Item = SwitchKind>,
        ends: Option<[Switch; 2]>,
        grazings: usize,
    ) -> Log {
        let mut log = Log { ends, grazings, ..Log::default() };
        kinds.for_each(|kind| log.counts[kind as usize] += 1);
        log
    }

    /// A switch: the observer is told.
    pub fn switch<O: Observer>(&mut self, s: Switch, observer: &mut O) -> Result<(), O::Error> {
        observer.switch(&s)?;
        self.add_switch(s);
        Ok(())
    }

    /// A grazing: the observer is told.
    pub fn grazing<O: Observer>(&mut self, g: Grazing, observer: &mut O) -> Result<(), O::Error> {
        observer.grazing(&g)?;
        self.add_grazing(g);
        Ok(())
    }

    /// A switch.
    pub fn add_switch(&mut self, s: Switch) {
        self.counts[s.kind as usize] += 1;
        match &mut self.ends {
            Some([_, last]) => last.clone_from(&s),
            None => self.ends = Some([s.clone(), s.clone()]),
        }
        if let Some((switches, _)) = &mut self.lists {
            switches.push(s);
        }
    }

    /// A grazing.
    pub fn add_grazing(&mut self, g: Grazing) {
        self.grazings += 1;
        if let Some((_, grazings)) = &mut self.lists {
            grazings.push(g);
        }
    }

    /// Number of switches.
    pub fn switches(&self) -> usize {
        self.counts.iter().sum()
    }

    /// Number of switches of a kind.
    pub fn of_kind(&self, kind: SwitchKind) -> usize {
        self.counts[kind as usize]
    }

    /// The first and the last switch.
    pub fn ends(&self) -> Option<&[Switch; 2]> {
        self.ends.as_ref()
    }

    /// Number of grazings.
    pub fn grazings(&self) -> usize {
        self.grazings
    }

    /// All switches and grazings; none where they were only counted.
    pub(crate) fn into_lists(self) -> (Self, Vec<Switch>, Vec<Grazing>) {
        let (switches, grazings) = self.lists.unwrap_or_default();
        (Log { lists: None, ..self }, switches, grazings)
    }
}

/// A run that goes on.
#[derive(Debug, Clone)]
pub struct Resumed {
    /// Where it stood.
    pub checkpoint: Checkpoint,
    /// Its switches and grazings until there.
    pub log: Log,
}
