//! What forces and probes come to at every point of a family: against closed forms, against the motions themselves, and row by row whatever way the file was made.

use std::path::Path;

use nalgebra::{Complex, Matrix2, Vector2};
use ndarray::Array2;
use signorini::store::StoredFamily;

use crate::common::{hdf5_files, json, run};

fn written(folder: &Path, name: &str, text: &str) -> String {
    std::fs::write(folder.join(name), text).unwrap();
    folder.join(name).display().to_string()
}

/// Frequencies, labels, largest, least.
struct Extremes {
    omega: Vec<f64>,
    labels: Vec<String>,
    largest: Array2<f64>,
    least: Array2<f64>,
}

impl Extremes {
    fn read(path: &str) -> Extremes {
        let labels = StoredFamily::read(Path::new(path)).unwrap().watched;
        let labels = labels.into_iter().map(|w| w.label).collect();
        let file = hdf5_files().open(path).unwrap();
        let table = |name: &str| file.dataset(name).unwrap().read_2d().unwrap();
        Extremes {
            omega: file.dataset("backbone/omega").unwrap().read_raw().unwrap(),
            labels,
            largest: table("backbone/extremes/largest"),
            least: table("backbone/extremes/least"),
        }
    }

    fn at(&self, row: usize, label: &str) -> [f64; 2] {
        let k = self.labels.iter().position(|l| l == label);
        let k = k.unwrap_or_else(|| panic!("{label}: {:?}", self.labels));
        [self.least[(row, k)], self.largest[(row, k)]]
    }
}

/// Two masses between springs, shaken far from their stop: amplitudes by complex numbers, of displacements, velocities, accelerations and of the spring to the wall.
#[test]
fn linear_responses_have_their_amplitudes() {
    let folder = tempfile::tempdir().unwrap();
    let market = |a: [[f64; 2]; 2]| {
        format!(
            "%%MatrixMarket matrix array real general\n2 2\n{}\n{}\n{}\n{}\n",
            a[0][0], a[1][0], a[0][1], a[1][1]
        )
    };
    written(folder.path(), "K.mtx", &market([[2.0, -1.0], [-1.0, 1.0]]));
    written(folder.path(), "M.mtx", &market([[1.0, 0.0], [0.0, 2.0]]));
    let quantities = "quantity = ['displacement', 'velocity', 'acceleration']\n";
    let text = format!(
        "[body]\nkind = 'matrices'\nstiffness_matrix = 'K.mtx'\nmass_matrix = 'M.mtx'\n\
         [contact]\ndisplacements = [0]\ngaps = [50.0]\nmethod = 'stop'\nstiffness = 1.0\n\
         [damping]\nrayleigh = [0.03, 0.02]\n[[spring]]\nrow = 1\nstiffness = 0.5\n\
         [[load]]\nkind = 'force'\ndisplacement = 1\namplitude = 0.3\nomega = 1.0\n\
         [[probe]]\nname = 'a'\nnode = 0\n{quantities}[[probe]]\nname = 'b'\nnode = 1\n{quantities}[run]\nuntil = 1.0\n"
    );
    let scene = written(folder.path(), "s.toml", &text);
    let (k, m) = (Matrix2::new(2.0, -1.0, -1.0, 1.5), Matrix2::new(1.0, 0.0, 0.0, 2.0));
    // the spring is damped with the rest
    let c = m * 0.03 + k * 0.02;
    for method in ["shooting", "hbm"] {
        let file = folder.path().join(format!("{method}.h5")).display().to_string();
        let range = ["--range", "0.5,1.5", "--step", "0.1"];
        json(&[&["response", &scene, "--method", method, "-o", &file][..], &range].concat());
        let seen = Extremes::read(&file);
        assert!(seen.omega.len() > 8, "{method}: {:?}", seen.omega);
        for (row, &w) in seen.omega.iter().enumerate() {
            let z = |re: f64, im: f64| Complex::new(re, im);
            let d = (k - m * w * w).map(|x| z(x, 0.0)) + c.map(|x| z(0.0, w * x));
            let u = d.try_inverse().unwrap() * Vector2::new(z(0.0, 0.0), z(0.3, 0.0));
            let mut wanted = vec![("spring[spring[0]]".to_owned(), 0.5 * u[1].norm())];
            for (name, u) in [("a", u[0].norm()), ("b", u[1].norm())] {
                let of = [("displacement", u), ("velocity", w * u), ("acceleration", w * w * u)];
                wanted.extend(of.map(|(q, x)| (format!("{q}_x[{name}]"), x)));
            }
            for (label, amplitude) in wanted {
                let label = seen.labels.iter().find(|l| {
                    **l == label
                        || (label.starts_with("spring") && l.starts_with("spring["))
                        || **l == label.replace("_x", "_scalar")
                });
                let label = label.unwrap_or_else(|| panic!("{:?}", seen.labels)).clone();
                let [least, largest] = seen.at(row, &label);
                // of 200 states tops of parabolas are right to h⁴
                assert!(
                    (largest - amplitude).abs() < 1e-6 * amplitude
                        && (least + amplitude).abs() < 1e-6 * amplitude,
                    "{method} {w} {label}: {least} {largest} {amplitude}"
                );
            }
        }
    }
}

