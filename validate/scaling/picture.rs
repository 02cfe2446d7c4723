//! `cargo run --release --example scaling -- out/scaling [PLATES]`: cost against the number of unknowns, the picture and the table of `docs/performance.md`.
//!
//! Plates from 10⁴ to 10⁶ unknowns (lumped mass) swing against the obstacle for one period by the flow without modes; beside their times stands what the memory
//! of this machine would take for the same products at the least. `PLATES`: how many of the seven; all take about five minutes.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

use rayon::prelude::*;
use signorini::event::Silent;
use signorini::problem::Problem;
use signorini::report::figure::{
    self, DPI, Drawing, FigureError, LINES, Mark, draw_dashes, draw_line, legend_above, line,
    loglog, px, symbols, title,
};
use signorini::scenario::Scene;
use signorini::simulate::simulate;
use signorini::store::Outputs;

const PLATES: [[usize; 2]; 7] =
    [[100, 50], [142, 71], [200, 100], [284, 142], [400, 200], [632, 316], [1000, 500]];
/// Bytes an unknown that a step of a recurrence moves at the least: two vectors are read, one is written.
const BYTES: f64 = 24.0;

const HEAD: &str = "| plate | unknowns | switches | products | set-up | one period | a product | the memory alone | energy closes to | peak memory |\n\
    | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |";

/// What one plate costs.
struct Cost {
    unknowns: f64,
    switches: usize,
    products: f64,
    set_up: f64,
    run: f64,
    /// Largest memory so far, in bytes.
    memory: f64,
    drift: f64,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let stem = arguments.next().ok_or("give the name of the picture")?;
    let count = arguments.next().map_or(Ok(PLATES.len()), |n| n.parse())?.clamp(2, PLATES.len());
    let mut costs = vec![];
    for plate @ [nx, ny] in &PLATES[..count] {
        eprintln!("{nx} × {ny} …");
        costs.push(cost(*plate)?);
    }
    // behind them: what it takes would be part of their memory
    let rate = bandwidth();
    println!("memory: {:.1} GB/s by {} threads\n", rate / 1e9, rayon::current_num_threads());
    println!("{HEAD}");
    for (c, [nx, ny]) in costs.iter().zip(PLATES) {
        println!(
            "| {nx} × {ny} | {} | {} | {} | {:.2} s | {:.2} s | {:.3} ms | {:.2} s | {:.0e} | {:.0} MB |",
            c.unknowns,
            c.switches,
            c.products,
            c.set_up,
            c.run,
            1e3 * c.run / c.products,
            floor(c, rate),
            c.drift,
            c.memory / 1e6
        );
    }
    for (what, of) in CURVES {
        println!("{what}: n^{:.2}", exponent(&costs, of));
    }
    let drawing = Drawing { stem: PathBuf::from(stem), svg: picture(&costs, rate)? };
    for path in figure::save(&[drawing], &Outputs::new(true), DPI)? {
        println!("{}", path.display());
    }
    Ok(())
}

/// One period of one plate.
fn cost(plate: [usize; 2]) -> Result<Cost, Box<dyn std::error::Error>> {
    let [nx, ny] = plate;
    let text = include_str!("plate.toml").replace("[20, 10]", &format!("[{nx}, {ny}]"));
    let scene = Scene::parse(&text, Path::new("plate.toml"))?;
    let begun = Instant::now();
    let problem = Problem::new(&scene, None)?;
    let set_up = begun.elapsed().as_secs_f64();
    let report = simulate(&scene, &problem, false, &mut Silent)?;
    if !report.is_certified() {
        return Err(format!("{plate:?} is not certified").into());
    }
    Ok(Cost {
        unknowns: problem.system.n_o() as f64,
        switches: report.log.switches(),
        products: report.counters.products as f64,
        set_up,
        run: begun.elapsed().as_secs_f64() - set_up,
        memory: peak(),
        drift: report.energy_drift_total,
    })
}

/// The largest memory of this process until now; not a number where it is not told.
fn peak() -> f64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find(|l| l.starts_with("VmHWM:"));
    let number = line.and_then(|l| l.split_whitespace().nth(1)?.parse::<f64>().ok());
    number.map_or(f64::NAN, |kilobytes| 1024.0 * kilobytes)
}

