//! `cargo run --release --example refinement -- out/refinement`: the picture of the README, energy against the size of the elements.
//!
//! Half plate: viscous orbits with `β = 0.01` at three frequencies by three discretisations of the contact on five meshes, and, at one of the
//! frequencies, all conservative orbits that a set of starts leads to on three of them. About four minutes.

use std::path::{Path, PathBuf};

use signorini::orbit::Closure;
use signorini::orbit::census::{all, starts};
use signorini::orbit::search::Effort;
use signorini::report::figure::{
    self, Axis, Cell, Chart, Drawing, INK, LINES, Legend, Mark, Output, Sheet, entry, range,
};
use signorini::scenario::{Reduction, ReductionKind, Scene};
use signorini::store::Outputs;

mod orbits;

/// The frequency at which conservative orbits are looked for, and all frequencies.
const OMEGA: f64 = 1.8;
const FREQUENCIES: [f64; 3] = [1.7, OMEGA, 1.96];
const BETA: f64 = 0.01;
const MESHES: [[usize; 2]; 5] = [[10, 3], [15, 5], [20, 6], [30, 9], [46, 21]];

/// Length of the elements, and energy.
type Places = Vec<(f64, f64)>;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let stem = std::env::args().nth(1).ok_or("give the name of the picture")?;
    let scene = Scene::parse(include_str!("half-plate.toml"), Path::new("half-plate.toml"))?;
    let viscous: Vec<[Places; 3]> = (0..orbits::METHODS.len())
        .map(|method| viscous(&scene, method))
        .collect::<Result<_, String>>()?;
    let conservative = conservative(&scene)?;
    let drawing = Drawing { stem: PathBuf::from(stem), sheet: picture(&viscous, &conservative) };
    for path in figure::save(&[drawing], &Outputs::new(true), &Output::default())? {
        println!("{}", path.display());
    }
    Ok(())
}

/// Energies of the viscous orbits of a method over the meshes, at every frequency.
fn viscous(scene: &Scene, method: usize) -> Result<[Places; 3], String> {
    let mut places = [const { vec![] }; 3];
    for mesh in MESHES {
        let mut scene = orbits::with_method(scene.clone(), &mesh, method);
        // large bodies by 4.5/√β
        scene.reduction = (mesh[0] > 20).then_some(Reduction {
            kind: ReductionKind::FixedInterface,
            modes: None,
            cutoff: Some(45.0),
        });
        let mut body = orbits::body(&scene)?;
        for (omega, places) in FREQUENCIES.into_iter().zip(&mut places) {
            if let Some(orbit) = orbits::viscous(&mut body, BETA, omega)? {
                eprintln!("{}, {mesh:?}, {omega}: {}", orbits::METHODS[method], orbit.energy);
                places.push((1.0 / mesh[0] as f64, orbit.energy));
            }
        }
    }
    Ok(places)
}

/// Energies of all conservative orbits that are found on the first meshes.
fn conservative(scene: &Scene) -> Result<Places, String> {
    let mut places = vec![];
    for mesh in &MESHES[..3] {
        let mut body = orbits::body(&orbits::with_method(scene.clone(), mesh, 0))?;
        let starts = starts(&body, 4.0, 16);
        let effort = Effort { multipliers: false, ..Effort::default() };
        let found = all(&mut body, Closure::Reversible, &starts, OMEGA, &effort, |_, _| ())
            .map_err(|e| e.to_string())?;
        let energies: Vec<f64> = found.orbits.iter().map(|o| o.energy).collect();
        eprintln!("conservative, {mesh:?}: {energies:?}");
        places.extend(energies.into_iter().map(|e| (1.0 / mesh[0] as f64, e)));
    }
    Ok(places)
}

/// The lengths that are shown, and the energies beside the conservative orbits.
const X: (f64, f64) = (0.0, 0.105);
const Y: (f64, f64) = (0.5, 2.4);

/// How each method is drawn, the one that lies below first.
const MARKS: [Mark; 3] = [Mark::Triangle, Mark::Circle, Mark::Cross];

fn picture(viscous: &[[Places; 3]], conservative: &Places) -> Sheet<'static> {
    let methods = orbits::METHODS.iter().zip(LINES).zip(MARKS);
    let mut entries: Vec<_> =
        methods.map(|((name, colour), mark)| entry(*name, colour, mark)).collect();
    entries[0].0 = "viscous, β = 0.01: nodal boundary method".into();
    entries.push(entry("conservative orbits of the mesh", INK, Mark::Dot));
    let of = |k: usize| viscous.iter().map(|of| of[k].clone()).collect::<Vec<_>>();
    let mut main = chart(&of(1), Y, &format!("energy at ω = {OMEGA:.2}"));
    main.marks(conservative.iter().copied().filter(|p| p.1 < Y.1), Mark::Dot, INK);
    let small = |(k, omega): (usize, f64)| {
        let y = range(of(k).iter().flatten().map(|p| p.1));
        Cell::from(chart(&of(k), (y.start, y.end), &format!("ω = {omega:.2}")))
    };
    Sheet::new("Half plate 1 × 0.3, gap 1", "energy of periodic motions on finer and finer meshes")
        .legend(Legend::Rows(entries))
        .row(400.0, vec![main.into()])
        .row(240.0, FREQUENCIES.into_iter().enumerate().map(small).collect())
}

/// A curve a method.
fn chart(all: &[Places], y: (f64, f64), label: &str) -> Chart {
    let x = Axis::linear("length of the elements", X.0..X.1);
    let mut chart = Chart::new(x, Axis::linear(label, y.0..y.1));
    for ((places, colour), mark) in all.iter().zip(LINES).zip(MARKS) {
        chart.series(places, mark, colour);
    }
    chart
}
