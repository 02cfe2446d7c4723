//! `cargo run --release --example scaling -- out/scaling [SIZES]`: cost against the number of unknowns, the picture and the table of `docs/performance.md`.
//!
//! Plates from 10⁴ to 10⁶ unknowns (lumped mass) swing against the obstacle for one period by the flow without modes, and so do the same plates as files of
//! Gmsh whose quadrilaterals are all different, and boxes in space to 3·10⁵ unknowns and 1,190 contact nodes. Beside their times stands what the memory of this
//! machine would take for the same products at the least.
//! `SIZES`: how many of the seven; all take about half an hour, most of it the largest box.

#[path = "../bodies/cuboid.rs"]
mod cuboid;
#[path = "../bodies/rectangle.rs"]
mod rectangle;

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

use plotters::style::RGBColor;
use rayon::prelude::*;
use signorini::event::{Observer, Sample};
use signorini::mesh::{ElementKind, Mesh};
use signorini::problem::Problem;
use signorini::report::figure::{
    self, Axis, Chart, Drawing, Entry, LINES, Legend, Mark, Output, Sheet, entry,
};
use signorini::scenario::Scene;
use signorini::simulate::simulate;
use signorini::store::Outputs;

const SIZES: [[usize; 2]; 7] =
    [[100, 50], [142, 71], [200, 100], [284, 142], [400, 200], [632, 316], [1000, 500]];
/// Cells of the boxes.
const BOXES: [[usize; 3]; 4] = [[28, 11, 11], [40, 16, 16], [57, 23, 23], [84, 34, 34]];
/// How far inner nodes of meshes are moved, over the cells.
const SKEW: f64 = 0.2;
/// Bytes an unknown that a step of a recurrence moves at the least: two vectors are read, one is written.
const BYTES: f64 = 24.0;

