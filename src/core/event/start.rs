//! A run begins, or goes on from a checkpoint.

use super::account::Account;
use super::friction::anchor;
use super::present::Present;
use super::told::Told;
use super::{
    Checkpoint, Done, Evidence, Flow, Layout, Ledger, Observer, Options, Outcome, Resumed, Run,
    Search, State, States, System,
};
use crate::contact::Units;

/// A motion of less than this part of the units of length and frequency is rest.
const AT_REST: f64 = 1e-12;

impl<'a, O: Observer> Run<'a, O> {
    /// The initial active set: from the complementarity problem, then from the velocities.
    pub(super) fn start(
        system: &'a System,
        initial: &State,
        options: &'a Options,
        flow: &'a mut dyn Flow,
        observer: &'a mut O,
    ) -> Done<Self, O> {
        let mut run = Self::blank(system, options, flow, observer)?;
        let n_o = run.now.layout.n_o;
        run.now.y[..n_o].copy_from_slice(&initial.u);
        run.now.y[n_o..2 * n_o].copy_from_slice(&initial.v);
        let open = States::open(system.n_contact());
        if let Some(law) = system.impact() {
            match run.meet_at_start(law)? {
                Ok(set) => run.phase = system.phase(&set),
                Err(nodes) => run.early = Some(Outcome::Unresolved { t: 0.0, nodes }),
            }
            return run.begin();
        }
        let selection = system.select(0.0, run.now.u_o(), &open)?;
        if system.creeps() {
            run.phase = system.phase(&selection.set);
            let states = (&selection.set, &selection.set);
            anchor(system, states, &[], &mut run.now.y[..2 * n_o]);
            run.now.expand(&run.phase);
            match run.adhere(None)? {
                Ok(decision) => run.take_up(&decision),
                Err(outcome) => run.early = Some(outcome),
            }
            return run.begin();
        }
        match run.decide(&selection.set, &selection.degenerate, None)? {
            Ok(decision) => {
                run.note_grazing(&decision, 0.0)?;
                run.take_up(&decision);
            }
            Err(outcome) => {
                run.phase = system.phase(&selection.set);
                run.early = Some(outcome);
            }
        }
        run.begin()
    }

    /// Everything that is noted before the first window.
    fn begin(self) -> Done<Self, O> {
        let mut run = self;
        run.begin_phase();
        run.now.expand(&run.phase);
        run.account.potential_start = run.system.potential(run.now.t, &run.now.u, &run.now.v);
        let energies = run.account.energies(run.system, &run.now);
        let size = run.system.loads.carried.size_of_contact();
        let Units { length, frequency, .. } = run.system.units;
        let still = vec![AT_REST * length * frequency; run.system.n()];
        let least = run.system.kinetic_of_free(&still);
        let ledger = Ledger::new(energies.unwrap_or_default());
        run.account.ledger = ledger.among(size).above(least);
        run.store_sample(energies)?;
        run.told.next_sample = 1;
        run.tell_checkpoint();
        Ok(run)
    }

    /// A run at the beginning of the phase of a checkpoint.
    pub(super) fn resume(
        system: &'a System,
        resumed: Resumed,
        options: &'a Options,
        flow: &'a mut dyn Flow,
        observer: &'a mut O,
    ) -> Done<Self, O> {
        let Resumed { checkpoint: c, log } = resumed;
        let mut run = Self::blank(system, options, flow, observer)?;
        (run.now.t, run.now.y) = (c.t, c.y);
        run.phase = system.held_phase(&c.states, &c.held);
        run.search.armed = c.armed;
        run.told.recent = c.recent.into();
        run.account.ledger = Ledger::of_numbers(c.ledger);
        (run.account.potential_start, run.told.last_stored) = (c.potential_start, c.last_stored);
        (run.seen.largest_u, run.seen.largest_v) = (c.seen.largest_u, c.seen.largest_v);
        run.resume_phase(&c.flow);
        // what the beginning of the phase counts is in these numbers already
        let Evidence { largest_u, largest_v, .. } = run.seen;
        run.seen = Evidence { largest_u, largest_v, ..c.seen };
        (run.told.next_sample, run.told.phases) = (c.next_sample, c.phases);
        run.told.stored = c.rows[0];
        run.told.log = log;
        run.now.expand(&run.phase);
        run.tell_checkpoint();
        Ok(run)
    }

    /// A run without a state.
    pub(super) fn blank(
        system: &'a System,
        options: &'a Options,
        flow: &'a mut dyn Flow,
        observer: &'a mut O,
    ) -> Done<Self, O> {
        let lists = !observer.takes_events();
        Ok(Run {
            system,
            options,
            flow,
            observer,
            scratch: system.scratch(),
            phase: system.open_phase(),
            now: Present::new(Layout::new(system), system.n()),
            search: Search {
                slack: vec![],
                rounding: vec![],
                least: vec![],
                armed: vec![true; system.n_contact()],
                blind: false,
            },
            account: Account::default(),
            told: Told::nothing(lists, system.frequency_bound()),
            seen: Evidence { largest_u: system.units.length, ..Evidence::default() },
            early: None,
        })
    }

    /// Tell the observer where the run can go on from: the beginning of the present phase.
    pub(super) fn tell_checkpoint(&mut self) {
        // of a body of which only a part is known none goes on
        if !self.observer.keeps_checkpoints() || self.now.near.is_some() {
            return;
        }
        let checkpoint = Checkpoint {
            t: self.now.t,
            y: self.now.y.clone(),
            states: self.phase.set.clone(),
            held: self.phase.held.clone(),
            armed: self.search.armed.clone(),
            recent: self.told.recent.iter().copied().collect(),
            ledger: self.account.ledger.numbers(),
            seen: self.seen.clone(),
            potential_start: self.account.potential_start,
            last_stored: self.told.last_stored,
            next_sample: self.told.next_sample,
            phases: self.told.phases,
            flow: self.flow.memory(),
            rows: [self.told.stored, self.told.log.switches(), self.told.log.grazings()],
        };
        self.observer.phase(checkpoint);
    }
}
