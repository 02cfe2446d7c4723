//! `signorini compare`

use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;

use signorini::compare::reference::Named;
use signorini::compare::{
    CompareError, Means, Plan, Request, Task, Variant, orbits, outline, rows,
};
use signorini::continuation::Go;
use signorini::problem::Problem;
use signorini::records::{Compared, Comparison, Quantity, Row, Status, fingerprint};
use signorini::report::comparison::{csv, json, picture, text};
use signorini::report::figure::{self, Drawing, FigureError};
use signorini::scenario::{BodyKind, Elements, Scene};
use signorini::simulate::run_table;
use signorini::store::{ComparisonWriter, Outputs, beside, read_comparison, replace};

use super::caller::Caller;
use super::progress::Bar;
use super::task::{self, Files, Work};
use super::{Answer, CliError, Global, family, load, plain, resources};

/// Arguments of `compare`.
#[derive(Debug, Args)]
#[command(
    after_help = "Names of methods: nbm, nbm:constant, nbm:reaction, mass-redistribution, mass-redistribution:optimal, penalty, penalty:10, nitsche, nitsche:10, \
    nitsche:theta=0, impact, impact:1, moreau-jean, waves, waves:step; what stands behind a colon is a word or number of the method, or KEY=VALUE of [contact].\n\n\
    Example:\n  signorini compare scenarios/bar.toml --methods nbm,nbm:constant,nitsche,penalty,waves --elements 10,20,40,80\n  \
    signorini compare scenarios/bar.toml --methods nitsche --parameter contact.gamma=1.5,2,5,10\n  \
    signorini compare scenarios/half-plate-viscous.toml --viscous --omega 1.8 --beta 0.01 --elements 10x3,20x6,40x12\n  \
    signorini compare scenarios/half-plate-orbit.toml --orbit --omega 1.8,1.9 --methods nbm,mass-redistribution"
)]
pub struct Arguments {
    /// The scene (TOML); its contact method is replaced by each of those that are compared
    scene: PathBuf,
    /// Contact methods [default: those that suit the body]
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    methods: Vec<String>,
    /// Meshes: 10,20,40 or 10x3,20x6, of several bodies 10x3+8x4,20x6+16x8 (one number a mesh keeps the shape of all elements) [default: the scene's]
    #[arg(long, value_delimiter = ',', value_name = "MESHES")]
    elements: Vec<String>,
    /// A key of the scene with the values that it is given; may be given again: all combinations are computed
    #[arg(long, value_name = "KEY=VALUES")]
    parameter: Vec<String>,
    /// What motions are compared with: waves, METHOD@MESH, or the file of a run [default: waves for a bar without loads and damping,
    /// else mass redistribution on the finest mesh]
    #[arg(long, value_name = "REFERENCE", conflicts_with_all = ["orbit", "viscous"])]
    reference: Option<String>,
    /// Compare orbits in place of motions: energy, contact time, multipliers
    #[arg(long, conflicts_with = "viscous")]
    orbit: bool,
    /// Compare viscous nonlinear modes: energy and feedback under refinement
    #[arg(long)]
    viscous: bool,
    /// Circular frequencies of orbits [default: that of the scene]
    #[arg(long, value_delimiter = ',', value_name = "W", allow_negative_numbers = true)]
    omega: Vec<f64>,
    /// Viscosity of all viscous modes [default: that of the scene, or what the coarsest mesh resolves]
    #[arg(long, value_name = "BETA", allow_negative_numbers = true, requires = "viscous")]
    beta: Option<f64>,
    /// Beginning of the names of HDF5, CSV, SVG, PNG and PDF [default: the scene's name with -compare]
    #[arg(short, long, value_name = "STEM")]
    output: Option<PathBuf>,
    /// Overwrite existing files of signorini's
    #[arg(long)]
    force: bool,
    /// Go on with an interrupted comparison: rows that are there are not computed again
    #[arg(long)]
    resume: bool,
}

/// How often the rows are written while they are computed.
const EVERY: Duration = Duration::from_secs(2);

