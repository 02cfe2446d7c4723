//! `signorini inspect`

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::{Value, json};

use signorini::event::SwitchKind;
use signorini::records::{Branch, OrbitRecord, PointKind, PointRecord};
use signorini::report::comparison;
use signorini::report::crosscheck::{Tally, by_harmonics};
use signorini::report::export::largest_stress;
use signorini::report::families::highest;
use signorini::report::summary::{kinds_of_switches, plural, significant};
use signorini::store::{
    Content, Held, Origin, Raw, Stored, StoredFamily, attributes, content, entries, held,
    read_comparison, read_crosscheck, read_origin, read_raw, read_stored_orbit,
};

use super::{
    Answer, CliError, Global, bands, basins, curve, diagram, inspect_matrix, inspect_mesh,
    inspect_scene, phase_resonance, tori,
};

/// Arguments of `inspect`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini inspect plate.h5\n  signorini inspect plate.h5 --scene > again.toml\n  signorini inspect backbone.h5\n  signorini inspect checked.h5 --datasets\n  signorini inspect bracket.msh\n  signorini inspect block.sti               # a matrix of CalculiX, Abaqus, Ansys or SciPy\n  signorini inspect scenarios/bracket.toml   # mass, gaps, first frequencies"
)]
pub struct Arguments {
    /// A file written by this program, a scene (its mass, gaps and first frequencies), a mesh of Gmsh, or a matrix of another program
    file: PathBuf,
    /// Print the scene that made it, and nothing else
    #[arg(long)]
    scene: bool,
    /// List its datasets: name, shape, unit, what it is
    #[arg(long, conflicts_with = "scene")]
    datasets: bool,
}

/// What a file says of itself, by the name of what is asked.
fn said_by(file: &Path) -> Result<impl Fn(&str) -> String, CliError> {
    let of_file = attributes(file, "")?;
    Ok(move |name: &str| match of_file.iter().find(|a| a.0 == name) {
        Some((_, Raw::Words(words))) => words.first().cloned().unwrap_or_default(),
        _ => String::new(),
    })
}

/// Matrices for other programs.
fn arrays(arguments: &Arguments, global: &Global) -> Result<Answer, CliError> {
    let file = &arguments.file;
    let text = said_by(file)?;
    if arguments.scene && !global.json {
        return Ok(Answer::text(text("scene")));
    }
    let all = held(file)?;
    let size = |h: &Held| h.shape.iter().map(usize::to_string).collect::<Vec<_>>().join(" × ");
    Ok(global.answer(
        || {
            let object = |h: &Held| json!({"name": h.name, "shape": h.shape, "description": h.description});
            json!({
                "arrays": all.iter().map(object).collect::<Vec<_>>(), "scene": text("scene"),
                "version": text("signorini_version"),
            })
        },
        || {
            let mut out = format!("  made by     signorini {}\n", text("signorini_version"));
            for h in &all {
                let (name, about) = (h.name.trim_start_matches('/'), &h.description);
                let _ = writeln!(out, "  {name:<12}{:<14}{about}", size(h));
            }
            let lines = text("scene").lines().count();
            let name = file.display();
            let _ = writeln!(out, "  scene       {lines} lines (print it with --scene)");
            let _ = writeln!(out, "  next        h5py.File(\"{name}\")[\"K\"][:], or in a scene stiffness_matrix = \"{name}:/K\"");
            out
        },
    ))
}

/// What the tasks of a study found.
fn study(arguments: &Arguments, global: &Global) -> Result<Answer, CliError> {
    let file = &arguments.file;
    let words = |name: &str| match read_raw(file, name) {
        Ok(Raw::Words(words)) => words,
        _ => vec![],
    };
    let names = |group: &str| -> Result<Vec<String>, CliError> {
        Ok(entries(file, group)?.into_iter().map(|e| e.name).collect())
    };
    let text = said_by(file)?;
    if arguments.scene && !global.json {
        return Ok(Answer::text(text("scene")));
    }
    let states = words("study/state");
    let (varied, results) = (names("study/varied")?, names("results")?);
    let done = states.iter().filter(|s| *s == "done").count();
    let (title, command) = (text("title"), text("command"));
    Ok(global.answer(
        || {
            json!({
                "title": title, "command": command, "tasks": states.len(), "done": done,
                "varied": varied, "results": results, "scene": text("scene"), "study": text("study"),
            })
        },
        || {
            format!(
                "  study       {title}: {command}, {} tasks, {done} done\n  varied      {}\n  results     {}\n  pictures    signorini study collect --show NAME,NAME\n",
                states.len(),
                varied.join(", "),
                results.join(", ")
            )
        },
    ))
}