const PLATE: &str = "[body]\nkind = 'plate'\nsize = [1.0, 0.3]\nelements = [6, 2]\nyoung = 1.0\npoisson = 0.3\ndensity = 1.0\n\
[[support]]\nedge = 'left'\nfix = ['x', 'y']\n[contact]\nedge = 'right'\ngap = 0.02\nmethod = 'mass-redistribution'\n\
[[load]]\nkind = 'traction'\nedge = 'top'\namplitude = [0.01, 0.002]\nomega = 1.3\n\
[[probe]]\nname = 'tip'\nnode = 20\nquantity = ['displacement', 'velocity', 'acceleration']\n\
[[probe]]\nname = 'root'\nat = [0.05, 0.25]\nquantity = ['stress']\n[run]\nuntil = 1.0\n";

/// A period of an orbit at a frequency, seen at 6000 instants: the least and the largest of each column, and what the family says of them.
fn hold_against_the_motion(
    folder: &Path,
    (text, scene): (&str, &str),
    (seen, row): (&Extremes, usize),
) {
    let at = |name: &str| folder.join(name).display().to_string();
    let omega = format!("{:.17}", seen.omega[row]);
    json(&["orbit", scene, "--omega", &omega, "-o", &at("o.h5"), "--force"]);
    let long = text
        .replace("omega = 1.3\n[[probe]]", &format!("omega = {omega}\n[[probe]]"))
        .replace("until = 1.0", "periods = 1\nsamples = 6000\n[initial]\nfile = 'o.h5'");
    let long = written(folder, "long.toml", &long);
    json(&["run", &long, "-o", &at("l.h5"), "--force"]);
    run(&["export", &at("l.h5"), "-o", &at("o"), "-q", "--force"]);
    let table = std::fs::read_to_string(at("o.csv")).unwrap();
    let mut lines = table.lines().map(|l| l.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap();
    let rows: Vec<Vec<f64>> =
        lines.map(|l| l.iter().map(|x| x.parse().unwrap_or(f64::NAN)).collect()).collect();
    let mut compared = 0;
    for label in &seen.labels {
        let Some(k) = header.iter().position(|h| h == label) else { continue };
        let (mut least, mut largest) = (f64::INFINITY, f64::NEG_INFINITY);
        rows.iter().for_each(|r| (least, largest) = (least.min(r[k]), largest.max(r[k])));
        let size = least.abs().max(largest.abs());
        let own = seen.at(row, label);
        let apart = (own[0] - least).abs().max((own[1] - largest).abs());
        // accelerations and stresses have waves that 200 states show coarsely
        let near = if label.contains("acceleration") { 0.02 } else { 5e-3 };
        assert!(apart < near * size + 1e-12, "{omega} {label}: {own:?} {least} {largest}");
        compared += 1;
    }
    // contact and support along both axes, three quantities of two components, four of stress
    assert_eq!(compared, 14, "{:?} {header:?}", seen.labels);
}

/// Of a plate that strikes its stop, smooth or rough: the largest of each column of the orbit's own motion, at every frequency; a series comes near.
#[test]
fn a_family_knows_what_its_orbits_come_to() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let at = |name: &str| folder.join(name).display().to_string();
    let text = format!("{PLATE}[damping]\nratio = 0.02\nmode = 1\n[orbit]\nomega = 1.3\n");
    let rough = text.replace("gap = 0.02\n", "gap = 0.02\nfriction = 0.3\n");
    let range = ["--method", "shooting", "--range", "1.45,1.6"];
    let family = |text: &str, name: &str| {
        let scene = written(folder, &format!("{name}.toml"), text);
        let file = at(&format!("{name}.h5"));
        json(&[&["response", &scene, "-o", &file], &range[..]].concat());
        (scene, Extremes::read(&file))
    };
    let (scene, seen) = family(&rough, "rough");
    let touches = |seen: &Extremes| -> Vec<usize> {
        (0..seen.omega.len()).filter(|r| seen.at(*r, "force[right]")[1] > 0.0).collect()
    };
    let all = touches(&seen);
    for row in [all[0], all[all.len() / 2], all[all.len() - 1]] {
        hold_against_the_motion(folder, (&rough, &scene), (&seen, row));
    }
    let (scene, seen) = family(&text, "s");
    let all = touches(&seen);
    assert!(all.len() > 3, "{all:?}");
    let chosen = [all[0], all[all.len() / 2], all[all.len() - 1]];
    for row in chosen {
        hold_against_the_motion(folder, (&text, &scene), (&seen, row));
        // a force as a whole is that of its only component
        assert_eq!(seen.at(row, "force[right]")[1], -seen.at(row, "force_x[right]")[0]);
    }
    // by harmonic balance
    let w = seen.omega[chosen[1]];
    let w = format!("{w:.17},{:.17}", w * (1.0 + 1e-9));
    let series = |harmonics: &str| {
        let hbm = ["response", &scene, "--method", "hbm", "--harmonics", harmonics];
        json(&[&hbm[..], &["--range", &w, "-o", &at("h.h5"), "--force"]].concat());
        Extremes::read(&at("h.h5"))
    };
    let [few, many] = ["25", "81"].map(series);
    let off = |series: &Extremes, label: &str| {
        let (a, b) = (seen.at(chosen[1], label), series.at(0, label));
        (a[0] - b[0]).abs().max((a[1] - b[1]).abs()) / a[1].max(-a[0])
    };
    for label in ["support[left]", "displacement_x[tip]", "stress_xx[root]", "force[right]"] {
        assert!(off(&few, label) < 2e-3, "{label}: {:e}", off(&few, label));
    }
    // what jumps at switches is right there to the order of one harmonic
    for label in ["acceleration_x[tip]", "acceleration_y[tip]"] {
        let [few, many] = [off(&few, label), off(&many, label)];
        eprintln!("{label}: {few:.3} {many:.3}");
        assert!(many < 0.15 && many < 0.6 * few, "{label}: {few} {many}");
    }
}

