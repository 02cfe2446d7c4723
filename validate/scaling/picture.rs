//! `cargo run --release --example scaling -- out/scaling [SIZES]`: cost against the number of unknowns, the picture and the table of `docs/performance.md`.
//!
//! Plates from 10⁴ to 10⁶ unknowns (lumped mass) swing against the obstacle for one period by the flow without modes, and so do the same plates as files of
//! Gmsh whose quadrilaterals are all different. Beside their times stands what the memory of this machine would take for the same products at the least.
//! `SIZES`: how many of the seven; all take about five minutes.

#[path = "../../tests/common/rectangle.rs"]
mod rectangle;

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

use rayon::prelude::*;
use signorini::event::{Observer, Sample};
use signorini::mesh::ElementKind;
use signorini::problem::Problem;
use signorini::report::figure::{
    self, DPI, Drawing, FigureError, LINES, Mark, draw_dashes, draw_line, legend_above, line,
    loglog, px, symbols, title,
};
use signorini::scenario::Scene;
use signorini::simulate::simulate;
use signorini::store::Outputs;

const SIZES: [[usize; 2]; 7] =
    [[100, 50], [142, 71], [200, 100], [284, 142], [400, 200], [632, 316], [1000, 500]];
/// How far inner nodes of meshes are moved, over the cells.
const SKEW: f64 = 0.2;
/// Bytes an unknown that a step of a recurrence moves at the least: two vectors are read, one is written.
const BYTES: f64 = 24.0;

const HEAD: &str = "| body | unknowns | switches | products | set-up | one period | a product | the memory alone | energy closes to | peak memory |\n\
    | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |";

/// Looks at nothing but the contact, as a run does that stores no more.
struct Contact;

impl Observer for Contact {
    type Error = std::convert::Infallible;
    fn sample(&mut self, _: &Sample) -> Result<(), Self::Error> {
        Ok(())
    }
    fn sees_contact_alone(&self) -> bool {
        true
    }
}