/// The datasets of a file, a line each.
fn datasets(arguments: &Arguments, global: &Global) -> Result<Answer, CliError> {
    let all = held(&arguments.file)?;
    let shape = |h: &Held| h.shape.iter().map(usize::to_string).collect::<Vec<_>>().join(" x ");
    let width = all.iter().map(|h| h.name.len()).max().unwrap_or(0);
    let object = |h: &Held| json!({"name": h.name, "shape": h.shape, "units": h.units, "description": h.description});
    let line = |h: &Held| {
        let units = if h.units.is_empty() { String::new() } else { format!(" [{}]", h.units) };
        let text = format!("  {:width$}  {:>12}{units}  {}", h.name, shape(h), h.description);
        format!("{}\n", text.trim_end())
    };
    Ok(global.answer(
        || json!({"datasets": all.iter().map(object).collect::<Vec<_>>()}),
        || all.iter().map(line).collect(),
    ))
}

/// Say what a file holds.
pub fn run(arguments: &Arguments, global: &Global) -> Result<Answer, CliError> {
    if inspect_mesh::is_mesh(&arguments.file) {
        return inspect_mesh::run(&arguments.file, global);
    }
    if arguments.file.extension().is_some_and(|e| e == "dof" || e == "mapping") {
        return Err(CliError::Input(format!(
            "{} holds names of rows: give the matrix beside which it stands",
            arguments.file.display()
        )));
    }
    if inspect_matrix::is_matrix(&arguments.file) {
        return inspect_matrix::run(&arguments.file, global);
    }
    if inspect_scene::is_scene(&arguments.file) {
        return inspect_scene::run(&arguments.file, global);
    }
    if arguments.datasets {
        return datasets(arguments, global);
    }
    match content(&arguments.file)? {
        Content::Family => return family(arguments, global),
        Content::Basins => return basins::inspect(&arguments.file, arguments.scene, global),
        Content::Diagram => return diagram::inspect(&arguments.file, arguments.scene, global),
        Content::PhaseResonance => {
            return phase_resonance::inspect(&arguments.file, arguments.scene, global);
        }
        Content::Tori => return tori::inspect(&arguments.file, arguments.scene, global),
        Content::Bands => return bands::inspect(&arguments.file, arguments.scene, global),
        Content::Curves => return curve::inspect(&arguments.file, arguments.scene, global),
        Content::Comparison => return compared(arguments, global),
        Content::Study => return study(arguments, global),
        Content::Arrays => return arrays(arguments, global),
        Content::Run | Content::Orbit => {}
    }
    let s = Stored::read(&arguments.file)?;
    let orbit = read_stored_orbit(&arguments.file)?;
    if arguments.scene && !global.json {
        return Ok(Answer::text(s.scene));
    }
    let span = [s.t.first().copied(), s.t.last().copied()];
    let switches = kinds_of_switches(|kind| {
        s.switch_kind.iter().filter(|name| SwitchKind::of_name(name) == kind).count()
    });
    let n_sliders = s.gap.len() - s.facing();
    let sliders = match n_sliders {
        0 => String::new(),
        count => format!(", {}", plural(count, "slider", "sliders")),
    };
    let stress = largest_stress(&s);
    Ok(global.answer(
        || {
            let mut json = json!({
                "title": s.title, "status": s.status, "version": s.version, "created": s.created,
                "command": s.command, "scene": s.scene, "states": s.t.len(), "t": span,
                "n_dof": s.n_displacements(), "n_kept": s.n_kept(), "n_contact": s.gap.len(), "n_sliders": n_sliders, "nodes": s.nodes.nrows(),
                "elements": s.elements.nrows(), "switches": s.switch_t.len(), "grazings": s.grazings,
            });
            if let Some(o) = &orbit {
                json["orbit"] = orbit_json(o);
            }
            if let Some(s) = stress {
                json["largest_stress"] = json!({
                    "von_mises": s.von_mises, "t": s.t, "element": s.element, "place": s.place[..s.dim],
                    "recovered": {"von_mises": s.recovered, "node": s.node, "place": s.at_node[..s.dim]}, "estimated_error": s.error,
                });
            }
            json
        },
        || {
            let mut out = String::new();
            let mut line = |label: &str, text: String| {
                let _ = writeln!(out, "  {label:<12}{text}");
            };
            if !s.title.is_empty() {
                line("title", s.title.clone());
            }
            line("status", s.status.to_string());
            line("made by", format!("signorini {} at {}", s.version, s.created));
            line("command", s.command.clone());
            line(
                "mesh",
                format!(
                    "{} nodes, {} elements, {} displacements, {}{sliders}",
                    s.nodes.nrows(),
                    s.elements.nrows(),
                    s.n_displacements(),
                    plural(s.facing(), "contact node", "contact nodes")
                ),
            );
            if let [Some(a), Some(b)] = span {
                let kept = match s.n_kept() == s.n_displacements() {
                    true => String::new(),
                    false => format!(", {} displacements of each", s.n_kept()),
                };
                line("trajectory", format!("{} states from t = {a} to {b}{kept}", s.t.len()));
            }
            if let Some(o) = &orbit {
                line("orbit", orbit_text(o));
            }
            line("switches", format!("{} {switches}", s.switch_t.len()));
            line("grazings", s.grazings.to_string());
            if let Some(most) = stress {
                let kind = if most.dim == 1 { "axial" } else { "von Mises" };
                let place = |p: &[f64]| -> String {
                    p.iter().map(|x| significant(*x, 4)).collect::<Vec<_>>().join(", ")
                };
                let (middle, node) = (place(&most.place[..most.dim]), place(&most.at_node[..most.dim]));
                let (size, t) = (significant(most.von_mises, 5), significant(most.t, 7));
                line(
                    "stress",
                    format!("largest {kind} {size} at t = {t}, at the centre of the element at ({middle})"),
                );
                line(
                    "",
                    format!(
                        "at this time at nodes {}, recovered, at ({node})",
                        significant(most.recovered, 5)
                    ),
                );
                let error = significant(100.0 * most.error, 2);
                let text = "error of the stress of the elements about";
                line("", format!("{text} {error} % (Zienkiewicz and Zhu, in energy)"));
            }
            line("scene", format!("{} lines (print it with --scene)", s.scene.lines().count()));
            out
        },
    ))
}