/// Commas that are in no brackets and no quotation marks part a list.
fn listed(text: &str) -> Vec<String> {
    let (mut depth, mut quoted) = (0, false);
    let mut parts = vec![String::new()];
    for c in text.chars() {
        match c {
            '"' | '\'' => quoted = !quoted,
            '[' | '{' | '(' => depth += 1,
            ']' | '}' | ')' => depth -= 1,
            ',' if depth == 0 && !quoted => {
                parts.push(String::new());
                continue;
            }
            _ => {}
        }
        if let Some(last) = parts.last_mut() {
            last.push(c);
        }
    }
    parts.into_iter().map(|p| p.trim().to_owned()).collect()
}

/// `10x3`
fn mesh(text: &str) -> Result<Elements, CliError> {
    let no_mesh = || {
        let text = format!("{text} is no mesh; give 20, or 20x6, of several bodies 20x6+16x8");
        CliError::Input(text)
    };
    Elements::parse(text).ok_or_else(no_mesh)
}

fn variant(name: &str) -> Result<Variant, CliError> {
    Variant::of_name(name.trim()).map_err(|e| CliError::Input(e.to_string()))
}

impl Arguments {
    fn compared(&self) -> Compared {
        match (self.orbit, self.viscous) {
            (true, _) => Compared::Orbit,
            (_, true) => Compared::Viscous,
            _ => Compared::Run,
        }
    }

    fn request(&self) -> Result<Request, CliError> {
        let bad = |text: String| Err(CliError::Input(text));
        if let Some(w) = self.omega.iter().find(|w| !(w.is_finite() && **w > 0.0)) {
            return bad(format!("--omega {}: give positive frequencies", plain(*w)));
        }
        if !self.omega.is_empty() && self.compared() == Compared::Run {
            return bad(
                "--omega: motions have no frequency; give --orbit or --viscous with it".into()
            );
        }
        if let Some(beta) = self.beta.filter(|b| !(b.is_finite() && *b > 0.0)) {
            return bad(format!("--beta {}: give a positive time", plain(beta)));
        }
        if self.beta.is_some() && !self.viscous {
            return bad("--beta belongs to --viscous".into());
        }
        for (name, list) in [("methods", &self.methods), ("elements", &self.elements)] {
            if list.iter().any(|item| item.trim().is_empty()) {
                return bad(format!("--{name}: there is an empty item in the list"));
            }
        }
        let parameter = |text: &String| match text.split_once('=') {
            Some((key, values)) if !key.trim().is_empty() && !values.trim().is_empty() => {
                Ok((key.trim().to_owned(), listed(values)))
            }
            _ => Err(CliError::Input(format!(
                "--parameter {text}: give KEY=VALUE,VALUE, for example contact.gamma=2,5"
            ))),
        };
        Ok(Request {
            variants: self.methods.iter().map(|n| variant(n)).collect::<Result<_, _>>()?,
            elements: self.elements.iter().map(|m| mesh(m)).collect::<Result<_, _>>()?,
            parameters: self.parameter.iter().map(parameter).collect::<Result<_, _>>()?,
            reference: None,
            omega: self.omega.clone(),
            beta: self.beta,
        })
    }

    /// The beginning of the files' names.
    fn stem(&self, scene: &Scene) -> Result<PathBuf, CliError> {
        let Some(given) = &self.output else {
            return Ok(PathBuf::from(format!("{}-compare", scene.stem())));
        };
        let is_file = |ending: &str| given.extension().is_some_and(|e| e == ending);
        let stem = match ["h5", "csv", "svg", "png"].into_iter().any(is_file) {
            true => given.with_extension(""),
            false => given.clone(),
        };
        let text = given.to_string_lossy();
        match stem.file_name() {
            Some(name) if !text.ends_with('/') && !name.is_empty() => Ok(stem),
            _ => Err(CliError::Input(format!(
                "-o {text}: give the beginning of the files' names, for example methods"
            ))),
        }
    }

