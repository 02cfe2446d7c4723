//! `signorini benchmark`

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use serde_json::{Value, json};
use signorini::study::benchmark::{Benchmark, Measure, Quantity, Results};

use super::progress::Bar;
use super::wrap::paragraph;
use super::{Answer, CliError, Global, plain};

/// Arguments of `benchmark`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  signorini benchmark\n  signorini benchmark rod-against-wall den-hartog --keep benchmarks\n  signorini benchmark --form > mine.toml\n  signorini benchmark --with mine.toml\n\n\
    A benchmark is a folder with scene.toml and benchmark.toml (what is measured, against which number of which source): those of this program are in \
    validate/benchmarks, and a folder of your own is named with a stroke (./mine)."
)]
pub struct Arguments {
    /// Names of benchmarks, or folders that hold one [default: all that are built in]
    names: Vec<String>,
    /// List them, with what they ask of a code
    #[arg(long)]
    list: bool,
    /// The form in which another code says what it found
    #[arg(long, conflicts_with = "list")]
    form: bool,
    /// What another code found, beside it (several times)
    #[arg(long, value_name = "FILE", conflicts_with_all = ["list", "form"])]
    with: Vec<PathBuf>,
    /// Keep scenes and results in a folder
    #[arg(long, value_name = "FOLDER")]
    keep: Option<PathBuf>,
    /// As Markdown: the page of the documentation
    #[arg(long, conflicts_with_all = ["list", "form"])]
    markdown: bool,
}

/// A quantity as it was measured, or why it was not.
struct Found<'a> {
    quantity: &'a Quantity,
    value: Result<f64, String>,
}

impl Found<'_> {
    fn passes(&self) -> bool {
        self.value.as_ref().is_ok_and(|x| self.quantity.accepts(*x))
    }
}

/// A benchmark that was carried out.
struct Done<'a> {
    benchmark: &'a Benchmark,
    found: Vec<Found<'a>>,
    seconds: f64,
}

fn chosen(names: &[String]) -> Result<Vec<Benchmark>, CliError> {
    let all = Benchmark::all().map_err(CliError::Other)?;
    if names.is_empty() {
        return Ok(all);
    }
    let one = |name: &String| {
        if let Some(known) = all.iter().find(|b| b.name == *name) {
            return Ok(known.clone());
        }
        let folder = Path::new(name);
        if folder.is_dir() {
            return Benchmark::read(folder).map_err(CliError::Input);
        }
        let known: Vec<&str> = all.iter().map(|b| b.name.as_str()).collect();
        Err(CliError::Input(format!(
            "no benchmark \"{name}\", and no folder of that name; there are {}",
            known.join(", ")
        )))
    };
    let chosen = names.iter().map(one).collect::<Result<Vec<Benchmark>, CliError>>()?;
    let mut names: Vec<&str> = chosen.iter().map(|b| b.name.as_str()).collect();
    names.sort_unstable();
    match names.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(CliError::Input(format!("two benchmarks are called {}", pair[0]))),
        None => Ok(chosen),
    }
}

/// A command with its arguments, and the object that it answers with.
pub type Execute<'a> = &'a dyn Fn(&[String]) -> Result<Value, CliError>;

