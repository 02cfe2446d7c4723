use super::*;
use crate::contact::{Contacts, Gaps, MassChoice, Rayleigh, States, Stress};
use crate::fem::{Body, DofMap, Facing, Held, MassForm, Material};
use crate::flow::Modal;
use crate::mesh::structured;

/// A plate held on its left, with a contact on its right.
fn plate(nx: usize, ny: usize, lumped: bool, choice: (Stress, MassChoice)) -> System {
    let mesh = structured::rectangle(1.0, 0.5, nx, ny);
    let held = [Held::along("left", 0), Held::along("left", 1)];
    let dofs = DofMap::new(&mesh, &held, &[Facing::surface("right")]).unwrap();
    let gap = vec![0.1; dofs.contact.len()];
    let form = if lumped { MassForm::Lumped } else { MassForm::Consistent };
    let body = Body::assemble(mesh, dofs, &[Material::plate(1.0, 0.3, 1.0, 1.0)], form);
    System::new(body, &Contacts { gaps: Gaps::front(gap), lumped: false }, choice).unwrap()
}

/// Every second node in contact.
fn mixed(system: &System) -> States {
    States::of_contact((0..system.n_contact()).map(|i| i % 2 == 0))
}

fn wave(n: usize, k: f64) -> Vec<f64> {
    (0..n).map(|i| (k * (i as f64 + 0.3)).sin()).collect()
}

/// A state with all frequencies in it, as switches leave it: velocities above all. Work and dissipation at zero.
fn rough(system: &System) -> Vec<f64> {
    let n = system.n_o();
    let mut y = vec![0.0; Layout::new(system).len()];
    let smooth = wave(n, 0.003);
    y[..n]
        .iter_mut()
        .zip(smooth.iter().zip(wave(n, 0.9)))
        .for_each(|(y, (s, r))| *y = s + 0.01 * r);
    y[n..2 * n].iter_mut().zip(wave(n, 1.7)).for_each(|(y, v)| *y = v);
    y
}

fn add_loads(system: &mut System, omega: f64) {
    let n = system.n();
    system.loads_mut().push(wave(n, 0.7), None, 0.0);
    // one shape at two frequencies, and another one
    system.loads_mut().push(wave(n, 1.3), Some(omega), 0.3);
    system.loads_mut().push(wave(n, 1.3), Some(2.2 * omega), -1.0);
    system.loads_mut().push(wave(n, 0.4), Some(omega), 1.1);
}

fn advance(flow: &mut dyn Flow, phase: &Phase, from: f64, y: &[f64], until: f64) {
    flow.begin(phase, from, y);
    while flow.window().1 < until {
        flow.advance(phase, until).unwrap();
    }
}

/// The largest difference of some entries, over the largest of them.
fn differ(x: &[f64], y: &[f64]) -> f64 {
    let size = y.iter().fold(0.0f64, |m, y| m.max(y.abs()));
    x.iter().zip(y).fold(0.0f64, |m, (x, y)| m.max((x - y).abs())) / size
}

/// `d/dt (u, v, 1, cos ω_l t, sin ω_l t, …)` is linear: its matrix exponential knows nothing of Chebyshev or of modes.
#[test]
fn states_are_those_of_the_matrix_exponential() {
    for (stress, mass) in
        [(Stress::Projection, MassChoice::Paper), (Stress::Reaction, MassChoice::Condensed)]
    {
        let mut system = plate(5, 4, false, (stress, mass));
        add_loads(&mut system, 1.87);
        let (n, highest) = (system.n_o(), system.units.highest);
        for (alpha, beta) in [(0.0, 0.0), (0.4, 0.0), (0.1, 0.02), (0.0, 2.0 / highest), (0.3, 1.0)]
        {
            system.damping = Some(Rayleigh { alpha, beta });
            let phase = system.phase(&mixed(&system));
            let mut s = system.scratch();
            let unit =
                |j: usize| (0..n).map(|i| if i == j { 1.0 } else { 0.0 }).collect::<Vec<_>>();
            let size = 2 * n + 7;
            let mut a = nalgebra::DMatrix::<f64>::zeros(size, size);
            let mut y = vec![0.0; n];
            for j in 0..n {
                phase.stiffness_product(&unit(j), &mut s, &mut y);
                a[(j, n + j)] = 1.0;
                for i in 0..n {
                    a[(n + i, j)] = -y[i];
                    a[(n + i, n + j)] = -beta * y[i] - if i == j { alpha } else { 0.0 };
                }
            }
            // what a constant state asks of the rest: the static force by an acceleration at rest
            let mut rest = system.clone();
            rest.loads_mut().harmonics.clear();
            rest.phase(&phase.set).acceleration(0.0, &vec![0.0; n], &vec![0.0; n], &mut s, &mut y);
            (0..n).for_each(|i| a[(n + i, 2 * n)] = y[i]);
            let (from, t) = (0.7, 2.3);
            let mut x = nalgebra::DVector::<f64>::zeros(size);
            x[2 * n] = 1.0;
            for (l, load) in system.loads.harmonics.iter().enumerate() {
                let (c, d) = (2 * n + 1 + 2 * l, 2 * n + 2 + 2 * l);
                phase.force_acceleration(&load.force, &mut s, &mut y);
                (0..n).for_each(|i| a[(n + i, c)] = y[i]);
                (a[(c, d)], a[(d, c)]) = (-load.omega, load.omega);
                (x[d], x[c]) = (load.omega * from + load.phase).sin_cos();
            }
            let start = rough(&system);
            x.rows_mut(0, 2 * n).copy_from_slice(&start[..2 * n]);
            let exact = (a * t).exp() * x;

            let mut flow = Chebyshev::new(&system);
            advance(&mut flow, &phase, from, &start, from + t);
            let end = flow.end_state();
            let of_u = differ(&end[..n], &exact.as_slice()[..n]);
            let of_v = differ(&end[n..2 * n], &exact.as_slice()[n..2 * n]);
            println!("α {alpha}, β ω_max {:.2}: {of_u:.1e} {of_v:.1e}", beta * highest);
            assert!(of_u < 2e-12 && of_v < 2e-12, "{alpha} {beta}: {of_u:.1e} {of_v:.1e}");
        }
    }
}

