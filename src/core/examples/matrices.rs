//! Matrices of one's own: a chain of three masses whose last one meets an obstacle, driven.
//!
//!     cargo run --release -p signorini-core --example matrices

use signorini_core::fem::Csr;
use signorini_core::model::{Model, orbit, run};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mass = Csr::from_triplets(3, 3, (0..3).map(|i| (i, i, 1.0)).collect());
    let springs = [(0, 0, 2.0), (1, 1, 2.0), (2, 2, 1.0), (0, 1, -1.0), (1, 2, -1.0)];
    let both = springs
        .iter()
        .flat_map(|&(i, j, k)| [(i, j, k), (j, i, k)].into_iter().take(1 + usize::from(i != j)));
    let stiffness = Csr::from_triplets(3, 3, both.collect());
    // the contact displacement follows from the others without inertia
    let chain = Model::matrices(mass, stiffness, &[2]).gap(0.2).damp(0.02, 0.0);
    let system = chain.forces(&[0.1, 0.0, 0.0]).harmonic(0.4, 0.0).build()?;
    let rest = system.state_of(|_| [0.0; 3], |_| [0.0; 3]);
    let report = run(&system, &rest, 200.0)?;
    println!("{} switches, energy drift {:.1e}", report.switches.len(), report.energy_drift_total);
    assert!(report.is_certified() && report.energy_drift_total < 1e-11);

    let verdict = orbit(system, &report.last, 0.4)?;
    let orbit = verdict.orbit().ok_or("no orbit")?;
    let stability = orbit.stability.as_ref().ok_or("no multipliers")?;
    println!(
        "periodic response: amplitude {:.9}, largest multiplier {:.6}",
        orbit.amplitude, stability.largest
    );
    assert!(orbit.flaws().is_empty());
    Ok(())
}

#[test]
fn runs() {
    main().unwrap();
}