/// Carry the benchmarks out by their commands, and put what was found beside the references.
pub fn run(
    arguments: &Arguments,
    global: &Global,
    execute: Execute<'_>,
) -> Result<Answer, CliError> {
    let benchmarks = chosen(&arguments.names)?;
    if arguments.list {
        let row = |b: &Benchmark| {
            let asked: Vec<&str> = b.quantities().map(|q| q.name.as_str()).collect();
            json!({"name": b.name, "title": b.title, "about": b.about, "kind": b.kind.word(), "source": b.source, "quantities": asked})
        };
        let line = |b: &Benchmark| {
            let (name, of) = (&b.name, commands(b));
            format!("{name:<22} {}\n{:22} {} ({of})\n", b.title, "", b.source)
        };
        return Ok(global.answer(
            || benchmarks.iter().map(row).collect(),
            || benchmarks.iter().map(line).collect(),
        ));
    }
    if arguments.form {
        let form = Results::form(&benchmarks.iter().collect::<Vec<_>>());
        return Ok(Answer::text(form));
    }
    // of those that are not asked for it may tell too
    let known = [&benchmarks[..], &Benchmark::all().map_err(CliError::Other)?].concat();
    let read = |path: &PathBuf| Results::read(path, &known).map_err(CliError::Input);
    let others = arguments.with.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    global.caller.watch();
    let bar = Bar::named(global, "benchmarks".into());
    let each = |(k, benchmark): (usize, _)| {
        if let Some(bar) = &bar {
            let name = |b: &Benchmark| b.name.clone();
            bar.set(k as f64 / benchmarks.len() as f64, name(benchmark));
        }
        let done = carry_out(benchmark, arguments.keep.as_deref(), execute)?;
        match global.caller.signal() {
            None => Ok(done),
            Some(signal) => {
                let text = format!("interrupted at {}", benchmark.name);
                Err(CliError::Interrupted(signal, text))
            }
        }
    };
    let done = benchmarks.iter().enumerate().map(each).collect::<Result<Vec<Done>, CliError>>();
    if let Some(bar) = &bar {
        bar.clear();
    }
    let done = done?;
    let missed: Vec<String> = done
        .iter()
        .flat_map(|d| d.found.iter().map(move |f| (d, f)))
        .filter(|(_, f)| !f.passes())
        .map(|(d, f)| format!("{}: {}", d.benchmark.name, f.quantity.name))
        .collect();
    let answer = match arguments.markdown {
        true => Answer::text(markdown(&done, &others)),
        false => global.answer(|| object(&done, &others), || text(&done, &others)),
    };
    Ok(match missed.is_empty() {
        true => answer,
        false => answer.failed(format!("not within its tolerance: {}", missed.join("; "))),
    })
}

/// A benchmark in a folder of its own, which is gone afterwards where it is not to be kept.
fn carry_out<'a>(
    benchmark: &'a Benchmark,
    keep: Option<&Path>,
    execute: Execute<'_>,
) -> Result<Done<'a>, CliError> {
    let scratch = std::env::temp_dir().join(format!("signorini-benchmark-{}", std::process::id()));
    let folder = keep.unwrap_or(&scratch).join(&benchmark.name);
    let done = measure(benchmark, &folder, execute);
    if keep.is_none() {
        // a temporary folder that cannot be removed is no reason to fail
        let _ = std::fs::remove_dir_all(&scratch);
    }
    done
}

/// What its commands find.
fn measure<'a>(
    benchmark: &'a Benchmark,
    folder: &Path,
    execute: Execute<'_>,
) -> Result<Done<'a>, CliError> {
    let failed = |e: std::io::Error| CliError::Other(format!("{}: {e}", folder.display()));
    std::fs::create_dir_all(folder).map_err(failed)?;
    for (name, content) in &benchmark.files {
        let path = folder.join(name);
        path.parent().map_or(Ok(()), std::fs::create_dir_all).map_err(failed)?;
        std::fs::write(path, content).map_err(failed)?;
    }
    let start = Instant::now();
    let mut found = vec![];
    for (k, measure) in benchmark.measures.iter().enumerate() {
        // as the benchmark is called, not as its folder
        let told = |e: &CliError| e.text().replace(&folder.display().to_string(), &benchmark.name);
        let answer = match answer_of(measure, (k, folder), execute) {
            Ok(answer) => Ok(answer),
            // a command or a scene that cannot be read is no number that is missed
            Err(e @ (CliError::Scene(_) | CliError::Input(_))) => {
                return Err(CliError::Input(format!("{}: {}", benchmark.name, told(&e))));
            }
            Err(e @ CliError::Numerics(_)) => Err(told(&e)),
            Err(e) => return Err(e),
        };
        found.extend(measure.quantities.iter().map(|quantity| {
            let value = answer.as_ref().map_err(String::clone);
            Found { quantity, value: value.and_then(|answer| quantity.in_answer(answer)) }
        }));
    }
    Ok(Done { benchmark, found, seconds: start.elapsed().as_secs_f64() })
}