/// Forced, damped, 1,659 unknowns: as exact as the modes, work and dissipation included, with no more products than independent prototypes took.
#[test]
fn a_forced_and_damped_plate_moves_as_its_modes_do() {
    let mut system = plate(40, 20, true, (Stress::Projection, MassChoice::Paper));
    let n = system.n_o();
    // all of the body, and one point of it
    let mut force = system.gravity(&[1.0, 0.3]);
    force[n / 2] += 0.02;
    system.loads_mut().push(force, Some(1.87), 0.3);
    let set = mixed(&system);
    let spectra: Rc<crate::flow::spectrum::Spectra> = Rc::default();
    let highest = system.units.highest;
    // products of one window, and of windows with R = 100 (expflow, section 1.5)
    for (beta, table) in
        [(0.0, [586, 760]), (0.002, [620, 812]), (0.02, [791, 1160]), (0.2, [1490, 2600])]
    {
        system.damping = Some(Rayleigh { alpha: 0.0, beta });
        let (phase, start) = (system.phase(&set), rough(&system));
        let until = 321.0 / highest;
        let mut modal = Modal::sharing(&system, spectra.clone());
        advance(&mut modal, &phase, 0.0, &start, until);
        let exact = modal.end_state().to_vec();
        for (longest, most) in [321.0, 100.0].into_iter().zip(table) {
            let mut flow = Chebyshev::new(&system);
            flow.begin(&phase, 0.0, &start);
            while flow.window().1 < until {
                flow.length = Some(longest);
                flow.advance(&phase, until).unwrap();
            }
            let products = flow.counters().products;
            let end = flow.end_state();
            // of the largest at both ends of the motion
            let error = |part: std::ops::Range<usize>| {
                let size = |x: &[f64]| x.iter().fold(0.0f64, |m, x| m.max(x.abs()));
                let (last, first) = (size(&exact[part.clone()]), size(&start[part.clone()]));
                differ(&end[part.clone()], &exact[part]) * last / last.max(first)
            };
            let errors = [error(0..n), error(n..2 * n)];
            let energies: Vec<f64> =
                (2 * n..end.len()).map(|i| (end[i] - exact[i]).abs()).collect();
            let scale = (2 * n..end.len()).map(|i| exact[i].abs()).fold(0.0, f64::max);
            println!(
                "βω_max {:.2}, R ≤ {longest}: {products} products ({most}), u {:.1e}, v {:.1e}, work and dissipation {:.1e} of {scale:.2e}",
                beta * highest,
                errors[0],
                errors[1],
                energies.iter().fold(0.0f64, |m, x| m.max(*x)) / scale,
            );
            // 1.0e-12 measured where four windows or strong damping add up what is rounded, as in the prototypes
            let most_error = if beta < 0.1 && longest > 100.0 { 1e-12 } else { 1.5e-12 };
            assert!(errors.iter().all(|e| *e < most_error), "{beta}: {errors:?}");
            assert!(energies.iter().all(|e| *e < 1e-11 * scale), "{beta}: {energies:?} of {scale}");
            assert!(products as f64 <= 1.05 * f64::from(most), "{beta}: {products} {most}");
        }
    }
}