    /// The reference by its name.
    fn reference(&self, plan: &Plan) -> Result<Option<Named>, CliError> {
        let Some(name) = &self.reference else { return Ok(None) };
        let path = PathBuf::from(name);
        if path.exists() {
            return Ok(Some(Named::File(path)));
        }
        if name == "waves" && plan.scene.body.kind != BodyKind::Bar {
            let text =
                "--reference waves: is the motion of a bar; give METHOD@MESH, or the file of a run";
            return Err(CliError::Input(text.into()));
        }
        if name == "waves" {
            return Ok(Some(Named::waves(&plan.meshes)));
        }
        let finest = plan.meshes.last().cloned().unwrap_or_default();
        match name.split_once('@') {
            Some((method, elements)) => {
                Ok(Some(Named::Mesh(variant(method)?, plan.mesh(mesh(elements)?)?)))
            }
            None if name.ends_with(".h5") => {
                Err(CliError::Input(format!("--reference {name}: there is no such file")))
            }
            None => Ok(Some(Named::Mesh(variant(name)?, finest))),
        }
    }
}

/// Rows as they come: kept, and written now and then.
struct Keeper<'a> {
    comparison: Comparison,
    writer: ComparisonWriter,
    written: Instant,
    bar: Option<Bar>,
    failed: Option<CliError>,
    plan: &'a Plan,
    caller: &'a Caller,
}

impl Keeper<'_> {
    fn take(&mut self, row: Option<Row>, share: f64, what: &str) -> Go {
        if let Some(bar) = &self.bar {
            bar.set(share, what.to_owned());
        }
        if let Some(row) = row {
            self.comparison.rows.push(row);
            let is_orbit = self.plan.compared != Compared::Run;
            if is_orbit || self.written.elapsed() >= EVERY {
                self.write(&Status::Running);
            }
        }
        match self.caller.signal().is_some() || self.failed.is_some() {
            true => Go::Break(()),
            false => Go::Continue(()),
        }
    }

    /// In the order of the plan, whatever was known before.
    fn sort(&mut self) {
        let last = usize::MAX;
        // rows of an earlier plan stay, behind those of this one
        let place = |r: &Row| {
            let omega = r.get(Quantity::Omega);
            let frequency = self.plan.omega.iter().position(|w| *w == omega);
            let task = self.plan.tasks().position(|t| t.is_of(r));
            (task.unwrap_or(last), frequency.unwrap_or(last))
        };
        self.comparison.rows.sort_by_key(place);
    }

    fn write(&mut self, status: &Status) {
        self.sort();
        if let Err(e) = self.writer.write(&self.comparison, status) {
            self.failed = Some(e.into());
        }
        self.written = Instant::now();
    }
}

/// What is asked for, checked.
pub(crate) struct Asked {
    plan: Plan,
    /// The beginning of the files' names.
    stem: PathBuf,
    /// What may be written beside.
    derived: Outputs,
    /// Rows of an earlier comparison.
    known: Vec<Row>,
    /// What the files that are read amount to.
    identity: String,
}

/// A comparison, and whether a scene was refused, and whether one failed otherwise.
pub(crate) struct Rows {
    comparison: Comparison,
    refused: bool,
    failed: bool,
}

/// Sets problems up, and notes how that went wrong.
#[derive(Default)]
struct SetUp {
    refused: Cell<bool>,
    failed: Cell<bool>,
}

impl SetUp {
    fn problem(&self, scene: &Scene, compared: Compared, omega: &[f64]) -> Result<Problem, String> {
        within_limits(scene, compared, omega).map_err(|e| {
            let is_input = matches!(e, CliError::Scene(_) | CliError::Input(_));
            if is_input { &self.refused } else { &self.failed }.set(true);
            e.text()
        })
    }
}

impl task::Task for Arguments {
    type Plan = Asked;
    type Found = Rows;