const HEAD: &str = "| body | unknowns | contact nodes | switches | products | set-up | one period | a product | the memory alone | energy closes to | peak memory |\n\
    | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |";

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
    contacts: usize,
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
    let (mut plates, mut meshes, mut boxes) = (vec![], vec![], vec![]);
    for &size in &SIZES[..count] {
        plates.push(plate(size)?);
        // a file of half a million nodes says nothing more
        if size[0] <= 632 {
            meshes.push(flat(size)?);
        }
    }
    for &cells in BOXES.iter().take(count) {
        boxes.push(solid(cells)?);
    }
    // behind them: what it takes would be part of their memory
    let rate = bandwidth();
    println!("memory: {:.1} GB/s by {} threads\n", rate / 1e9, rayon::current_num_threads());
    println!("{HEAD}");
    for c in plates.iter().chain(&meshes).chain(&boxes) {
        println!(
            "| {} | {} | {} | {} | {} | {:.2} s | {:.2} s | {:.3} ms | {:.2} s | {:.0e} | {:.0} MB |",
            c.body,
            c.unknowns,
            c.contacts,
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
    let families = [
        Family { name: "plate", costs: plates, colour: LINES[0] },
        Family { name: "mesh", costs: meshes, colour: LINES[1] },
        Family { name: "box", costs: boxes, colour: LINES[3] },
    ];
    for family in &families {
        for (what, of) in CURVES {
            println!("{}, {what}: n^{:.2}", family.name, exponent(&family.costs, of));
        }
    }
    let drawing = Drawing { stem: PathBuf::from(stem), sheet: picture(&families, rate) };
    for path in figure::save(&[drawing], &Outputs::new(true), &Output::default())? {
        println!("{}", path.display());
    }
    Ok(())
}

fn plate([nx, ny]: [usize; 2]) -> Result<Cost, Box<dyn std::error::Error>> {
    let text = include_str!("plate.toml").replace("[20, 10]", &format!("[{nx}, {ny}]"));
    cost(format!("plate {nx} × {ny}"), &text)
}

/// The same plate as a mesh that repeats nothing.
fn flat([nx, ny]: [usize; 2]) -> Result<Cost, Box<dyn std::error::Error>> {
    let mesh = rectangle::rectangle(ElementKind::Quad4, [0.0, 1.0], 0.5, (nx, ny), SKEW);
    from_file(format!("mesh {nx} × {ny}"), &mesh, include_str!("mesh.toml"))
}

/// A box in space whose hexahedra are all different.
fn solid(cells: [usize; 3]) -> Result<Cost, Box<dyn std::error::Error>> {
    let mesh = cuboid::cuboid(ElementKind::Hex8, [1.0, 0.4, 0.4], cells, SKEW / 2.0);
    let [nx, ny, nz] = cells;
    from_file(format!("box {nx} × {ny} × {nz}"), &mesh, include_str!("box.toml"))
}

/// One period of a body whose mesh is read from a file of Gmsh.
fn from_file(body: String, mesh: &Mesh, text: &str) -> Result<Cost, Box<dyn std::error::Error>> {
    let file = std::env::temp_dir().join(format!("signorini-scaling-{}.msh", std::process::id()));
    std::fs::write(&file, rectangle::msh(mesh, |_| 0))?;
    let cost = cost(body, &text.replace("mesh.msh", &file.display().to_string()));
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
        contacts: problem.system.n_contact(),
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

/// Bodies of one kind, from the smallest to the largest.
struct Family {
    name: &'static str,
    costs: Vec<Cost>,
    colour: RGBColor,
}

/// Time of a period and of the set-up, and products, a colour a kind of body.
fn picture(families: &[Family; 3], rate: f64) -> Sheet<'static> {
    let [run, set_up, products] = CURVES;
    let times = [(run, Mark::Circle), (set_up, Mark::Triangle)];
    let curves: Vec<(Curve, Mark, &Family)> =
        times.into_iter().flat_map(|(c, m)| families.iter().map(move |f| (c, m, f))).collect();
    let name = |((what, of), mark, f): &(Curve, Mark, &Family)| {
        entry(format!("{what}, {}, n^{:.2}", f.name, exponent(&f.costs, *of)), f.colour, *mark)
    };
    let mut names: Vec<Entry> = curves.iter().map(name).collect();
    names.push(entry("the memory alone, for the plates' products", LINES[2], Mark::Dashes));
    let log = |costs: &[Cost], of: &dyn Fn(&Cost) -> f64| -> Vec<(f64, f64)> {
        costs.iter().map(|c| (c.unknowns.log10(), of(c).log10())).collect()
    };
    let least = log(&families[0].costs, &|c| floor(c, rate));
    let places: Vec<_> = curves.iter().map(|(c, _, f)| log(&f.costs, &c.1)).collect();
    let x = decades(least.iter().map(|p| &p.0));
    let y = decades(places.iter().flatten().chain(&least).map(|p| &p.1));
    let mut left = Chart::new(Axis::decades("unknowns", x.clone()), Axis::decades("seconds", y));
    for (place, (_, mark, family)) in places.iter().zip(&curves) {
        left.series(place, *mark, family.colour);
    }
    left.dashes(least, LINES[2], 1.4);
    let places: Vec<_> = families.iter().map(|f| log(&f.costs, &products.1)).collect();
    let y = decades(places.iter().flatten().map(|p| &p.1));
    let of: Vec<String> = families
        .iter()
        .map(|f| format!("n^{:.2} ({})", exponent(&f.costs, products.1), f.name))
        .collect();
    let label = format!("products: {}", of.join(", "));
    let mut right = Chart::new(Axis::decades("unknowns", x), Axis::decades(label, y));
    for (place, family) in places.iter().zip(families) {
        right.series(place, Mark::Circle, family.colour);
    }
    let what = "cost of one period against the number of unknowns";
    Sheet::new("Plates and boxes with lumped mass", what)
        .legend(Legend::Columns(names))
        .row(470.0, vec![left.into(), right.into()])
}