/// What one body costs.
struct Cost {
    body: String,
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
    let count = arguments.next().map_or(Ok(SIZES.len()), |n| n.parse())?.clamp(2, SIZES.len());
    let (mut plates, mut meshes) = (vec![], vec![]);
    for &size in &SIZES[..count] {
        plates.push(plate(size)?);
        // a file of half a million nodes says nothing more
        if size[0] <= 632 {
            meshes.push(mesh(size)?);
        }
    }
    // behind them: what it takes would be part of their memory
    let rate = bandwidth();
    println!("memory: {:.1} GB/s by {} threads\n", rate / 1e9, rayon::current_num_threads());
    println!("{HEAD}");
    for c in plates.iter().chain(&meshes) {
        println!(
            "| {} | {} | {} | {} | {:.2} s | {:.2} s | {:.3} ms | {:.2} s | {:.0e} | {:.0} MB |",
            c.body,
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
    for (bodies, costs) in [("plates", &plates), ("meshes", &meshes)] {
        for (what, of) in CURVES {
            println!("{bodies}, {what}: n^{:.2}", exponent(costs, of));
        }
    }
    let drawing = Drawing { stem: PathBuf::from(stem), svg: picture([&plates, &meshes], rate)? };
    for path in figure::save(&[drawing], &Outputs::new(true), DPI)? {
        println!("{}", path.display());
    }
    Ok(())
}

fn plate([nx, ny]: [usize; 2]) -> Result<Cost, Box<dyn std::error::Error>> {
    let text = include_str!("plate.toml").replace("[20, 10]", &format!("[{nx}, {ny}]"));
    cost(format!("plate {nx} × {ny}"), &text)
}

/// The same plate as a mesh that repeats nothing.
fn mesh([nx, ny]: [usize; 2]) -> Result<Cost, Box<dyn std::error::Error>> {
    let file = std::env::temp_dir().join(format!("signorini-scaling-{}.msh", std::process::id()));
    let mesh = rectangle::rectangle(ElementKind::Quad4, [0.0, 1.0], 0.5, (nx, ny), SKEW);
    std::fs::write(&file, rectangle::msh(&mesh, |_| 0))?;
    let text = include_str!("mesh.toml").replace("mesh.msh", &file.display().to_string());
    let cost = cost(format!("mesh {nx} × {ny}"), &text);
    std::fs::remove_file(&file)?;
    cost
}

/// One period of one body.
fn cost(body: String, text: &str) -> Result<Cost, Box<dyn std::error::Error>> {
    eprintln!("{body} …");
    let begun = Instant::now();
    let scene = Scene::parse(text, Path::new("scene.toml"))?;
    let problem = Problem::new(&scene, None)?;
    let set_up = begun.elapsed().as_secs_f64();
    let report = simulate(&scene, &problem, false, &mut Contact)?;
    if !report.is_certified() {
        return Err(format!("{body} is not certified").into());
    }
    Ok(Cost {
        body,
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

/// Of plates and of meshes: a colour each.
fn picture(bodies: [&[Cost]; 2], rate: f64) -> Result<String, FigureError> {
    figure::svg((980, 500), |root| {
        let what = "cost of one period against the number of unknowns";
        title(root, "Plates with lumped mass", what)?;
        let (_, sheet) = root.split_vertically(px(32.0));
        let [run, set_up, products] = CURVES;
        let label = |curve: Curve, k: usize| {
            let body = ["plate", "mesh"][k];
            format!("{}, {body}, n^{:.2}", curve.0, exponent(bodies[k], curve.1))
        };
        let labels = [label(run, 0), label(run, 1), label(set_up, 0), label(set_up, 1)];
        let [a, b, c, d] = labels.each_ref().map(String::as_str);
        let names = [
            (a, LINES[0], Mark::Circle),
            (b, LINES[1], Mark::Circle),
            (c, LINES[0], Mark::Triangle),
            (d, LINES[1], Mark::Triangle),
            ("the memory alone, for the plates' products", LINES[2], Mark::Dashes),
        ];
        let sheet = legend_above(sheet, &names)?;
        let (left, right) = sheet.split_horizontally(px(520.0));
        let log = |costs: &[Cost], of: &dyn Fn(&Cost) -> f64| -> Vec<(f64, f64)> {
            costs.iter().map(|c| (c.unknowns.log10(), of(c).log10())).collect()
        };
        let least = log(bodies[0], &|c| floor(c, rate));
        let times: Vec<_> = [(run, Mark::Circle), (set_up, Mark::Triangle)]
            .into_iter()
            .flat_map(|(curve, mark)| [0, 1].map(|k| (log(bodies[k], &curve.1), LINES[k], mark)))
            .collect();
        let x = decades(least.iter().map(|p| &p.0));
        let all = times.iter().flat_map(|t| &t.0).chain(&least);
        let y = decades(all.map(|p| &p.1));
        let mut chart = loglog(&left, x.clone(), y, "unknowns", "seconds")?;
        for (curve, colour, mark) in times {
            draw_line(&mut chart, curve.clone(), line(colour, 1.6))?;
            symbols(&chart, curve, mark, colour)?;
        }
        draw_dashes(&mut chart, least, line(LINES[2], 1.4))?;
        let curves = [0, 1].map(|k| log(bodies[k], &products.1));
        let y = decades(curves.iter().flatten().map(|p| &p.1));
        let of = |k: usize| exponent(bodies[k], products.1);
        let label = format!("products, n^{:.2} and n^{:.2}", of(0), of(1));
        let mut chart = loglog(&right, x, y, "unknowns", &label)?;
        for (curve, colour) in curves.into_iter().zip(LINES) {
            draw_line(&mut chart, curve.clone(), line(colour, 1.6))?;
            symbols(&chart, curve, Mark::Circle, colour)?;
        }
        Ok(())
    })
}
