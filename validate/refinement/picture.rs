//! `cargo run --release --example refinement -- out/refinement`: the picture of the README, energy against the size of the elements.
//!
//! Half plate at `ω = 1.80`: viscous orbits with `β = 0.01` by three discretisations of the contact on five meshes, and all conservative orbits that a set
//! of starts leads to on three of them. About three minutes.

use std::path::{Path, PathBuf};

use plotters::prelude::*;
use signorini::orbit::Closure;
use signorini::orbit::branch::{all, starts};
use signorini::orbit::search::Effort;
use signorini::report::figure::{
    self, DPI, Drawing, FigureError, INK, LINES, Mark, draw_line, legend_above, line, panel, px,
    symbols, title,
};
use signorini::scenario::{Reduction, Scene};
use signorini::store::Outputs;

mod orbits;

const OMEGA: f64 = 1.8;
const BETA: f64 = 0.01;
const MESHES: [[usize; 2]; 5] = [[10, 3], [15, 5], [20, 6], [30, 9], [46, 21]];

/// Places of a picture.
type Places = Vec<(f64, f64)>;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let stem = std::env::args().nth(1).ok_or("give the name of the picture")?;
    let scene = Scene::parse(include_str!("half-plate.toml"), Path::new("half-plate.toml"))?;
    let viscous: Vec<Places> = (0..orbits::METHODS.len())
        .map(|method| viscous(&scene, method))
        .collect::<Result<_, String>>()?;
    let conservative = conservative(&scene)?;
    let drawing = Drawing { stem: PathBuf::from(stem), svg: picture(&viscous, &conservative)? };
    for path in figure::save(&[drawing], &Outputs::new(true), DPI)? {
        println!("{}", path.display());
    }
    Ok(())
}

/// Energies of the viscous orbits over the meshes.
fn viscous(scene: &Scene, method: usize) -> Result<Places, String> {
    let mut places = vec![];
    for mesh in MESHES {
        let mut scene = orbits::with_method(scene.clone(), &mesh, method);
        // large bodies by 3.5/√β
        scene.reduction = (mesh[0] > 20).then_some(Reduction { modes: None, cutoff: Some(45.0) });
        let mut body = orbits::body(&scene)?;
        if let Some(orbit) = orbits::viscous(&mut body, BETA, OMEGA)? {
            eprintln!("{}, {mesh:?}: {}", orbits::METHODS[method], orbit.energy);
            places.push((1.0 / mesh[0] as f64, orbit.energy));
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
        let found = all(&mut body, Closure::Reversible, &starts, OMEGA, &effort, |_| ())
            .map_err(|e| e.to_string())?;
        eprintln!(
            "conservative, {mesh:?}: {:?}",
            found.iter().map(|o| o.energy).collect::<Vec<_>>()
        );
        places.extend(found.iter().map(|o| (1.0 / mesh[0] as f64, o.energy)));
    }
    Ok(places)
}

/// The meshes and energies that are shown.
const X: (f64, f64) = (0.0, 0.105);
const Y: (f64, f64) = (0.5, 2.4);

fn picture(viscous: &[Places], conservative: &Places) -> Result<String, FigureError> {
    figure::svg((860, 470), |root| {
        title(
            root,
            "Half plate, ω = 1.80",
            "energy of periodic motions on finer and finer meshes",
        )?;
        let (_, sheet) = root.split_vertically(px(32.0));
        let marks = [Mark::Dot, Mark::Triangle, Mark::Diamond];
        let mut entries: Vec<(&str, RGBColor, Mark)> = orbits::METHODS
            .iter()
            .zip(LINES)
            .zip(marks)
            .map(|((name, c), m)| (*name, c, m))
            .collect();
        entries[0].0 = "viscous, β = 0.01: nodal boundary method";
        entries.push(("conservative: all that were found", INK, Mark::Cross));
        let sheet = legend_above(sheet, &entries)?;
        let mut chart = panel(&sheet, X.0..X.1, Y.0..Y.1, "length of the elements", "energy")?;
        for (places, (_, colour, mark)) in viscous.iter().zip(&entries) {
            draw_line(&mut chart, places.clone(), line(*colour, 1.6))?;
            symbols(&chart, places.iter().copied(), *mark, *colour)?;
        }
        let shown: Places = conservative.iter().copied().filter(|p| p.1 < Y.1).collect();
        symbols(&chart, shown, Mark::Cross, INK)
    })
}
