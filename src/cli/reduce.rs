//! `signorini reduce`

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use signorini::contact::System;
use signorini::fem::Csr;
use signorini::problem::Problem;
use signorini::scenario::Scene;
use signorini::store::{Array, ArrayFormat, Outputs, write_arrays};

use super::{Answer, CliError, Global, load};

/// Arguments of `reduce`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini reduce scenarios/bracket.toml -o bracket-rom.h5\n  signorini reduce scenarios/blade.toml -o blade.mat --basis      # load('blade.mat') in MATLAB\n\n\
    Arrays: K, M, C (where anything damps), W (displacements of the contact points towards their obstacles), gap, and of the loads constant, force, omega, phase, derivative; \
    u_0, v_0; with --basis B, displacements of the mesh over the coordinates. [reduction] of the scene says how it is reduced; without it the whole body is written. \
    M u'' + C u' + K u = constant + sum of force_j d^m/dt^m cos(omega_j t + phase_j) - W' lambda with gap - W u >= 0, lambda >= 0, one of them 0."
)]
pub struct Arguments {
    /// The scene (TOML)
    scene: PathBuf,
    /// The file: .h5, .mat (MATLAB 5, any version reads it) or .npz (NumPy) [default: STEM-reduced.h5]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// With B: displacements along the axes, as mesh/dof_map counts them, over the coordinates
    #[arg(long)]
    basis: bool,
    /// Overwrite an existing file of signorini's
    #[arg(long)]
    force: bool,
}

/// Arrays of one dimension.
const LISTS: [&str; 7] = ["gap", "constant", "omega", "phase", "derivative", "u_0", "v_0"];

/// Coordinates of which full matrices are written.
const MOST: usize = 6000;

/// Write the matrices of a scene.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Answer, CliError> {
    let scene = global.scene(&arguments.scene)?;
    let problem = load::warned(&scene, global)?;
    let system = &problem.system;
    let n = system.n_displacements();
    if system.remembers() {
        return Err(CliError::Input(format!(
            "{}: what springs of sliders, or displacements without mass along obstacles, remember is in no matrix: leave out the stiffness of the sliders, or tangent = \"massless\"",
            arguments.scene.display()
        )));
    }
    if n > MOST {
        return Err(CliError::Input(format!(
            "{}: {n} displacements, and full matrices are written of up to {MOST}: give [reduction] modes = 20",
            arguments.scene.display()
        )));
    }
    if arguments.basis && scene.rows.superelement.is_some() {
        return Err(CliError::Input(format!(
            "{}: --basis is of meshes, and this body comes from matrices in free-interface form: leave it out",
            arguments.scene.display()
        )));
    }
    let path = arguments.output.clone().unwrap_or_else(|| {
        let stem = arguments.scene.file_stem().unwrap_or_default().to_string_lossy();
        PathBuf::from(format!("{stem}-reduced.h5"))
    });
    let Some(format) = ArrayFormat::of(&path) else {
        let name = path.display();
        return Err(CliError::Input(format!("{name}: give a file that ends in .h5, .mat or .npz")));
    };
    let outputs = Outputs::new(arguments.force).reads(&arguments.scene);
    outputs.check(&path)?;
    let arrays = arrays(&problem, arguments.basis);
    write_arrays(&path, format, &arrays, &scene.source.text)?;
    let warnings = warnings(system);
    Ok(global.answer(
        || to_json(&path, &arrays, &warnings),
        || to_text(&scene, (&path, &arrays), system, &warnings),
    ))
}

fn full(a: &Csr) -> (usize, usize, Vec<f64>) {
    let (rows, columns) = (a.n_rows(), a.n_cols());
    let mut values = vec![0.0; rows * columns];
    a.triplets().for_each(|(i, j, v)| values[columns * i + j] = v);
    (rows, columns, values)
}

