//! `signorini plot`

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde_json::json;

use signorini::report::families;
use signorini::report::figure::{self, Drawing, Style};
use signorini::report::overlay;
use signorini::report::pictures::{self, Options};
use signorini::report::plane;
use signorini::store::{
    Content, Outputs, Stored, StoredFamily, beside, content, read_crosscheck, read_curves,
    read_resonance, read_stored_orbit, without_ending,
};

use super::{Answer, CliError, Global, one_picture, view};

/// Arguments of `plot`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini plot plate.h5\n  signorini plot plate.h5 --only shapes --at 0,0.25,0.5,0.75 -o plate-quarters\n  signorini plot orbit.h5 --only portrait,multipliers\n  signorini plot backbone.h5\n  signorini plot backbone.h5 --axis amplitude\n  signorini plot backbone.h5 viscous.h5 hbm.h5 -o compared\n  signorini plot checked.h5\n  signorini plot folds.h5 doublings.h5 -o map\n  signorini plot plate.h5 --html\n  signorini plot plate.h5 --animate\n  signorini plot backbone.h5 --axis energy --width 3.4in --no-title\n  signorini plot response.h5 hbm.h5 checked.h5 -o overlay --point 1.8,1.04,A"
)]
pub struct Arguments {
    /// A file of this program; several files of families (`backbone`, `response`, `crosscheck`) give one picture of energy
    /// or amplitude against frequency
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Beginning of the pictures' names [default: the file's name without its ending; for several files `overlay`]
    #[arg(short, long, value_name = "STEM")]
    output: Option<PathBuf>,
    /// One page of HTML that plays what the files hold (STEM.html), in place of pictures
    #[arg(long, conflicts_with_all = ["only", "at", "nodes", "axis", "energy", "amplitude", "frequency", "point", "dpi"])]
    html: bool,
    /// The motion as an animation (STEM-shapes.apng, for browsers and presentations), in place of pictures: of a run, or of one period of an orbit
    #[arg(long, conflicts_with_all = ["html", "only", "at", "nodes", "axis", "energy", "amplitude", "frequency", "point"])]
    animate: bool,
    /// Animation: how many states are shown, evenly over the stored time (25 a second)
    #[arg(long, default_value_t = 100, requires = "animate", value_name = "N", value_parser = clap::value_parser!(u16).range(2..=2000))]
    frames: u16,
    /// Only these pictures: contact, states, friction, forces, probes, portraits, spectra, section, energy, gap, shapes (of a run or an orbit), portrait, multipliers (of an orbit), backbone,
    /// multipliers (of a family), sweep, bifurcation, waterfall (of a sweep), crosscheck (of a cross-check), comparison, curves
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    only: Vec<String>,
    /// Fractions of the stored time (of an orbit: of its period) at which shapes are drawn
    #[arg(long, value_delimiter = ',', value_name = "FRACTIONS", allow_hyphen_values = true)]
    at: Vec<f64>,
    /// Contact nodes (numbers of mesh nodes, or names of rows of matrices) to draw in the picture of the contact [default: up to twelve, those of the largest pressures first]
    #[arg(long, value_delimiter = ',', value_name = "NODES")]
    nodes: Vec<String>,
    /// Dots per inch of the PNG (the pictures are about ten inches wide) [default: 192; of animations 96]
    #[arg(long, value_parser = clap::value_parser!(u16).range(24..=1200))]
    dpi: Option<u16>,
    /// Width of a picture, in in, mm or cm: of a column of a journal 3.4in or 84mm; letters are then of 7 points, and panels that stand side by side stand below one another
    #[arg(long, value_name = "WIDTH", value_parser = width)]
    width: Option<f64>,
    /// No titles and footers: for a caption
    #[arg(long)]
    no_title: bool,
    /// Families: what is shown over the frequency [default: energy; of one family both, one below the other]
    #[arg(long, value_enum, value_name = "AXIS")]
    axis: Option<Axis>,
    /// Several files: limits of the energy
    #[arg(long, value_delimiter = ',', value_name = "LOW,HIGH", allow_hyphen_values = true)]
    energy: Vec<f64>,
    /// Several files: limits of the amplitude
    #[arg(long, value_delimiter = ',', value_name = "LOW,HIGH", allow_hyphen_values = true)]
    amplitude: Vec<f64>,
    /// Several files: limits of the frequency
    #[arg(long, value_delimiter = ',', value_name = "LOW,HIGH", allow_hyphen_values = true)]
    frequency: Vec<f64>,
    /// Several files: a cross with a name, for example 1.8,1.04,A; may be given again
    #[arg(long, value_name = "OMEGA,VALUE,LABEL")]
    point: Vec<String>,
}