    fn files(&self) -> Files<'_> {
        let reference = self.reference.as_ref().map(Path::new).filter(|path| path.exists());
        let read = reference.into_iter().collect();
        Files { scene: &self.scene, read, force: self.force, resume: self.resume }
    }

    fn output(&self, scene: &Scene) -> Result<PathBuf, CliError> {
        Ok(beside(&self.stem(scene)?, ".h5"))
    }

    fn plan(&self, work: &mut Work) -> Result<Asked, CliError> {
        let (scene, compared) = (&work.scene, self.compared());
        let mut plan = Plan::new(scene, compared, self.request()?)?;
        if let Some(reference) = self.reference(&plan)? {
            plan.reference = reference;
        }
        let stem = self.stem(scene)?;
        let derived = work.options.outputs.with_force(self.force || self.resume);
        for ending in [".csv", ".svg", ".png"] {
            derived.check_derived(&beside(&stem, ending))?;
        }
        // the scene as it is says whether files are those of an earlier comparison
        let own = load::of_scene(scene).map(|p| fingerprint(scene, &p)).unwrap_or_default();
        let identity = format!("{own:016x} {:08x}", checksum(&plan.reference));
        if compared == Compared::Viscous {
            let set_up = SetUp::default();
            let omega = plan.omega.clone();
            let problem = |scene: &Scene| set_up.problem(scene, compared, &omega);
            plan.beta = Some(orbits::common_beta(&plan, &problem).map_err(CliError::Input)?);
        }
        signorini::compare::reference::check_file(&plan).map_err(CliError::Input)?;
        let known = match work.resume && work.path.exists() {
            true => known_rows(&work.path, &plan, &identity)?,
            false => vec![],
        };
        Ok(Asked { plan, stem, derived, known, identity })
    }

    fn carry_out(&self, work: &Work, asked: &mut Asked) -> Result<Rows, CliError> {
        let Work { global, scene, path, options, resume, .. } = work;
        let Asked { plan, known, identity, .. } = &*asked;
        let set_up = SetUp::default();
        let problem = |scene: &Scene| set_up.problem(scene, plan.compared, &plan.omega);
        global.caller.watch();
        let mut comparison = outline(plan, footer(plan.compared));
        comparison.rows.clone_from(known);
        let mut keeper = Keeper {
            comparison,
            writer: ComparisonWriter::begin(path, scene, options, (*resume, identity.clone()))?,
            written: Instant::now(),
            bar: Bar::new(global, scene),
            failed: None,
            plan,
            caller: &global.caller,
        };
        let means = Means { set_up: &problem, stop: &|| global.caller.signal().is_some() };
        let done = rows(plan, means, known, &mut |row, share, what| keeper.take(row, share, what));
        if let Some(bar) = &keeper.bar {
            bar.clear();
        }
        done.map_err(|e| match e {
            CompareError::Scene(e) => e.into(),
            CompareError::Reference { .. } => CliError::Input(e.to_string()),
        })?;
        let signal = global.caller.signal().filter(|_| !is_whole(&keeper.comparison, plan));
        keeper.write(&if signal.is_some() { Status::Interrupted } else { Status::Complete });
        if let Some(e) = keeper.failed {
            return Err(e);
        }
        if let Some(signal) = signal {
            let text = format!(
                "interrupted; {} rows are in {}: go on with the same command and --resume",
                keeper.comparison.rows.len(),
                path.display()
            );
            return Err(CliError::Interrupted(signal, text));
        }
        let (refused, failed) = (set_up.refused.get(), set_up.failed.get());
        Ok(Rows { comparison: keeper.comparison, refused, failed })
    }

    fn say(&self, work: &Work, asked: &Asked, found: Rows) -> Result<Answer, CliError> {
        let Asked { stem, derived, known, .. } = asked;
        let Rows { comparison, refused, failed } = found;
        let files = (stem.as_path(), work.path.clone());
        let answer = tell(work.global, &comparison, files, derived, known.len())?;
        // where nothing could be computed, that is what is to be said
        let is_empty = |r: &Row| !r.note.is_empty() && r.get(Quantity::Unknowns).is_nan();
        if !comparison.rows.iter().all(is_empty) {
            return Ok(answer);
        }
        let first = comparison.rows.first().map_or("", |r| r.note.as_str());
        let text = format!("no row could be computed: {first}");
        match refused && !failed {
            true => Err(CliError::Input(text)),
            false => Ok(answer.failed(text)),
        }
    }
}