fn arrays(problem: &Problem, basis: bool) -> Vec<Array> {
    let system = &problem.system;
    let given = system.given();
    let n = system.n_displacements();
    let mut all = vec![];
    let mut add = |name, about, (rows, columns, values): (usize, usize, Vec<f64>)| {
        if rows * columns > 0 {
            let is_list = LISTS.contains(&name);
            all.push(Array { name, about, shape: (rows, columns), is_list, values });
        }
    };
    add("K", "stiffness", full(&given.stiffness));
    add("M", "mass", full(&given.mass));
    if let Some(damping) = &given.damping {
        add("C", "damping", full(damping));
    }
    add("W", "displacements of the contact points towards their obstacles", full(&given.contact));
    add("gap", "distances to the obstacles", (given.gap.len(), 1, given.gap));
    let loads = &system.loads;
    let short = |f: &[f64]| f[..n].to_vec();
    if let Some(constant) = &loads.constant {
        add("constant", "constant load", (n, 1, short(constant)));
    }
    let waves = &loads.harmonics;
    let forces = waves.iter().flat_map(|h| short(&h.force)).collect();
    add("force", "harmonic loads, a row each", (waves.len(), n, forces));
    let column = |of: &dyn Fn(&signorini::fem::Harmonic) -> f64| {
        (waves.len(), 1, waves.iter().map(of).collect::<Vec<f64>>())
    };
    add("omega", "their circular frequencies", column(&|h| h.omega));
    add("phase", "their phases", column(&|h| h.phase));
    add(
        "derivative",
        "which derivative of cos(omega t + phase)",
        column(&|h| f64::from(h.derivative)),
    );
    if let Some([u, v]) = system.whole_state(&problem.initial) {
        add("u_0", "initial displacements", (n, 1, short(&u)));
        add("v_0", "initial velocities", (n, 1, short(&v)));
    }
    if basis {
        let body = &system.body;
        let columns: Vec<Vec<f64>> = (0..n)
            .map(|j| {
                let mut unit = vec![0.0; system.n()];
                unit[j] = 1.0;
                body.nodal_dofs().along_axes(&body.nodal(&unit))
            })
            .collect();
        let rows = columns.first().map_or(0, Vec::len);
        let values = (0..rows).flat_map(|i| columns.iter().map(move |c| c[i])).collect();
        add(
            "B",
            "displacements of the mesh along the axes over the coordinates",
            (rows, n, values),
        );
    }
    all
}

/// What of the scene is in no array.
fn warnings(system: &System) -> Vec<String> {
    let mut all = vec![];
    if system.tangents().is_some() || !system.sliders().is_empty() {
        all.push("friction and sliders are none of these arrays");
    }
    if system.promise().yields {
        all.push("springs of the obstacle are none of these arrays");
    } else if system.n_contact() > 0 && !(system.has_massless_contact() && system.bears_reactions())
    {
        all.push("the scene treats its contact otherwise than by forces on displacements without mass: these arrays with gap and W need an impact law; method = \"mass-redistribution\" gives arrays that say all");
    }
    if system.loads.carried.moves_contact() {
        all.push("the gap moves: contact displacements are counted from where it has gone, and its motion is none of these arrays (force has what it does)");
    }
    if !system.loads.measured.is_empty() {
        all.push("measured loads are none of these arrays");
    }
    all.into_iter().map(str::to_owned).collect()
}

fn to_json(path: &Path, arrays: &[Array], warnings: &[String]) -> serde_json::Value {
    let shape = |a: &Array| json!({ "name": a.name, "shape": [a.shape.0, a.shape.1] });
    json!({ "output": path.display().to_string(), "arrays": arrays.iter().map(shape).collect::<Vec<_>>(), "warnings": warnings })
}

fn to_text(
    scene: &Scene,
    (path, arrays): (&Path, &[Array]),
    system: &System,
    warnings: &[String],
) -> String {
    let mut out = format!("{}\n", super::title(scene));
    let (n, n_o) = (system.n_displacements(), system.n_o());
    let of_contact = match n - n_o {
        0 => "those at the contact among them".to_owned(),
        count => format!("the last {count} at the contact"),
    };
    let _ = writeln!(out, "  coordinates {n}, {of_contact}");
    for a in arrays {
        let (rows, columns) = a.shape;
        let size = if columns == 1 { rows.to_string() } else { format!("{rows} × {columns}") };
        let _ = writeln!(out, "  {:<12}{size:<14}{}", a.name, a.about);
    }
    for warning in warnings {
        let _ = writeln!(out, "  WARNING     {warning}");
    }
    let _ = writeln!(out, "  written to  {}", path.display());
    out
}