/// What is shown over the frequency.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Axis {
    /// Largest energy
    Energy,
    /// Largest contact displacement
    Amplitude,
}

impl From<Axis> for families::Axis {
    fn from(axis: Axis) -> Self {
        match axis {
            Axis::Energy => families::Axis::Energy,
            Axis::Amplitude => families::Axis::Amplitude,
        }
    }
}

/// A length in inches.
fn width(text: &str) -> Result<f64, String> {
    let refuse = || "give a width with its unit, for example 3.4in, 84mm or 8.4cm".to_owned();
    let unit = text.find(|c: char| c.is_ascii_alphabetic()).ok_or_else(refuse)?;
    let number: f64 = text[..unit].trim().parse().map_err(|_| refuse())?;
    let inches = match &text[unit..] {
        "in" => number,
        "mm" => number / 25.4,
        "cm" => number / 2.54,
        _ => return Err(refuse()),
    };
    match (1.5..=40.0).contains(&inches) {
        true => Ok(inches),
        false => Err("give a width from 1.5in (38mm) to 40in".into()),
    }
}

impl Arguments {
    fn style(&self) -> Style {
        Style { width: self.width, titles: !self.no_title }
    }

    /// Beginning of the names of pictures of one file.
    fn stem(&self, file: &Path) -> PathBuf {
        self.given().unwrap_or_else(|| file.with_extension(""))
    }

    /// Beginning of their names that was given.
    fn given(&self) -> Option<PathBuf> {
        self.output.clone().map(|stem| without_ending(stem, &["png", "svg", "apng"]))
    }

    /// Write pictures as they are asked for.
    fn save(&self, drawings: &[Drawing]) -> Result<Vec<PathBuf>, CliError> {
        let outputs = Outputs::new(false).reads_all(self.files.iter().cloned());
        let usual = figure::Output::default();
        let how = figure::Output { dpi: self.dpi.unwrap_or(usual.dpi), style: self.style() };
        Ok(figure::save(drawings, &outputs, &how)?)
    }
}

/// Draw the pictures.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Answer, CliError> {
    if arguments.html {
        let stem = arguments.output.as_deref();
        let path = view::write(
            global,
            &arguments.files,
            stem.map(|s| beside(&without_ending(s.to_owned(), &["html"]), ".html")),
            &view::Wanted::default(),
        )?;
        let name = path.display().to_string();
        return Ok(global.answer(|| json!({"written": [name]}), || format!("{name}\n")));
    }
    if arguments.animate {
        return animation(arguments, global);
    }
    let written = match &arguments.files[..] {
        [file] => of_file(arguments, file)?,
        _ => arguments.save(&[of_files(arguments)?])?,
    };
    let names: Vec<String> = written.iter().map(|p| p.display().to_string()).collect();
    Ok(global.answer(|| json!({"written": names}), || names.join("\n") + "\n"))
}

/// Frames a second.
const RATE: u16 = 25;
/// Dots per inch of an animation.
const SCREEN: u16 = 96;

/// The motion of a run or an orbit.
fn animation(arguments: &Arguments, global: &Global) -> Result<Answer, CliError> {
    let [file] = &arguments.files[..] else {
        return Err(CliError::Input("--animate plays one file".into()));
    };
    if !matches!(content(file)?, Content::Run | Content::Orbit) {
        let text =
            "--animate plays a run or an orbit; `signorini view` plays the points of a family";
        return Err(CliError::Input(text.into()));
    }
    let stored = Stored::read(file)?;
    let frames = pictures::frames(&stored, usize::from(arguments.frames), &arguments.style())?;
    let stem = arguments.stem(file);
    let outputs = Outputs::new(false).reads(file.clone());
    let look = (arguments.dpi.unwrap_or(SCREEN), RATE);
    let path = figure::animate(&beside(&stem, "-shapes"), &frames, &outputs, look)?;
    let name = path.display().to_string();
    Ok(global.answer(|| json!({"written": [name]}), || format!("{name}\n")))
}

