//! `signorini bands`: how far a family moves with numbers of its scene that are not known exactly.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::{Map, Value, json};

use signorini::families::bands::{self, orbits};
use signorini::problem::Problem;
use signorini::records::{BandRow, Bands, Deviation, Status, fingerprint};
use signorini::report::summary::significant;
use signorini::scenario::Scene;
use signorini::store::{Head, StoredBands, StoredFamily, read_bands, write_bands};

use super::family::Output;
use super::progress::Bar;
use super::task::{Files, Task, Work, check_same};
use super::whole::{Kept, Whole, begun, inspected, of_scene, said};
use super::{Answer, CliError, Global, load};

/// Arguments of `bands`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini response scenarios/two-mass-stop.toml --method shooting -o response.h5\n  signorini bands response.h5 --deviation contact.gap=2%,damping.rayleigh[1]=10%,contact.stiffness=10% -o bands.h5\n  signorini plot bands.h5\n\nEvery orbit of the family is differentiated by the numbers, exactly; to first order in independent deviations sigma_A^2 = sum (A_q sigma_q)^2 at the frequency of the orbit. The picture shows what that moves the curve across itself, which stays finite at folds."
)]
pub struct Arguments {
    /// A family of orbits: of `backbone` or `response`
    family: PathBuf,
    /// Standard deviations of numbers of its scene, by their keys, in the number's unit or in per cent of it: contact.gap=0.02,damping.ratio=10%
    #[arg(long, required = true, value_name = "KEY=SIGMA", value_delimiter = ',')]
    deviation: Vec<String>,
    /// Go on with an unfinished file
    #[arg(long)]
    resume: bool,
    #[command(flatten)]
    output: Output,
}

/// Deviations are not smaller, nor larger: their squares are numbers.
const SIZES: (f64, f64) = (1e-100, 1e100);

/// `KEY=SIGMA` or `KEY=PERCENT%`, of a number of a scene.
fn deviation(scene: &Scene, text: &str) -> Result<Deviation, CliError> {
    let refuse = || {
        let help = "give a key of the scene and a positive standard deviation: contact.gap=0.02, or in per cent of the number: contact.gap=2%";
        CliError::Input(format!("--deviation {text}: {help}"))
    };
    let (key, size) = text.split_once('=').ok_or_else(refuse)?;
    let (key, size) = (key.trim(), size.trim());
    if key == "omega" {
        return Err(CliError::Input(
            "--deviation omega: families are drawn over it; leave it out".into(),
        ));
    }
    let value = scene.number(key)?;
    if value == 0.0 && size.ends_with('%') {
        let text = format!("--deviation {text}: the number is 0; give the deviation in its unit");
        return Err(CliError::Input(text));
    }
    let number = |s: &str| s.trim().parse::<f64>().ok();
    let sigma = match size.strip_suffix('%') {
        Some(percent) => number(percent).map(|p| p / 100.0 * value.abs()),
        None => number(size),
    };
    let sigma = sigma.filter(|s| (SIZES.0..=SIZES.1).contains(s)).ok_or_else(refuse)?;
    Ok(Deviation { key: key.to_owned(), value, sigma })
}

/// What is asked for, checked.
pub struct Request {
    problem: Problem,
    fingerprint: u64,
    family: StoredFamily,
    /// What is known already.
    found: Bands,
    is_whole: bool,
}

impl Task for Arguments {
    type Plan = Request;
    type Found = Bands;

    fn files(&self) -> Files<'_> {
        let read = vec![self.family.as_path()];
        Files { scene: &self.family, read, force: self.output.force, resume: self.resume }
    }

    /// The scene of the family.
    fn scene(&self, global: &Global) -> Result<Scene, CliError> {
        let text = StoredFamily::read(&self.family)?.scene;
        let mut scene = load::stored(&self.family, &text).ok_or_else(|| {
            let file = self.family.display();
            CliError::Input(format!(
                "{file}: the scene that made it cannot be read by this version: compute the family again"
            ))
        })?;
        scene.unlimited = global.force_large;
        Ok(scene)
    }

    fn output(&self, scene: &Scene) -> Result<PathBuf, CliError> {
        Ok(self.output.path(scene, "bands"))
    }

    fn plan(&self, work: &mut Work) -> Result<Request, CliError> {
        let scene = &work.scene;
        let family = StoredFamily::read(&self.family)?;
        let ratios = family.branches.iter().filter(|b| b.percent().is_some()).count();
        let is_share = |t: &&String| t.trim_start().starts_with("damping.ratio") && t.contains('%');
        if let Some(text) = self.deviation.iter().find(is_share).filter(|_| ratios > 0) {
            return Err(CliError::Input(format!(
                "--deviation {text}: the branches of the family have damping ratios of their own; give the deviation as a ratio: damping.ratio=0.002"
            )));
        }
        let mut deviations = vec![];
        for text in &self.deviation {
            deviations.push(deviation(scene, text)?);
        }
        deviations.sort_by(|a, b| a.key.cmp(&b.key));
        if let Some(two) = deviations.windows(2).find(|two| two[0].key == two[1].key) {
            return Err(CliError::Input(format!("--deviation: {} stands there twice", two[0].key)));
        }
        if orbits(&family).is_empty() {
            let file = self.family.display();
            return Err(CliError::Input(format!(
                "{file} holds no orbits: give a family by shooting"
            )));
        }
        let problem = load::warned(scene, work.global)?;
        bands::check(scene, &family, &deviations)?;
        let fingerprint = fingerprint(scene, &problem) ^ bands::fingerprint(&family);
        let asked = Bands { deviations, rows: vec![] };
        let of = (scene, fingerprint);
        let (found, is_whole) =
            begun((work, self.resume), asked, |asked| earlier(&work.path, of, asked))?;
        Ok(Request { problem, fingerprint, family, found, is_whole })
    }

    fn carry_out(&self, work: &Work, plan: &mut Request) -> Result<Bands, CliError> {
        if plan.is_whole {
            return Ok(plan.found.clone());
        }
        let (global, options) = (work.global, work.options_again());
        let name = self.family.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let write = |found: &Bands, status: &Status| {
            let of = (name.as_str(), plan.fingerprint);
            let what = (&work.scene, &plan.problem.system);
            write_bands(&work.path, what, of, &options, found, status)
        };
        let mut found = plan.found.clone();
        let mut kept = Kept::begin(work, &write, &found)?;
        let bar = Bar::named(global, format!("{}, derivatives", work.scene.stem()));
        let count = orbits(&plan.family).len();
        let mut take = |found: &Bands| {
            let share = found.rows.len() as f64 / count as f64;
            bar.iter().for_each(|bar| bar.set(share, format!("{} orbits", found.rows.len())));
            kept.step(found)
        };
        let ends_now = || global.caller.signal().is_some();
        let what = (&work.scene, &plan.family);
        let go = bands::follow(what, &mut found, (&mut take, &ends_now));
        bar.iter().for_each(Bar::clear);
        let told = format!("{} of {count} orbits are", found.rows.len());
        kept.end(found, go.map(|go| go.is_continue()), &told)
    }

    fn say(&self, work: &Work, _: &Request, found: Bands) -> Result<Answer, CliError> {
        Ok(said(work, &found))
    }
}

