//! Periodic orbits against finite differences, closed forms and the event-driven integrator.

mod common;

use common::{problem, random, shipped};
use faer::Mat;
use signorini::orbit::chain::Propagator;
use signorini::orbit::search::{Effort, Verdict, find};
use signorini::orbit::shooting::{Closure, linearised};
use signorini::problem::Problem;

fn half_plate() -> Propagator {
    let text = "[body]\nkind = 'plate'\nsize = [1.0, 0.3]\nelements = [10, 3]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
        [[support]]\nedge = 'left'\nfix = ['x', 'y']\n[[support]]\nedge = 'bottom'\nfix = ['y']\n\
        [contact]\nedge = 'right'\ngap = 1.0\n";
    Propagator::new(problem(text).nbm).unwrap()
}

/// The derivative of the event-driven map, all saltations included, against central differences.
#[test]
fn derivative_of_the_period_map() {
    let body = half_plate();
    let n = body.n();
    for (closure, period) in [(Closure::Reversible, 3.4), (Closure::Autonomous, 3.4)] {
        let mut z = vec![0.0; closure.unknowns(n)];
        z[0] = -1.3 * body.scale[0] / body.open.shapes[(n - 1, 0)].abs();
        for (z, r) in z.iter_mut().zip(random(n, 5)) {
            *z += 0.02 * r;
        }
        let (_, j) = linearised(&body, closure, &z, period).unwrap();
        let mut worst = 0.0f64;
        for k in 0..4 {
            let d = random(z.len(), 77 + k);
            let h = 1e-6;
            let at = |s: f64| {
                let y: Vec<f64> = z.iter().zip(&d).map(|(z, d)| z + s * d).collect();
                linearised(&body, closure, &y, period).unwrap().0
            };
            let (up, down) = (at(h), at(-h));
            let exact = &j * Mat::from_fn(d.len(), 1, |i, _| d[i]);
            let scale = (0..up.len()).map(|i| exact[(i, 0)].abs()).fold(0.0, f64::max);
            for i in 0..up.len() {
                worst = worst.max(((up[i] - down[i]) / (2.0 * h) - exact[(i, 0)]).abs() / scale);
            }
        }
        println!("{closure:?}: derivative against differences {worst:.1e}");
        assert!(worst < 1e-6, "{worst:e}");
    }
}

#[test]
fn explore() {
    let mut body = half_plate();
    let n = body.n();
    let text = std::env::var("OM").unwrap_or("1.8".into());
    let omega: f64 = text.parse().unwrap();
    let start = std::time::Instant::now();
    for k in 0..30 {
        let a = 1.0 + 0.1 * k as f64;
        let mut z = vec![0.0; n];
        // mode 1 at a multiple of grazing
        let mut full = vec![0.0; body.nbm.n()];
        let phase = signorini::contact::Phase::new(&body.nbm, signorini::contact::ActiveSet::open(body.nbm.n_contact())).unwrap();
        let shape: Vec<f64> = (0..n).map(|i| body.open.shapes[(i, 0)]).collect();
        phase.expand_velocity(&body.nbm, &shape, &mut full);
        let lead = full[n..].iter().fold(0.0f64, |m, x| if x.abs() > m.abs() { *x } else { m });
        z[0] = -a / lead * body.scale[0];
        let t = std::time::Instant::now();
        let v = find(&mut body, Closure::Reversible, &z, omega, &Effort::default()).unwrap();
        print!("{a:.2} {:?} ", t.elapsed());
        match &v {
            Verdict::Orbit(o) => println!(
                "orbit E {:.8} res {:.1e} sw {} graz {:.1e} it {} stable {:?} jumps {:.1e} {:?}",
                o.energy, o.residual, o.switches.len(), o.grazing, o.iterations,
                o.stability.as_ref().map(|s| (s.outside, s.largest, s.multipliers[1])), o.jumps, t.elapsed()
            ),
            other => println!("{other}"),
        }
    }
    println!("{:?}", start.elapsed());
}