/// What a comparison holds: its table, as `compare` printed it.
fn compared(arguments: &Arguments, global: &Global) -> Result<Answer, CliError> {
    let s = read_comparison(&arguments.file)?;
    if arguments.scene && !global.json {
        return Ok(Answer::text(s.scene));
    }
    let [version, created, command] = &s.origin;
    Ok(global.answer(
        || {
            let mut all = comparison::json(&s.comparison);
            for (key, word) in [("version", version), ("created", created), ("command", command), ("scene", &s.scene)] {
                all[key] = word.as_str().into();
            }
            all["status"] = s.status.to_string().into();
            all
        },
        || {
            format!(
                "{}  status      {}\n  made by     signorini {version} at {created}\n  command     {command}\n  scene       {} lines (print it with --scene)\n",
                comparison::text(&s.comparison),
                s.status,
                s.scene.lines().count()
            )
        },
    ))
}

fn orbit_json(o: &OrbitRecord) -> Value {
    json!({
        "period": o.period, "omega": o.omega(), "energy": o.energy,
        "amplitude": o.amplitude, "residual": o.residual, "contact_time": o.contact_time,
        "grazing_distance": o.grazing, "stable": o.stable, "multipliers": o.multipliers.len(),
        "multipliers_within": o.multipliers_within,
        "trivial_multipliers": o.trivial, "switches": o.switches.len(),
    })
}

fn orbit_text(o: &OrbitRecord) -> String {
    let multipliers = match o.multipliers.len() {
        0 => "no multipliers".to_owned(),
        n => match o.multipliers_within {
            Some(error) => format!("{n} multipliers along the series, within {error:.1e}"),
            None => format!("{n} multipliers"),
        },
    };
    format!(
        "period {} (omega = {}), energy {}, residual {:.1e}, {}, {multipliers}",
        significant(o.period, 10),
        significant(o.omega(), 8),
        significant(o.energy, 8),
        o.residual,
        match o.stable {
            Some(true) => "stable",
            Some(false) => "unstable",
            None => "stability not computed",
        }
    )
}

