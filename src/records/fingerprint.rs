//! What a result hangs on beside the text of its scene, as one number: whoever goes on with a file asks whether both are what they were.
//!
//! Two halves that overlap on purpose. The numbers of the problem know everything that reaches the equations, from wherever it came (a file, a matrix that a
//! program gives, a damping ratio in place of another); the contents of the files that the scene names know what a key to come may read from them. Of
//! HDF5 files the numbers alone count: they hold times and commands, which change when the same result is written again.

use std::fs::File;
use std::hash::Hasher;
use std::io::Read;
use std::path::Path;

use siphasher::sip::SipHasher13;

use crate::contact::System;
use crate::fem::{Csr, Loads};
use crate::problem::Problem;
use crate::scenario::Scene;

/// The first bytes of an HDF5 file.
const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";

/// All numbers of a problem, and the contents of the files that its scene names, as one number; the same on every machine.
pub fn fingerprint(scene: &Scene, problem: &Problem) -> u64 {
    let mut sum = Sum(SipHasher13::new());
    sum.system(&problem.system);
    sum.loads(&problem.system.loads);
    sum.numbers(&problem.initial.u);
    sum.numbers(&problem.initial.v);
    for file in scene.files() {
        // a file that cannot be read any more is another than one that could
        let is_read = sum.file(&file).is_ok();
        sum.0.write_u8(u8::from(is_read));
    }
    sum.0.finish()
}

/// A checksum in the making (SipHash 1-3, no key); lists begin with their length, so that none runs into the next.
struct Sum(SipHasher13);

impl Sum {
    fn count(&mut self, n: usize) {
        self.0.write(&(n as u64).to_le_bytes());
    }

    fn number(&mut self, x: f64) {
        self.0.write(&x.to_bits().to_le_bytes());
    }

    fn numbers(&mut self, x: &[f64]) {
        self.count(x.len());
        x.iter().for_each(|x| self.number(*x));
    }

    fn row(&mut self, row: &[(usize, f64)]) {
        self.count(row.len());
        for (j, v) in row {
            self.count(*j);
            self.number(*v);
        }
    }

    fn matrix(&mut self, a: &Csr) {
        self.count(a.n_rows());
        self.count(a.n_cols());
        for (i, j, v) in a.triplets() {
            self.count(i);
            self.count(j);
            self.number(v);
        }
    }

    /// Body, elements, contact points, their conditions, damping.
    fn system(&mut self, system: &System) {
        let (body, conditions) = (&system.body, system.conditions());
        let matrices = [&body.mass, &body.stiffness, &conditions.n_o, conditions.n_c.rows()];
        matrices.into_iter().for_each(|a| self.matrix(a));
        body.structure.iter().for_each(|a| self.matrix(a));
        system.obstacle_rows().iter().flatten().for_each(|a| self.matrix(a));
        self.0.write(system.method_name().as_bytes());
        body.mesh.nodes().iter().for_each(|x| self.numbers(x));
        for block in body.mesh.blocks() {
            self.0.write(format!("{:?}", block.kind).as_bytes());
            self.count(block.region);
            self.count(block.connectivity.len());
            block.connectivity.iter().for_each(|n| self.count(*n));
        }
        self.numbers(&conditions.gap);
        self.numbers(&conditions.area);
        for (c, factor) in &conditions.points {
            self.count(*c);
            self.number(*factor);
        }
        for c in &system.constraints {
            self.count(c.node);
            self.count(c.group);
            self.numbers(&c.position);
            self.numbers(&c.normal);
            self.numbers(&[c.gap, c.area, c.stiffness]);
        }
        let damping = system.damping.map(|d| [d.alpha, d.beta]);
        self.numbers(damping.as_ref().map_or(&[], |d| &d[..]));
        system.dampers.iter().for_each(|d| self.matrix(d.rows()));
        for t in system.tangents().iter().flat_map(|all| all.iter()).flatten() {
            self.row(&t.row);
            self.numbers(&[t.coefficient, t.surface]);
        }
        for s in system.sliders() {
            let elastic = s.elastic.map(|e| (e.stiffness, e.memory));
            self.numbers(&[s.limit, elastic.map_or(0.0, |e| e.0)]);
            self.count(elastic.map_or(0, |e| e.1));
        }
    }

    /// Vectors, frequencies, phases and histories.
    fn loads(&mut self, loads: &Loads) {
        self.numbers(loads.constant.as_deref().unwrap_or_default());
        self.count(loads.harmonics.len());
        for h in &loads.harmonics {
            self.numbers(&h.force);
            self.numbers(&[h.omega, h.phase, f64::from(h.derivative)]);
            if h.damps {
                self.count(1);
            }
        }
        self.count(loads.measured.len());
        for m in &loads.measured {
            self.numbers(&m.force);
            self.numbers(m.history.times());
            self.numbers(m.history.values());
            self.number(f64::from(m.derivative));
        }
    }

    /// What a file holds, unless it is one of HDF5.
    fn file(&mut self, path: &Path) -> std::io::Result<()> {
        let mut file = File::open(path)?;
        let mut bytes = vec![0; 1 << 16];
        let mut is_first = true;
        loop {
            let n = file.read(&mut bytes)?;
            let is_hdf5 = std::mem::take(&mut is_first) && bytes[..n].starts_with(HDF5);
            if n == 0 || is_hdf5 {
                return Ok(());
            }
            self.0.write(&bytes[..n]);
        }
    }
}
