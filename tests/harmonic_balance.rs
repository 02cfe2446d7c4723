//! Harmonic balance against finite differences, the table of an independent program, and the time domain.

mod common;

use common::{random, shipped};
use signorini::hbm::newton::{Settings, directional, solve};
use signorini::hbm::response::{Summary, ladder, mode_start};
use signorini::hbm::{Form, Quadrature, Reduction, Series};
use signorini::problem::Problem;

fn half_plate(form: Form) -> Reduction {
    Reduction::new(Problem::new(&shipped("half-plate-orbit.toml"), None).unwrap().nbm, form).unwrap()
}

#[test]
fn explore_hbm() {
    for form in [Form::Force, Form::Acceleration] {
        let r = half_plate(form);
        println!("{form:?} rank {} {}", r.q.ncols(), r.q_in.ncols());
        let w1 = r.open.modes[0].omega;
        let mut q = mode_start(&r, 1.02).unwrap();
        let mut omega = 1.002 * w1;
        let set = Settings::default();
        let t = std::time::Instant::now();
        let mut last: Option<Series> = None;
        let mut table = vec![];
        while omega < 2.0005 {
            let guess = match &last { Some(l) => { let mut g = q.clone(); g.a.iter_mut().zip(&l.a).zip(&q.a).for_each(|((g, l), q)| *g = 2.0 * q - l); g }, None => q.clone() };
            match solve(&r, &guess, omega, &set).unwrap() {
                Ok(s) => { last = Some(q.clone()); q = s.q.clone(); table.push((omega, s)); }
                Err(e) => {
                    let mut done = false;
                    for a in [1.1, 1.2, 1.4, 1.7, 2.0, 2.5, 3.0, 4.0] {
                        if let Ok(s) = solve(&r, &mode_start(&r, a).unwrap(), omega, &set).unwrap() {
                            println!("{omega} restarted at {a}");
                            q = s.q.clone(); last = None; table.push((omega, s)); done = true; break;
                        }
                    }
                    if !done { println!("{omega} {e}") }
                },
            }
            omega += 0.005;
        }
        println!("N=1: {} points {:?}", table.len(), t.elapsed());
        for target in [1.8, 1.87, 2.0] {
            let (w, s) = table.iter().min_by(|a, b| (a.0 - target).abs().total_cmp(&(b.0 - target).abs())).unwrap();
            let s = solve(&r, &s.q, target, &set).unwrap().unwrap();
            println!("{target} from {w}: N 1 E {:.5} it {}", Summary::new(&r, &s).unwrap().energy, s.iterations);
            let mut q = s.q.clone();
            for n in 2..=31 {
                let t = std::time::Instant::now();
                match ladder(&r, &q, n, target, &set).unwrap() {
                    Ok(s) => { let m = Summary::new(&r, &s).unwrap(); println!("   {n} E {:.5} it {} res {:.1e} sw {} {:?}", m.energy, s.iterations, s.residual, m.switches.len(), t.elapsed()); q = s.q; }
                    Err(e) => { println!("   {n} {e}"); q = q.with_harmonics(n); }
                }
            }
        }
    }
}