/// How often each word occurs.
fn counts<'p>(words: impl Iterator<Item = Cow<'p, str>>) -> BTreeMap<Cow<'p, str>, usize> {
    let mut counts = BTreeMap::new();
    for word in words {
        *counts.entry(word).or_default() += 1;
    }
    counts
}

fn list(counts: &BTreeMap<Cow<str>, usize>) -> String {
    counts.iter().map(|(name, n)| format!("{n} {name}")).collect::<Vec<_>>().join(", ")
}

/// Least and largest of some numbers.
fn bounds(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    values.filter(|v| v.is_finite()).fold(None, |b, v| match b {
        None => Some([v, v]),
        Some([least, most]) => Some([v.min(least), v.max(most)]),
    })
}

fn tally_json(t: &Tally) -> Value {
    let number = |x: f64| if x.is_finite() { json!(x) } else { Value::Null };
    json!({
        "harmonics": t.n_h, "points": t.points, "orbits": t.orbits, "another_orbit": t.others,
        "verdicts": t.verdicts, "median_moved": number(t.median_moved),
        "median_residual": number(t.median_residual),
    })
}

fn tally_text(t: &Tally) -> String {
    let mut parts = vec![format!(
        "{} points: {} approximate an orbit, {} lead to another",
        t.points, t.orbits, t.others
    )];
    parts.extend(t.verdicts.iter().map(|(verdict, n)| format!("{n} {verdict}")));
    let moved = match t.median_moved.is_finite() {
        true => format!("median distance {:.1e}, ", t.median_moved),
        false => String::new(),
    };
    format!("{}; {moved}median residual in time {:.1e}", parts.join(", "), t.median_residual)
}

/// Say what the file of a family holds.
fn family(arguments: &Arguments, global: &Global) -> Result<Answer, CliError> {
    let f = StoredFamily::read(&arguments.file)?;
    if arguments.scene && !global.json {
        return Ok(Answer::text(f.scene));
    }
    let overview = Overview {
        origin: read_origin(&arguments.file)?,
        tallies: read_crosscheck(&arguments.file)?.map(|rows| by_harmonics(&rows)),
        f: &f,
    };
    Ok(global.answer(|| overview.json(), || overview.text()))
}

/// A family, and what its file says besides.
struct Overview<'f> {
    f: &'f StoredFamily,
    origin: Origin,
    tallies: Option<Vec<Tally>>,
}

/// Number of points, of orbits, least and largest frequency.
type Extent = (usize, usize, Option<[f64; 2]>);

