//! Random bodies and initial states: never a penetration, never a tension, never a missed switch.

use crate::common::{Collector, problem, random};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use signorini::contact::State;
use signorini::contact::States;
use signorini::contact::phase_modes;
use signorini::event::{self, Options};
use signorini::flow::Tolerances;
use signorini::scenario::Integrator;
use signorini::simulate::by_name;

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, rng_seed: RngSeed::Fixed(20261120), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_scenes_never_penetrate(
        (nx, ny) in (2usize..8, 1usize..5),
        height in 0.1f64..1.5,
        nu in -0.4f64..0.49,
        tilt in -0.3f64..0.3,
        lumped in any::<bool>(),
        mass in any::<bool>(),
        damped in any::<bool>(),
        five in any::<bool>(),
        seed in any::<u32>(),
    ) {
        let kind = |l: bool| if l { "lumped" } else { "consistent" };
        let damping = if damped { "[damping]\nratio = 0.01\n" } else { "" };
        let text = format!(
            "[body]\nkind = 'plate'\nsize = [1.0, {height}]\nelements = [{nx}, {ny}]\nyoung = 1.0\npoisson = {nu}\n\
             density = 1.0\nmass = '{}'\n[[support]]\nedge = 'left'\nfix = ['x', 'y']\n\
             [contact]\nedge = 'right'\ngap = '0.5 + {tilt}*y'\nboundary_mass = '{}'\n{damping}",
            kind(mass), kind(lumped),
        );
        let problem = problem(&text);
        let system = &problem.system;
        // a mixture of the lowest modes, large enough to hit the obstacle
        let phase = system.open_phase();
        let count = 6.min(system.n_o());
        let modes = phase_modes(system, &phase, count).unwrap();
        let weights = random(2 * count, u64::from(seed));
        let mut state = State { u: vec![0.0; system.n_o()], v: vec![0.0; system.n_o()] };
        for (k, shape) in modes.shapes.iter().enumerate() {
            for (j, x) in shape.iter().enumerate() {
                state.u[j] += weights[k] * x / (1.0 + k as f64);
                state.v[j] += weights[count + k] * x;
            }
        }
        let integrator = if five { Integrator::Dopri5 } else { Integrator::Dop853 };
        let options = Options { until: 6.0, samples: 3000, switch_limit: 40.0 };
        let mut flow = by_name(integrator, system, Tolerances { rtol: 1e-7, atol: 1e-10 });
        let mut states = Collector::default();
        let report = event::run(system, &state, &options, flow.as_mut(), &mut states).unwrap();
        prop_assert!(report.outcome.is_complete(), "{}", report.outcome);
        prop_assert_eq!(report.proof.missed, 0);
        let n_o = system.n_o();
        let size = states.u.iter().flatten().fold(1.0f64, |m, x| m.max(x.abs()));
        let mut set = States::open(system.n_contact());
        for (u, p) in states.u.iter().zip(&states.pressure) {
            // the stored state is *the* solution of the complementarity problem at its u_O
            let solution = system.conditions().solve(&u[..n_o], None, &set).unwrap();
            for i in 0..system.n_contact() {
                let w = system.conditions().gap[i] - u[n_o + i];
                prop_assert!(w >= -1e-13 * size, "penetration {}", w);
                prop_assert!((w - solution.w[i]).abs() < 1e-12 * size, "{} {}", w, solution.w[i]);
                prop_assert!((p[i] - solution.p[i]).abs() < 1e-11 * size * system.conditions().n_c[(i, i)]);
            }
            set = States::of_contact(solution.active);
        }
        // every switch changes one node, and no node switches twice the same way
        let mut last = states.active[0].clone();
        for s in &report.switches {
            prop_assert_eq!(&s.before, &last);
            prop_assert!(s.monitor_rate <= 1e-9 * size);
            last = s.after.clone();
        }
    }
}
