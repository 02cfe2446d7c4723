//! A contact law of one's own: a magnet that holds a mass back from the moment when it has come near.
//!
//! A law says what a contact displacement does in each state, and by which monitors it leaves. This one pulls with the force `F` and the (negative) stiffness `−k` while the
//! mass is beyond the gap: the motion is in closed form, too.
//!
//!     cargo run --release -p signorini-core --example own_law

use signorini_core::contact::{Conduct, Exit, Law, MonitorKind, PointState, Push, Site, Spring};
use signorini_core::fem::Csr;
use signorini_core::model::{Model, run};

/// Beyond the gap `g` the force `F + k (u − g)` pulls the mass on.
#[derive(Debug)]
struct Magnet {
    pull: f64,
    stiffness: f64,
}

impl Law for Magnet {
    fn name(&self) -> String {
        format!("magnet, F = {}, k = {}", self.pull, self.stiffness)
    }

    fn conduct(&self, state: PointState) -> Conduct {
        match state {
            PointState::Open => Conduct::Moves,
            _ => Conduct::Pushed,
        }
    }

    fn exits(&self, state: PointState) -> &'static [Exit] {
        match state {
            PointState::Open => &[(MonitorKind::Gap, PointState::Closed)],
            _ => &[(MonitorKind::Depth, PointState::Open)],
        }
    }

    fn push(&self, site: &Site) -> Option<Push> {
        let spring = Spring { stiffness: -self.stiffness, preload: -self.pull, share: 1.0 };
        Some(Push::along_normal(site, spring))
    }

    fn dissipates(&self) -> bool {
        false
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let one = |x: f64| Csr::from_triplets(1, 1, vec![(0, 0, x)]);
    let (gap, pull, k) = (0.5, 0.1, 0.5);
    let law = Magnet { pull, stiffness: k };
    let system = Model::matrices(one(1.0), one(1.0), &[0]).gap(gap).law(law).build()?;
    let start = system.state_of(|_| [-1.0, 0.0, 0.0], |_| [0.0; 3]);
    let report = run(&system, &start, 20.0)?;
    println!("{}: {} switches", system.method_name(), report.switches.len());

    // −cos t until it meets the magnet; then ω² = 1 − k about (F − k g)/(1 − k)
    let t1 = (-gap).acos();
    let (w, middle) = ((1.0 - k).sqrt(), (pull - k * gap) / (1.0 - k));
    let contact = 2.0 * ((t1.sin() / w).atan2(gap - middle)) / w;
    let expected = [t1, t1 + contact];
    for (s, t) in report.switches.iter().zip(expected) {
        println!("t = {:.12} ({t:.12}): {} -> {}", s.t, s.before, s.after);
        assert!((s.t - t).abs() < 1e-11);
    }
    assert!(report.energy_drift_total < 1e-12);
    Ok(())
}

#[test]
fn runs() {
    main().unwrap();
}