/// The problem of a scene, or why it is too long for a lifetime.
fn within_limits(scene: &Scene, compared: Compared, omega: &[f64]) -> Result<Problem, CliError> {
    let problem = load::of_scene(scene)?;
    match compared {
        Compared::Run => resources::check_time(scene, &problem, run_table(scene)?.1)?,
        _ => omega.iter().try_for_each(|w| family::check_frequency(&problem, *w))?,
    }
    Ok(problem)
}

/// Write table and picture beside the HDF5 file; what there is to say.
fn tell(
    global: &Global,
    comparison: &Comparison,
    (stem, path): (&Path, PathBuf),
    outputs: &Outputs,
    known: usize,
) -> Result<Answer, CliError> {
    let csv_path = beside(stem, ".csv");
    replace(&csv_path, csv(comparison).as_bytes())?;
    let mut written = vec![path, csv_path];
    match picture(comparison) {
        Ok(sheet) => {
            let drawing = Drawing { stem: stem.to_owned(), sheet };
            written.extend(figure::save(&[drawing], outputs, &figure::Output::default())?);
        }
        // pictures of an earlier comparison would stand beside the new table
        Err(FigureError::Empty(_)) => {
            for old in [".svg", ".png"].map(|ending| beside(stem, ending)) {
                if old.exists() && outputs.check_derived(&old).is_ok() {
                    let _ = std::fs::remove_file(&old);
                }
            }
        }
        Err(e) => return Err(e.into()),
    }
    let names: Vec<String> = written.iter().map(|p| p.display().to_string()).collect();
    Ok(global.answer(
        || {
            let mut all = json(comparison);
            all["written"] = names.clone().into();
            all
        },
        || {
            let resumed = match known {
                0 => String::new(),
                n => format!("  {n} rows were there already\n"),
            };
            format!("{}{resumed}  written: {}\n", text(comparison), names.join(", "))
        },
    ))
}

/// Whether there is a row for everything.
fn is_whole(comparison: &Comparison, plan: &Plan) -> bool {
    let count = |task: &Task| comparison.rows.iter().filter(|r| task.is_of(r)).count();
    plan.tasks().all(|task| count(task) >= plan.omega.len().max(1))
}

/// Rows of an interrupted comparison, which must be the same.
fn known_rows(path: &Path, plan: &Plan, identity: &str) -> Result<Vec<Row>, CliError> {
    let stored = read_comparison(path)?;
    let wanted = outline(plan, String::new());
    let is_same = stored.scene == plan.scene.source.text
        && stored.comparison.compared == wanted.compared
        && stored.comparison.reference == wanted.reference
        && stored.identity == identity;
    match is_same {
        true => Ok(stored.comparison.rows),
        false => Err(CliError::Input(format!(
            "{} cannot be gone on with: it is a comparison of another scene or with another reference, or files that these name have changed; give the same command again, or \
             --force to start anew",
            path.display()
        ))),
    }
}

/// A number that changes with the content of a reference's file.
fn checksum(reference: &Named) -> u32 {
    match reference {
        Named::File(path) => std::fs::read(path).map_or(0, |bytes| crc32fast::hash(&bytes)),
        _ => 0,
    }
}

/// Program, machine, how times are taken.
fn footer(compared: Compared) -> String {
    let (version, machine) = (env!("CARGO_PKG_VERSION"), super::precision::machine());
    let times = match compared {
        Compared::Run => "times: shortest of up to 7 runs, one after the other",
        _ => "times: the search for an orbit with its multipliers",
    };
    format!("signorini {version}, {machine}; {times}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_parted_outside_of_brackets() {
        assert_eq!(listed("2,5"), ["2", "5"]);
        assert_eq!(listed("[10, 3], [20, 6]"), ["[10, 3]", "[20, 6]"]);
        assert_eq!(mesh("20×6+4x3").unwrap().to_string(), "20x6+4x3");
        assert!(mesh("0").is_err() && mesh("x3").is_err() && mesh("").is_err());
    }
}