#[test]
fn explore_branch() {
    use signorini::continuation::{Go, Options, Place, follow};
    use signorini::orbit::Segments;
    use signorini::orbit::search::chain_of;
    let mut body = half_plate();
    let n = body.n();
    let omega: f64 = std::env::var("OM").unwrap_or("1.8".into()).parse().unwrap();
    let a: f64 = std::env::var("AMP").unwrap_or("1.1".into()).parse().unwrap();
    let dir: f64 = std::env::var("DIR").unwrap_or("1".into()).parse().unwrap();
    let points: usize = std::env::var("POINTS").unwrap_or("100".into()).parse().unwrap();
    let mut z = vec![0.0; n];
    let mut full = vec![0.0; body.nbm.n()];
    let phase = signorini::contact::Phase::new(&body.nbm, signorini::contact::ActiveSet::open(body.nbm.n_contact())).unwrap();
    let shape: Vec<f64> = (0..n).map(|i| body.open.shapes[(i, 0)]).collect();
    phase.expand_velocity(&body.nbm, &shape, &mut full);
    let lead = full[n..].iter().fold(0.0f64, |m, x| if x.abs() > m.abs() { *x } else { m });
    z[0] = -a / lead * body.scale[0];
    let v = find(&mut body, Closure::Reversible, &z, omega, &Effort::default()).unwrap();
    let orbit = v.orbit().unwrap().clone();
    let (chain, times) = chain_of(&body, &orbit).unwrap();
    println!("{chain:?} {times:?}");
    let mut family = Segments::new(&mut body, Closure::Reversible, chain);
    let x = family.unknowns(&orbit.z, &times, omega);
    family.watch = std::env::var("WATCH").is_ok();
    let place = Place::start(&mut family, x, dir, 0.005).unwrap().unwrap();
    let options = Options { range: (1.58, 2.09), step: (0.005, 1e-7, 0.05), points, locate: false, natural: false };
    let mut clock = std::time::Instant::now();
    let stop = follow(&mut family, place, &options, |family, p| {
        let z = family.parts(&p.x).0;
        let e = 0.5 * z.iter().map(|z| z * z).sum::<f64>();
        println!("{:.7} E {e:.6} step {:.1e} it {} events {} {:?} {:?}", p.x[p.x.len() - 1], p.place.step, p.iterations, family.chain.events(), p.special, clock.elapsed());
        clock = std::time::Instant::now();
        Go::Continue(())
    });
    println!("{stop:?}");
}

#[test]
fn explore_seq() {
    let mut body = half_plate();
    let n = body.n();
    let omega: f64 = std::env::var("OM").unwrap_or("1.8".into()).parse().unwrap();
    let a: f64 = std::env::var("AMP").unwrap_or("1.1".into()).parse().unwrap();
    let dw: f64 = std::env::var("DW").unwrap_or("0.005".into()).parse().unwrap();
    let mut z = vec![0.0; n];
    let mut full = vec![0.0; body.nbm.n()];
    let phase = signorini::contact::Phase::new(&body.nbm, signorini::contact::ActiveSet::open(body.nbm.n_contact())).unwrap();
    let shape: Vec<f64> = (0..n).map(|i| body.open.shapes[(i, 0)]).collect();
    phase.expand_velocity(&body.nbm, &shape, &mut full);
    let lead = full[n..].iter().fold(0.0f64, |m, x| if x.abs() > m.abs() { *x } else { m });
    z[0] = -a / lead * body.scale[0];
    let mut known: Vec<(f64, Vec<f64>)> = vec![];
    for k in 0..60 {
        let w = omega + dw * k as f64;
        let t = std::time::Instant::now();
        let guesses = signorini::continuation::guesses(&known, w);
        let list: Vec<Vec<f64>> = if guesses.is_empty() { vec![z.clone()] } else { guesses.into_iter().map(|g| g.1).collect() };
        for g in list {
            let v = find(&mut body, Closure::Reversible, &g, w, &Effort{multipliers:false, ..Effort::default()}).unwrap();
            println!("{w:.4} {} {:?}", match &v { Verdict::Orbit(o) => format!("orbit E {:.6} sw {} graz {:.1e} it {}", o.energy, o.switches.len(), o.grazing, o.iterations), o => o.to_string()}, t.elapsed());
            if let Verdict::Orbit(o) = v { known.push((w, o.z.clone())); break; }
        }
    }
}