/// Write the pictures of one file.
fn of_file(arguments: &Arguments, file: &Path) -> Result<Vec<PathBuf>, CliError> {
    for (name, given) in [
        ("energy", !arguments.energy.is_empty()),
        ("amplitude", !arguments.amplitude.is_empty()),
        ("frequency", !arguments.frequency.is_empty()),
        ("point", !arguments.point.is_empty()),
    ] {
        if given {
            let message = format!("--{name} belongs to the picture of several files; there is one");
            return Err(CliError::Input(message));
        }
    }
    let kind = content(file)?;
    let checked = if kind == Content::Family { read_crosscheck(file)? } else { None };
    let known = match kind {
        kind if one_picture::name(kind).is_some() => one_picture::name(kind).into_iter().collect(),
        Content::Run => pictures::names(),
        Content::Orbit => [pictures::names(), families::orbit_names()].concat(),
        Content::Family if checked.is_some() => families::check_names(),
        Content::Family => families::family_names(),
        _ => {
            let text = "is of a study: `signorini study collect` draws it (--show), and `plot` the files of its tasks";
            return Err(CliError::Input(format!("{} {text}", file.display())));
        }
    };
    if let Some(unknown) = arguments.only.iter().find(|o| !known.contains(&o.as_str())) {
        return Err(CliError::Input(format!(
            "no picture \"{unknown}\" of {}; there are {}",
            file.display(),
            known.join(", ")
        )));
    }
    if let Some(bad) = arguments.at.iter().find(|f| !(0.0..=1.0).contains(*f)) {
        return Err(CliError::Input(format!("--at {bad}: give fractions between 0 and 1")));
    }
    if arguments.axis.is_some() && (kind != Content::Family || checked.is_some()) {
        let message = "--axis belongs to the picture of a family (`backbone`, `response`)";
        return Err(CliError::Input(message.into()));
    }
    let stem = arguments.stem(file);
    if matches!(kind, Content::Run | Content::Orbit) {
        return of_run(arguments, file, &stem);
    }
    if !arguments.at.is_empty() {
        let message =
            "--at: this file has no shapes; write one orbit with `signorini orbit`, or a run";
        return Err(CliError::Input(message.into()));
    }
    if let Some((_, sheet)) = one_picture::picture(kind, file)? {
        return arguments.save(&[Drawing { stem, sheet }]);
    }
    let family = StoredFamily::read(file)?;
    arguments.save(&match checked {
        Some(rows) => families::pictures_of_check(&family, &rows, &stem, &arguments.only)?,
        None => {
            let axis = arguments.axis.map(families::Axis::from);
            families::pictures_of_family(&family, axis, &stem, &arguments.only)?
        }
    })
}