/// Several branches side by side, one that goes on after a stop, a sweep: rows are those of their points; and they reach tables and pictures.
#[test]
fn rows_of_extremes_are_those_of_their_points() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let text = format!("{PLATE}[damping]\nratio = 0.02\nmode = 1\n");
    let scene = written(folder.path(), "s.toml", &text);
    let range = ["--method", "shooting", "--range", "1.5,1.6"];
    let of = |more: &[&str], file: &str| {
        let file = at(file);
        json(&[&["response", &scene, "-o", &file], &range[..], more].concat());
        Extremes::read(&file)
    };
    let both = of(&["--ratios", "0.02,0.04"], "both.h5");
    let [first, second] =
        [of(&["--ratios", "0.02"], "first.h5"), of(&["--ratios", "0.04"], "second.h5")];
    let rows = |all: &[&Extremes]| -> Vec<Vec<u64>> {
        let of = |e: &&Extremes| {
            let tables = e.largest.rows().into_iter().zip(e.least.rows());
            tables
                .map(|(a, b)| a.iter().chain(b).map(|x| x.to_bits()).collect::<Vec<_>>())
                .collect::<Vec<_>>()
        };
        let mut rows: Vec<Vec<u64>> = all.iter().flat_map(of).collect();
        rows.sort();
        rows
    };
    assert_eq!(both.omega.len(), first.omega.len() + second.omega.len());
    assert!(rows(&[&both]) == rows(&[&first, &second]), "rows of several branches");
    // what goes on has what was there
    let part = at("part.h5");
    run(&[&["response", &scene, "-o", &part, "--points", "2", "-q"], &range[..]].concat());
    json(&[&["response", &scene, "-o", &part, "--resume"], &range[..]].concat());
    let whole = of(&[], "whole.h5");
    assert!(rows(&[&Extremes::read(&part)]) == rows(&[&whole]), "rows after a stop");
    // tables
    run(&["export", &at("whole.h5"), "-o", &at("t"), "-q"]);
    let table = std::fs::read_to_string(at("t.csv")).unwrap();
    let header: Vec<&str> = table.lines().next().unwrap().split(',').collect();
    let k = header.iter().position(|h| *h == "largest_displacement_x[tip]").unwrap();
    let line: Vec<&str> = table.lines().nth(2).unwrap().split(',').collect();
    assert_eq!(line[k].parse::<f64>().unwrap(), whole.at(1, "displacement_x[tip]")[1]);
    assert_eq!(line.len(), header.len());
    // what stands out
    let told = json(&["inspect", &at("whole.h5")]);
    let highest = whole.omega.iter().enumerate().map(|(row, omega)| {
        let [least, largest] = whole.at(row, "displacement_y[tip]");
        (least.abs().max(largest.abs()), *omega)
    });
    let highest = highest.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
    let named = told["largest"].as_array().unwrap();
    let own = named.iter().find(|l| l["name"] == "displacement_y[tip]").unwrap();
    assert_eq!(
        (own["magnitude"].as_f64(), own["omega"].as_f64()),
        (Some(highest.0), Some(highest.1))
    );
    assert!(named.iter().all(|l| l["name"] != "force_y[right]" && l["name"] != "support_x[left]"));
    // pictures
    let plot = run(&["plot", &at("whole.h5"), "--only", "forces,probes", "-o", &at("p")]);
    assert!(plot.status.success(), "{}", String::from_utf8_lossy(&plot.stderr));
    let svg = std::fs::read_to_string(at("p-forces.svg")).unwrap();
    assert!(svg.contains("support[left]") && !svg.contains("support_x"), "whole forces");
    assert!(std::fs::read_to_string(at("p-probes.svg")).unwrap().contains("stress_xx[root]"));
    // a sweep settles to the same
    let sweep = of(&["--sweep", "up", "--step", "0.05"], "sweep.h5");
    for (row, omega) in sweep.omega.iter().enumerate() {
        let [_, largest] = sweep.at(row, "displacement_x[tip]");
        assert!(largest > 0.0 && largest < 1.0, "{omega}: {largest}");
    }
}
