//! The exact flows against Dormand–Prince at a tight tolerance, on everything that their formulas tell apart:
//! damping from none to far beyond critical, loads through resonance, rigid motions.

use crate::common::{relative, run_by, scene};
use signorini::contact::phase_modes;
use signorini::event::Report;
use signorini::problem::Problem;
use signorini::scenario::{Integrator, Scene};

fn plate(tables: &str) -> Scene {
    scene(&format!(
        "[body]\nkind = 'plate'\nsize = [1.0, 0.4]\nelements = [4, 2]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
         [[support]]\nedge = 'left'\nfix = ['x', 'y']\n[contact]\nedge = 'right'\ngap = 0.1\n{tables}\n\
         [run]\nuntil = 12.0\nsamples = 7\n"
    ))
}

const PUSH: &str = "[initial]\nvelocity = ['3*x', '0.1*x']";

fn harmonic(omega: f64) -> String {
    format!("[[load]]\nkind = 'mode'\nmode = 2\namplitude = 0.1\nomega = {omega:e}\nphase = 0.4\n")
}

/// Final state, switches and ledger of two runs.
fn compare(name: &str, scene: &Scene, integrator: Integrator, tolerance: f64) {
    let (exact, stepped) = (run_by(scene, integrator), run_by(scene, Integrator::Dop853));
    let state = |r: &Report| -> Vec<f64> { r.last.u.iter().chain(&r.last.v).copied().collect() };
    let e = relative(&state(&exact), &state(&stepped));
    println!(
        "{name}: {e:.1e}, {} switches, ledger {:.1e}",
        exact.switches.len(),
        exact.energy_drift_total
    );
    assert!(e < tolerance, "{name}: {e:e}");
    assert!(exact.switches.len() >= 2, "{name}: it must touch");
    assert_eq!(exact.switches.len(), stepped.switches.len(), "{name}");
    for (a, b) in exact.switches.iter().zip(&stepped.switches) {
        assert!((a.t - b.t).abs() < 100.0 * tolerance, "{name}: {} {}", a.t, b.t);
    }
    assert!(exact.energy_drift_total < 1e-11, "{name}: {:e}", exact.energy_drift_total);
    // work and dissipation: closed forms and quadrature here, Runge–Kutta there
    let scale = stepped.energy_start.abs() + stepped.energy_external.abs() + stepped.energy_end;
    for (a, b) in [
        (exact.energy_external, stepped.energy_external),
        (exact.energy_dissipated, stepped.energy_dissipated),
    ] {
        assert!((a - b).abs() < 10.0 * tolerance * scale, "{name}: {a} {b}");
    }
    assert!(exact.is_certified() && !stepped.is_certified());
}

#[test]
fn exact_flows_take_every_damping_and_load() {
    let omega = {
        let problem = Problem::new(&plate(""), None).unwrap();
        let system = &problem.system;
        let phase = system.open_phase();
        phase_modes(system, &phase, 2).unwrap().omega[1]
    };
    let damping = |rayleigh: &str| format!("[damping]\nrayleigh = {rayleigh}\n");
    let traction = "[[load]]\nkind = 'traction'\nedge = 'top'\namplitude = [0.02, -0.01]\n";
    for (name, tables) in [
        ("free", String::new()),
        ("constant load", traction.into()),
        ("light damping", damping("[0.0, 0.01]")),
        ("mass damping", damping("[0.3, 0.0]")),
        ("high modes over-damped", damping("[0.0, 0.3]")),
        ("all modes damped hard", damping("[0.1, 0.9]")),
        ("harmonic", harmonic(1.1)),
        ("damped, harmonic", damping("[0.0, 0.02]") + &harmonic(2.3)),
        ("over-damped, harmonic", damping("[0.0, 0.3]") + &harmonic(1.7)),
        ("exact resonance", harmonic(omega)),
        ("near resonance", harmonic(omega * (1.0 + 1e-9))),
        ("edge of resonance", harmonic(omega * 1.004)),
        ("damped resonance", damping("[0.0, 0.005]") + &harmonic(omega)),
        ("two loads", harmonic(0.9) + traction + &harmonic(3.1)),
    ] {
        for integrator in [Integrator::Modal, Integrator::Chebyshev, Integrator::Auto] {
            let name = format!("{name}, {}", integrator.name());
            compare(&name, &plate(&format!("{tables}{PUSH}")), integrator, 2e-9);
        }
    }
}

/// Other contact methods and discretisations, with loads on the contact displacements themselves, and springs where they damp nothing.
#[test]
fn every_method_of_linear_phases_is_taken() {
    let loads = "[damping]\nrayleigh = [0.1, 0.02]\n[[load]]\nkind = 'traction'\nedge = 'right'\namplitude = [0.03, 0.01]\nomega = 1.3\n";
    let undamped = loads.replace("0.02]", "0.0]");
    for (contact, loads) in [
        ("stress = 'reaction'\ninertia = 'constant'\n", loads),
        ("stress = 'projection'\ninertia = 'constant'\n", loads),
        ("boundary_mass = 'lumped'\n", loads),
        ("method = 'penalty'\nstiffness = 40.0\n", undamped.as_str()),
    ] {
        let text = plate(&format!("{loads}{PUSH}")).source.text.clone();
        let scene = scene(&text.replace("gap = 0.1\n", &format!("gap = 0.1\n{contact}")));
        compare(&format!("{contact:?}, modes"), &scene, Integrator::Modal, 2e-9);
        compare(&format!("{contact:?}"), &scene, Integrator::Chebyshev, 2e-9);
    }
}

/// A free bar: its rigid motion is a mode without stiffness, damped or not.
#[test]
fn rigid_motions_are_modes_too() {
    for damping in
        ["", "[damping]\nrayleigh = [0.05, 0.0]\n", "[damping]\nrayleigh = [0.0, 0.002]\n"]
    {
        let text = format!(
            "[body]\nkind = 'bar'\nsize = [10.0]\nelements = [12]\nyoung = 900.0\ndensity = 1.0\n\
             [contact]\nedge = 'left'\ngap = 5.0\n{damping}[[load]]\nkind = 'gravity'\namplitude = -10.0\n\
             [run]\nuntil = 5.0\nsamples = 3\n"
        );
        let scene = scene(&text);
        for integrator in [Integrator::Modal, Integrator::Chebyshev] {
            let name = format!("bouncing {damping:?}, {}", integrator.name());
            compare(&name, &scene, integrator, 1e-8);
        }
    }
}