/// What the command of a measurement answers.
fn answer_of(
    measure: &Measure,
    (k, folder): (usize, &Path),
    execute: Execute<'_>,
) -> Result<Value, CliError> {
    let mut arguments = measure.command.clone();
    let file = |name: String| folder.join(name).display().to_string();
    arguments.insert(1, file("scene.toml".into()));
    let results = file(format!("{}-{k}.h5", measure.command[0]));
    arguments.extend(["--force", "-o", &results].map(String::from));
    execute(&arguments)
}

/// The commands that measure.
fn commands(b: &Benchmark) -> String {
    let each: Vec<String> =
        b.measures.iter().map(|m| format!("`{}`", m.command.join(" "))).collect();
    each.join(", ")
}

/// How far off, in words: below rounding of other machines nothing is told.
fn off(x: f64) -> String {
    if x < 1e-12 { "below 1e-12".into() } else { format!("{x:.1e}") }
}

fn object(done: &[Done], others: &[Results]) -> Value {
    let quantity = |d: &Done, f: &Found| {
        let q = f.quantity;
        let of_others = others.iter().filter_map(|o| {
            let value = o.values.get(&d.benchmark.name)?.get(&q.name)?;
            Some(json!({"code": o.code, "value": value, "off": q.off(*value)}))
        });
        let value = f.value.as_ref().ok();
        json!({
            "name": q.name, "reference": q.reference, "within": q.within, "value": value, "off": value.map(|x| q.off(*x)),
            "passes": f.passes(), "error": f.value.as_ref().err(), "note": q.note, "others": of_others.collect::<Vec<_>>(),
        })
    };
    let benchmark = |d: &Done| {
        let b = d.benchmark;
        json!({
            "name": b.name, "title": b.title, "about": b.about, "kind": b.kind.word(), "source": b.source, "wall_s": d.seconds, "seconds_of_others": others.iter().filter_map(|o| Some(json!({"code": o.code, "seconds": o.seconds.get(&b.name)?}))).collect::<Vec<_>>(),
            "passes": d.found.iter().all(Found::passes), "quantities": d.found.iter().map(|f| quantity(d, f)).collect::<Vec<_>>(),
        })
    };
    json!({"benchmarks": done.iter().map(benchmark).collect::<Vec<_>>()})
}

fn text(done: &[Done], others: &[Results]) -> String {
    let mut out = String::new();
    for d in done {
        let b = d.benchmark;
        out += &format!(
            "{}: {}, by {} ({:.1} s)\n  {}: {}\n",
            b.name,
            b.title,
            commands(b),
            d.seconds,
            b.kind.word(),
            b.source
        );
        for f in &d.found {
            let q = f.quantity;
            let mark = if f.passes() { "ok    " } else { "MISSED" };
            out += &match &f.value {
                Err(e) => format!("  {mark} {}: {e}\n", q.name),
                Ok(x) => format!(
                    "  {mark} {:<52} {:>16}  off by {:<11} (within {:e} of {})\n",
                    q.name,
                    plain(*x),
                    off(q.off(*x)),
                    q.within,
                    plain(q.reference)
                ),
            };
            for o in others {
                if let Some(x) = o.values.get(&b.name).and_then(|v| v.get(&q.name)) {
                    let (of, x) = (off(q.off(*x)), plain(*x));
                    out += &format!("         {:<52} {x:>16}  off by {of}\n", o.code);
                }
            }
        }
        for o in others {
            if let Some(seconds) = o.seconds.get(&b.name) {
                out += &format!("         {}: {} s\n", o.code, plain(*seconds));
            }
        }
        out += "\n";
    }
    let missed = done.iter().flat_map(|d| &d.found).filter(|f| !f.passes()).count();
    let all: usize = done.iter().map(|d| d.found.len()).sum();
    out += &format!(
        "{} of {}, {missed} not within their tolerance\n",
        plural(all, "number"),
        plural(done.len(), "benchmark"),
    );
    others.iter().for_each(|o| out += &verdict(done, o));
    out
}