/// What an earlier run of the same command left.
fn earlier(path: &Path, of: (&Scene, u64), asked: &Bands) -> Result<(Head, Bands), CliError> {
    let stored = read_bands(path)?;
    let of_scene = of_scene((&stored.head, stored.problem), of);
    let own = [("another --deviation", stored.bands.deviations == asked.deviations)];
    check_same(path, &[&of_scene[..], &own].concat())?;
    Ok((stored.head, stored.bands))
}

/// What a file of bands holds.
pub(super) fn inspect(file: &Path, scene: bool, global: &Global) -> Result<Answer, CliError> {
    let StoredBands { head, bands, .. } = read_bands(file)?;
    Ok(inspected(global, scene, head, &bands))
}

impl Whole for Bands {
    fn to_json(&self) -> Value {
        let of =
            |f: &dyn Fn(&BandRow) -> Value| -> Vec<Value> { self.rows.iter().map(f).collect() };
        let mut by = Map::new();
        for (number, d) in self.deviations.iter().enumerate() {
            let json = json!({
                "value": d.value,
                "deviation": d.sigma,
                "amplitude": of(&|row| json!(row.by[number][0])),
                "energy": of(&|row| json!(row.by[number][1])),
            });
            by.insert(d.key.clone(), json);
        }
        json!({
            "branch": of(&|row| json!(row.branch)),
            "index": of(&|row| json!(row.index)),
            "omega": of(&|row| json!(row.omega)),
            "amplitude": of(&|row| json!(row.heights[0])),
            "amplitude_deviation": of(&|row| json!(self.sigma(row)[0])),
            "amplitude_along": of(&|row| json!(row.along[0])),
            "energy": of(&|row| json!(row.heights[1])),
            "energy_deviation": of(&|row| json!(self.sigma(row)[1])),
            "energy_along": of(&|row| json!(row.along[1])),
            "sensitivity": by,
            "note": of(&|row| json!(row.note)),
        })
    }

    fn to_text(&self) -> String {
        let mut out = String::new();
        for d in &self.deviations {
            let (value, sigma) = (significant(d.value, 6), significant(d.sigma, 4));
            let _ = writeln!(out, "  {:<14}{} = {value} ± {sigma}", "number", d.key);
        }
        let known = || self.rows.iter().filter(|row| self.sigma(row)[0].is_finite());
        let _ = writeln!(
            out,
            "  {:<14}{} of {} with all derivatives",
            "orbits",
            known().count(),
            self.rows.len()
        );
        let highest = known().max_by(|a, b| a.heights[0].total_cmp(&b.heights[0]));
        if let Some(row) = highest {
            let mut cause: Vec<(f64, &str)> = self
                .deviations
                .iter()
                .enumerate()
                .map(|(k, d)| (self.share(row, k), d.key.as_str()))
                .collect();
            cause.sort_by(|a, b| b.0.total_cmp(&a.0));
            let cause: Vec<String> =
                cause.iter().map(|(share, key)| format!("{key} {:.0} %", 100.0 * share)).collect();
            let _ = writeln!(
                out,
                "  {:<14}{} ± {} at omega = {} (at that frequency): {}",
                "largest",
                significant(row.heights[0], 6),
                significant(self.sigma(row)[0], 3),
                significant(row.omega, 7),
                cause.join(", ")
            );
        }
        let mut notes: Vec<&str> =
            self.rows.iter().map(|row| row.note.as_str()).filter(|n| !n.is_empty()).collect();
        notes.sort_unstable();
        let mut told = 0;
        for same in notes.chunk_by(|a, b| a == b) {
            told += 1;
            if told <= 4 {
                let _ = writeln!(out, "  {:<14}{} orbits: {}", "without", same.len(), same[0]);
            }
        }
        out
    }
}