/// Bytes a second of `z = 2x − z` over vectors that fit into no cache, the best of five.
fn bandwidth() -> f64 {
    let n = 1 << 24;
    let (x, mut z) = (vec![1.0f64; n], vec![0.5f64; n]);
    let pass = |z: &mut [f64]| {
        let begun = Instant::now();
        z.par_chunks_mut(1 << 16).zip(x.par_chunks(1 << 16)).for_each(|(z, x)| {
            z.iter_mut().zip(x).for_each(|(z, x)| *z = 2.0 * x - *z);
        });
        begun.elapsed().as_secs_f64()
    };
    let best = (0..5).map(|_| pass(&mut z)).fold(f64::INFINITY, f64::min);
    assert!(z[n / 2].is_finite());
    BYTES * n as f64 / best
}

/// What the memory takes for the products alone.
fn floor(cost: &Cost, rate: f64) -> f64 {
    BYTES * cost.unknowns * cost.products / rate
}

type Curve = (&'static str, fn(&Cost) -> f64);
const CURVES: [Curve; 3] =
    [("one period", |c| c.run), ("set-up", |c| c.set_up), ("products", |c| c.products)];

/// Slope of the least squares line through the logarithms.
fn exponent(costs: &[Cost], of: fn(&Cost) -> f64) -> f64 {
    let places: Vec<(f64, f64)> = costs.iter().map(|c| (c.unknowns.ln(), of(c).ln())).collect();
    let n = places.len() as f64;
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| places.iter().map(f).sum::<f64>() / n;
    let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
    mean(&|p| (p.0 - x) * (p.1 - y)) / mean(&|p| (p.0 - x).powi(2))
}

/// Whole decades around values.
fn decades<'v>(values: impl Iterator<Item = &'v f64> + Clone) -> Range<f64> {
    let least = values.clone().fold(f64::INFINITY, |m, v| m.min(*v));
    let most = values.fold(f64::NEG_INFINITY, |m, v| m.max(*v));
    (least + 0.01).floor() - 0.05..(most - 0.01).ceil() + 0.05
}

fn picture(costs: &[Cost], rate: f64) -> Result<String, FigureError> {
    figure::svg((980, 470), |root| {
        title(
            root,
            "Plates with lumped mass",
            "cost of one period against the number of unknowns",
        )?;
        let (_, sheet) = root.split_vertically(px(32.0));
        let [run, set_up, products] = CURVES.map(|(what, of)| (what, of, exponent(costs, of)));
        let labels = [run, set_up].map(|(what, _, e)| format!("{what}, n^{e:.2}"));
        let names = [
            (labels[0].as_str(), LINES[0], Mark::Circle),
            (labels[1].as_str(), LINES[1], Mark::Triangle),
            ("the memory alone, for the same products", LINES[2], Mark::Dashes),
        ];
        let sheet = legend_above(sheet, &names)?;
        let (left, right) = sheet.split_horizontally(px(520.0));
        let log = |of: &dyn Fn(&Cost) -> f64| -> Vec<(f64, f64)> {
            costs.iter().map(|c| (c.unknowns.log10(), of(c).log10())).collect()
        };
        let curves = [log(&run.1), log(&set_up.1), log(&|c| floor(c, rate))];
        let x = decades(curves[0].iter().map(|p| &p.0));
        let y = decades(curves.iter().flatten().map(|p| &p.1));
        let mut chart = loglog(&left, x.clone(), y, "unknowns", "seconds")?;
        for ((curve, colour), mark) in
            curves[..2].iter().zip(LINES).zip([Mark::Circle, Mark::Triangle])
        {
            draw_line(&mut chart, curve.clone(), line(colour, 1.6))?;
            symbols(&chart, curve.iter().copied(), mark, colour)?;
        }
        draw_dashes(&mut chart, curves[2].clone(), line(LINES[2], 1.4))?;
        let curve = log(&products.1);
        let y = decades(curve.iter().map(|p| &p.1));
        let label = format!("products, n^{:.2}", products.2);
        let mut chart = loglog(&right, x, y, "unknowns", &label)?;
        draw_line(&mut chart, curve.clone(), line(LINES[0], 1.6))?;
        symbols(&chart, curve, Mark::Circle, LINES[0])
    })
}