/// So many things.
fn plural(n: usize, thing: &str) -> String {
    format!("{n} {thing}{}", if n == 1 { "" } else { "s" })
}

/// What another code comes to, by the tolerances of this program's numbers.
fn verdict(done: &[Done], other: &Results) -> String {
    let mut all = vec![];
    for (d, f) in done.iter().flat_map(|d| d.found.iter().map(move |f| (d, f))) {
        let q = f.quantity;
        let value = other.values.get(&d.benchmark.name).and_then(|v| v.get(&q.name));
        all.extend(value.map(|x| (q.off(*x), q.accepts(*x), &d.benchmark.name, &q.name)));
    }
    let Some(worst) = all.iter().max_by(|a, b| a.0.total_cmp(&b.0)) else {
        return format!("{}: no number of these benchmarks\n", other.code);
    };
    let within = all.iter().filter(|a| a.1).count();
    format!(
        "{}: {within} of {} within the tolerances of this program; farthest off by {} ({}, {})\n",
        other.code,
        plural(all.len(), "number"),
        off(worst.0),
        worst.2,
        worst.3
    )
}

fn markdown(done: &[Done], others: &[Results]) -> String {
    let about = format!(
        "Problems of vibration with contact, each with a number that somebody else found, for other codes as well: scenes and definitions are in \
         `validate/benchmarks`, `signorini benchmark --form` prints the form in which a code says what it found, and [Other codes](../benchmarks.md) says how it comes onto \
         this page. {} benchmarks; `make validation` writes this page.",
        done.len()
    );
    let mut out = format!("# Benchmarks\n\n{}", paragraph(&about));
    for d in done {
        let b = d.benchmark;
        let names: String =
            others.iter().map(|o| format!(" {} |", o.code.replace('|', "\\|"))).collect();
        let lines: String = others.iter().map(|_| " --- |").collect();
        let timed = others
            .iter()
            .filter_map(|o| Some(format!("; {} {} s", o.code, plain(*o.seconds.get(&b.name)?))));
        let timed: String = timed.collect();
        let about = format!(
            "{}. {} {}: {}. By {} (`signorini benchmark {}`, {} s{timed}).",
            b.title,
            b.about,
            capital(b.kind.word()),
            b.source,
            commands(b),
            b.name,
            if d.seconds < 9.95 {
                format!("{:.1}", d.seconds)
            } else {
                format!("{:.0}", d.seconds)
            },
        );
        out += &format!(
            "\n## {}\n\n{}\n| what | reference | within | off by |{names}\n| --- | --- | --- | --- |{lines}\n",
            b.name,
            paragraph(&about),
        );
        for f in &d.found {
            let q = f.quantity;
            let ours = f.value.as_ref().map_or_else(String::clone, |x| off(q.off(*x)));
            let theirs = others.iter().map(|o| {
                let value = o.values.get(&b.name).and_then(|v| v.get(&q.name));
                format!(" {} |", value.map_or_else(String::new, |x| off(q.off(*x))))
            });
            let note = q.note.as_ref().map_or_else(String::new, |n| format!(" ({n})"));
            let missed = if f.passes() { "" } else { " **(missed)**" };
            out += &format!(
                "| {}{note} | {} | {:e} | {ours}{missed} |{}\n",
                q.name,
                plain(q.reference),
                q.within,
                theirs.collect::<String>()
            );
        }
    }
    for o in others {
        out += &format!("\n{}: {}\n", o.code, o.note);
    }
    out
}

fn capital(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map_or_else(String::new, |c| c.to_uppercase().chain(letters).collect())
}