/// One picture of several families.
fn of_files(arguments: &Arguments) -> Result<Drawing<'static>, CliError> {
    let input = |message: String| Err(CliError::Input(message));
    let kinds = arguments.files.iter().map(|f| content(f)).collect::<Result<Vec<_>, _>>()?;
    if kinds.iter().all(|kind| *kind == Content::Curves) {
        return of_curves(arguments);
    }
    if let Some(name) = arguments.only.iter().find(|o| *o != "overlay") {
        return input(format!("no picture \"{name}\" of several files; there is overlay"));
    }
    if !arguments.at.is_empty() {
        return input("--at: the picture of several files has no shapes".into());
    }
    let limits = |name: &str, values: &[f64]| match *values {
        [] => Ok(None),
        [low, high] if low.is_finite() && high.is_finite() && low < high => Ok(Some(low..high)),
        _ => Err(CliError::Input(format!("--{name}: give two numbers, the lower one first"))),
    };
    let axis = arguments.axis.unwrap_or(Axis::Energy);
    let (of_axis, of_other) = match axis {
        Axis::Energy => (("energy", &arguments.energy), ("amplitude", &arguments.amplitude)),
        Axis::Amplitude => (("amplitude", &arguments.amplitude), ("energy", &arguments.energy)),
    };
    if !of_other.1.is_empty() {
        return input(format!("--{}: the picture shows the {}", of_other.0, of_axis.0));
    }
    let mut options = overlay::Options {
        axis: axis.into(),
        value: limits(of_axis.0, of_axis.1)?,
        frequency: limits("frequency", &arguments.frequency)?,
        points: arguments.point.iter().map(|p| point(p)).collect::<Result<_, _>>()?,
        tests: vec![],
    };
    let mut all = vec![];
    for file in &arguments.files {
        match content(file)? {
            Content::Family => all.push(StoredFamily::read(file)?),
            Content::PhaseResonance => options.tests.push(read_resonance(file)?),
            _ => {
                return input(format!(
                    "{}: several files are drawn in one picture if they all hold families (of `backbone`, `response`, `crosscheck`) or tests of phase resonance",
                    file.display()
                ));
            }
        }
    }
    let stem = arguments.given().unwrap_or_else(|| PathBuf::from("overlay"));
    Ok(overlay::picture(&all, &options, &stem)?)
}

/// One picture of the curves of several files.
fn of_curves(arguments: &Arguments) -> Result<Drawing<'static>, CliError> {
    let all = arguments.files.iter().map(|f| read_curves(f)).collect::<Result<Vec<_>, _>>()?;
    let key = &all[0].curves.key;
    if let Some((file, other)) =
        arguments.files.iter().zip(&all).find(|(_, other)| other.curves.key != *key)
    {
        return Err(CliError::Input(format!(
            "{}: its curves are over {}, those of the first file over {key}",
            file.display(),
            other.curves.key
        )));
    }
    let stem = arguments.given().unwrap_or_else(|| PathBuf::from("curves"));
    Ok(Drawing { stem, sheet: plane::picture(&all)? })
}

/// A place that is marked.
fn point(text: &str) -> Result<(f64, f64, String), CliError> {
    let number = |s: &str| s.trim().parse::<f64>().ok().filter(|x| x.is_finite() && *x > 0.0);
    let parts: Vec<&str> = text.splitn(3, ',').collect();
    let place = match parts[..] {
        [omega, value, label] => number(omega).zip(number(value)).map(|place| (place, label)),
        _ => None,
    };
    match place {
        Some(((omega, value), label)) => Ok((omega, value, label.trim().to_owned())),
        None => Err(CliError::Input(format!(
            "--point {text}: give a frequency, an energy (or amplitude) and a name, for example 1.8,1.04,A"
        ))),
    }
}

/// Write the pictures of a run, and those of its orbit if it is one.
fn of_run(arguments: &Arguments, file: &Path, stem: &Path) -> Result<Vec<PathBuf>, CliError> {
    let stored = Stored::read(file)?;
    let orbit = read_stored_orbit(file)?;
    let nodes = view::contact_nodes(&arguments.nodes, &stored)?;
    let periodic = orbit.is_some();
    let mut options = Options { nodes, periodic, ..Options::default() };
    if !arguments.at.is_empty() {
        // times of shapes, which a part of the body has not
        stored.whole()?;
        options.fractions = arguments.at.clone();
    } else if orbit.is_some() {
        // the end of a period is its start
        options.fractions = (0..8).map(|k| f64::from(k) / 8.0).collect();
    }
    let only = &arguments.only;
    let of_orbit = families::orbit_names();
    let wanted = |o: &&String| !of_orbit.contains(&o.as_str());
    let of_run: Vec<String> = only.iter().filter(wanted).cloned().collect();
    let mut drawn = vec![];
    if only.is_empty() || !of_run.is_empty() {
        drawn = pictures::draw_all(&stored, stem, &of_run, &options)?;
    }
    let of_orbit: Vec<String> = only.iter().filter(|o| !wanted(o)).cloned().collect();
    match orbit {
        Some(orbit) if only.is_empty() || !of_orbit.is_empty() => {
            drawn.extend(families::pictures_of_orbit(&stored, &orbit, stem, &of_orbit)?);
        }
        _ => {}
    }
    arguments.save(&drawn)
}
