//! A motion of two frequencies: two masses before an elastic stop, from where its orbit loses its stability on.
//!
//!     cargo run --release -p signorini-core --example torus

use signorini_core::contact::Penalty;
use signorini_core::fem::Csr;
use signorini_core::model::Model;
use signorini_core::orbit::search::{Effort, find};
use signorini_core::orbit::torus::{Given, Torus};
use signorini_core::orbit::{Closure, Propagator};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mass = Csr::from_triplets(2, 2, vec![(0, 0, 1.0), (1, 1, 1.0)]);
    let springs = vec![(0, 0, 2.0), (1, 1, 2.0), (0, 1, -1.0), (1, 0, -1.0)];
    let stiffness = Csr::from_triplets(2, 2, springs);
    let masses = Model::matrices(mass, stiffness, &[0]).gap(0.0).law(Penalty { stiffness: 10.0 });
    let system = masses.damp(0.04, 0.0).forces(&[1.0, 0.0]).harmonic(2.92, 0.0).build()?;
    let mut body = Propagator::new(system)?;

    // just below the point where a pair of multipliers leaves the unit circle
    let omega = 2.9209;
    body.system.loads_mut().set_frequency(omega);
    let guess = body.linear_response();
    let verdict = find(&mut body, Closure::FORCED, &guess, omega, &Effort::default())?;
    let orbit = verdict.orbit().ok_or("no orbit")?;
    println!("largest multiplier {:.6}", orbit.stability.as_ref().ok_or("none")?.largest);

    // a small curve around it, then larger ones
    let mut torus = Torus::around(&mut body, &orbit.z, omega, (0.01, 12))?.ok_or("no pair")?;
    for size in [0.01, 0.02, 0.04, 0.08, 0.12, 0.16, 0.2, 0.214, 0.23, 0.25, 0.265, 0.28] {
        let guess = torus.grown(size);
        torus = guess.corrected(&mut body, Given::Size(size))?.ok_or("no curve")?;
        println!(
            "a = {size:.2}: omega = {:.9}, rho = {:.9}, tail {:.1e}",
            torus.omega,
            torus.rho,
            torus.tail()
        );
    }
    for omega in [2.93, 2.926832849, 2.921183797] {
        let there = torus.corrected(&mut body, Given::Frequency(omega))?.ok_or("no curve")?;
        println!(
            "omega = {omega}: rho = {:.9}, a = {:.6}, tail {:.1e}",
            there.rho,
            there.size(),
            there.tail()
        );
    }
    Ok(())
}
