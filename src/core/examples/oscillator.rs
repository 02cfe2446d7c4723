//! Two bar elements before a rigid obstacle: one degree of freedom, in closed form.
//!
//!     cargo run --release -p signorini-core --example oscillator

use signorini_core::fem::Material;
use signorini_core::model::{Model, orbit, run};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let bar = Model::bar(2.0, 2, Material::bar(1.0, 1.0, 1.0)).hold("left", &[0]);
    let system = bar.obstacle("right", 0.5).build()?;
    let stretched = system.state_of(|x| [-x[0], 0.0, 0.0], |_| [0.0; 3]);
    let report = run(&system, &stretched, 20.0)?;
    println!("{} switches, energy drift {:.1e}", report.switches.len(), report.energy_drift_total);
    for s in report.switches.iter().take(4) {
        println!("t = {:.12}: {} -> {}", s.t, s.before, s.after);
    }
    assert!(report.is_certified() && report.switches.len() == 6);

    // free flight 2 t₁ with ω = √¾, contact 2 t₂ with ω = √3 about half the gap
    let (free, held) = (0.75f64.sqrt(), 3f64.sqrt());
    let t1 = (-0.5f64).acos() / free;
    let v = free * (free * t1).sin();
    let period = 2.0 * (t1 + (v / held).atan2(0.25) / held);
    assert!((report.switches[0].t - t1).abs() < 1e-12);
    let verdict = orbit(system, &stretched, std::f64::consts::TAU / period)?;
    let orbit = verdict.orbit().ok_or("no orbit")?;
    println!("orbit of energy {:.12} (½ in closed form)", orbit.energy);
    assert!((orbit.energy - 0.5).abs() < 1e-11);
    Ok(())
}

#[test]
fn runs() {
    main().unwrap();
}