impl Overview<'_> {
    fn orbits(&self) -> impl Iterator<Item = &OrbitRecord> {
        self.f.points.iter().filter_map(|p| p.orbit.as_ref())
    }

    /// How many orbits are stable, unstable, of unknown stability.
    fn stability(&self) -> [usize; 3] {
        [Some(true), Some(false), None]
            .map(|stable| self.orbits().filter(|o| !o.no_orbit_near && o.stable == stable).count())
    }

    /// Series that were shot from, and that no orbit is near.
    fn none_near(&self) -> usize {
        self.orbits().filter(|o| o.no_orbit_near).count()
    }

    fn extent(&self, branch: usize) -> Extent {
        let all = || self.f.points.iter().filter(move |p| p.branch == branch);
        let omega = bounds(all().map(|p| p.omega));
        (all().count(), all().filter(|p| p.orbit.is_some()).count(), omega)
    }

    /// Why there is no orbit at some points.
    fn gaps(&self) -> BTreeMap<Cow<'_, str>, usize> {
        counts(self.f.points.iter().filter_map(|p| match &p.special {
            PointKind::Gap(reason) => Some(reason.word()),
            _ => None,
        }))
    }

    fn specials(&self) -> BTreeMap<Cow<'_, str>, usize> {
        let is_special =
            |p: &&PointRecord| !matches!(p.special, PointKind::Regular | PointKind::Gap(_));
        let specials = self.f.points.iter().filter(is_special);
        counts(specials.map(|p| Cow::Borrowed(p.special.word())))
    }

    /// Least and largest of a quantity of the orbits.
    fn bounds(&self, of: fn(&OrbitRecord) -> f64) -> Option<[f64; 2]> {
        bounds(self.orbits().map(of))
    }

    fn omega(&self) -> Option<[f64; 2]> {
        bounds(self.f.points.iter().map(|p| p.omega))
    }

    fn json(&self) -> Value {
        let Overview { f, origin, tallies } = self;
        let branch = |(k, branch): (usize, &Branch)| {
            let (points, orbits, omega) = self.extent(k);
            json!({"name": branch.to_string(), "points": points, "orbits": orbits, "omega": omega})
        };
        let branches: Vec<Value> = f.branches.iter().enumerate().map(branch).collect();
        let [stable, unstable, _] = self.stability();
        let mut json = json!({
            "title": f.title, "status": f.status, "version": origin.version,
            "created": origin.created, "command": origin.command, "scene": f.scene,
            "kind": f.identity.to_string(), "branches": branches, "points": f.points.len(),
            "orbits": self.orbits().count(), "stable": stable, "unstable": unstable, "no_orbit_near": self.none_near(),
            "gaps": self.gaps(), "specials": self.specials(), "omega": self.omega(),
            "energy": self.bounds(|o| o.energy), "amplitude": self.bounds(|o| o.amplitude),
            "largest_residual": self.bounds(|o| o.residual).map(|b| b[1]),
            "largest": highest(f).into_iter().map(|(name, most, omega)| json!({"name": name, "magnitude": most, "omega": omega})).collect::<Vec<_>>(),
            "nodes": origin.nodes, "elements": origin.elements,
            "n_dof": origin.displacements, "n_contact": origin.contact_points,
        });
        if let Some(tallies) = tallies {
            json["crosscheck"] = tallies.iter().map(tally_json).collect();
        }
        json
    }

    fn text(&self) -> String {
        let Overview { f, origin, tallies } = self;
        let mut out = String::new();
        let mut line = |label: &str, text: String| {
            let _ = writeln!(out, "  {label:<12}{text}");
        };
        line("title", f.title.clone());
        line("status", f.status.to_string());
        line("made by", format!("signorini {} at {}", origin.version, origin.created));
        line("command", origin.command.clone());
        line(
            "mesh",
            format!(
                "{} nodes, {} elements, {} displacements, {} contact nodes",
                origin.nodes, origin.elements, origin.displacements, origin.contact_points
            ),
        );
        line("family", format!("{}, {} points", f.identity, f.points.len()));
        for (k, branch) in f.branches.iter().enumerate() {
            let (points, orbits, omega) = self.extent(k);
            let range = omega.map_or(String::new(), |o| format!(", omega = {}", span(o)));
            let text = format!("{branch}: {orbits} orbits at {points} points{range}");
            line(if k == 0 { "branches" } else { "" }, text);
        }
        line("orbits", self.orbits_text());
        line("no orbit", self.gaps_text());
        for t in tallies.iter().flatten() {
            line(&format!("N_h = {}", t.n_h), tally_text(t));
        }
        let specials = self.specials();
        let specials = (!specials.is_empty()).then(|| list(&specials));
        let residual = self.bounds(|o| o.residual).map(|b| format!("{:.1e} at most", b[1]));
        for (label, text) in [
            ("special", specials),
            ("frequency", self.omega().map(|omega| format!("omega = {}", span(omega)))),
            ("energy", self.bounds(|o| o.energy).map(span)),
            ("amplitude", self.bounds(|o| o.amplitude).map(span)),
            ("residual", residual),
        ] {
            text.into_iter().for_each(|text| line(label, text));
        }
        for (name, most, omega) in highest(f) {
            let (most, omega) = (significant(most, 6), significant(omega, 8));
            line("largest", format!("|{name}| = {most} at omega = {omega}"));
        }
        line("scene", format!("{} lines (print it with --scene)", f.scene.lines().count()));
        out
    }

    fn orbits_text(&self) -> String {
        let [stable, unstable, unknown] = self.stability();
        let unknown = match unknown {
            0 => String::new(),
            n => format!(", {n} of unknown stability"),
        };
        let all = self.orbits().count();
        let none = match self.none_near() {
            0 => String::new(),
            none => format!("; {none} are series without an orbit near"),
        };
        format!("{all}: {stable} stable, {unstable} unstable{unknown}{none}")
    }

    fn gaps_text(&self) -> String {
        let missing = self.f.points.len() - self.orbits().count();
        let gaps = self.gaps();
        let reasons = if gaps.is_empty() { String::new() } else { format!(": {}", list(&gaps)) };
        format!("at {missing} points{reasons}")
    }
}

fn span([a, b]: [f64; 2]) -> String {
    format!("{} to {}", significant(a, 8), significant(b, 8))
}