#[test]
fn explore_forced() {
    use signorini::continuation::{Go, Options, Place, follow};
    use signorini::orbit::Segments;
    use signorini::orbit::search::chain_of;
    let xi: f64 = std::env::var("XI").unwrap_or("0.02".into()).parse().unwrap();
    let points: usize = std::env::var("POINTS").unwrap_or("300".into()).parse().unwrap();
    let text = format!("[body]\nkind = 'plate'\nsize = [1.0, 0.3]\nelements = [10, 3]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
        [[support]]\nedge = 'left'\nfix = ['x', 'y']\n[[support]]\nedge = 'bottom'\nfix = ['y']\n\
        [contact]\nedge = 'right'\ngap = 1.0\n[damping]\nratio = {xi}\nmode = 1\n[[load]]\nkind = 'mode'\nmode = 1\npeak = 3.0\nomega = 1.2\n");
    let mut body = Propagator::new(problem(&text).nbm).unwrap();
    let z = body.linear_response();
    let v = find(&mut body, Closure::Forced, &z, 1.2, &Effort::default()).unwrap();
    let orbit = v.orbit().expect(&v.to_string()).clone();
    println!("{} {:?}", orbit.residual, orbit.stability.as_ref().map(|s| s.largest));
    let (chain, times) = chain_of(&body, &orbit).unwrap();
    let mut family = Segments::new(&mut body, Closure::Forced, chain);
    let x = family.unknowns(&orbit.z, &times, 1.2);
    family.watch = std::env::var("WATCH").is_ok();
    let place = Place::start(&mut family, x, 1.0, 0.005).unwrap().unwrap();
    let options = Options { range: (1.2, 2.1), step: (0.01, 1e-7, 0.05), points, locate: false, natural: false };
    let mut clock = std::time::Instant::now();
    let mut peak = (0.0, 0.0);
    let stop = follow(&mut family, place, &options, |family, p| {
        let z = family.parts(&p.x).0;
        let e = 0.5 * z.iter().map(|z| z * z).sum::<f64>();
        if e > peak.1 { peak = (p.x[p.x.len()-1], e); }
        println!("{:.7} E {e:.6} step {:.1e} it {} events {} {:?} {:?} {:?}", p.x[p.x.len() - 1], p.place.step, p.iterations, family.chain.events(), p.special, p.place.signature, clock.elapsed());
        clock = std::time::Instant::now();
        Go::Continue(())
    });
    println!("{stop:?} peak {peak:?}");
}

#[test]
fn explore_all() {
    let mut body = half_plate();
    let starts = signorini::orbit::branch::starts(&body, 4.0, 16);
    for omega in [1.8, 1.87, 1.9, 2.0] {
        let t = std::time::Instant::now();
        let all = signorini::orbit::branch::all(&mut body, Closure::Reversible, &starts, omega, &Effort::default(), |_| ()).unwrap();
        println!("{omega} {} starts {:?}", starts.len(), t.elapsed());
        for o in all { println!("   E {:.6} sw {} res {:.1e} graz {:.1e}", o.energy, o.switches.len(), o.residual, o.grazing); }
    }
}

#[test]
fn explore_border() {
    use signorini::orbit::branch::place_of;
    let f = signorini::store::StoredFamily::read(std::path::Path::new("out/rr.h5")).unwrap();
    let text = std::fs::read_to_string("scenarios/half-plate-response.toml").unwrap();
    for p in &f.points {
        if !p.special.starts_with("failed") { continue; }
        let ratio = [0.005, 0.01, 0.02, 0.05][p.branch];
        let mut body = Propagator::new(problem(&text.replace("ratio = 0.02", &format!("ratio = {ratio}"))).nbm).unwrap();
        let place = place_of(p.place.as_ref().unwrap());
        let n = 2 * body.n();
        for h in &mut body.nbm.loads.harmonics { h.omega = p.omega; }
        let period = std::f64::consts::TAU / p.omega;
        let z = &place.x[..n];
        println!("{} {} {:?} {:?}", p.omega, p.special, place.chart.nodes, &place.x[n..]);
        let r = signorini::orbit::reading::read(&body, &body.state(z), period).unwrap();
        println!("  {:?} {:?} {:?}", r.chain.nodes, r.times, r.chain.sets);
        println!("  {:?}", r.report.grazings);
        for s in &r.report.switches { println!("     {} {} {:?} rate {:.1e}", s.t, s.node, s.kind, s.monitor_rate); }
    }
}
