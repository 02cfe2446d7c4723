//! Tables and pictures of a study.

use std::fmt::Write as _;
use std::path::Path;

use plotters::style::RGBColor;

use super::figure::{
    self, Chart, Drawing, Drawn, Entry, FigureError, Mark, columns, draw_line, legend_columns,
    line, panel, px, range, semilog, series_colour, symbols, title,
};
use crate::records::StudyTable;
use crate::store::beside;

/// How many results are drawn where none is asked for.
const SHOWN: usize = 4;
/// Those that are drawn first.
const FIRST: [&str; 10] = [
    "omega",
    "period",
    "energy",
    "amplitude",
    "switches",
    "contact_time",
    "energy_jumps",
    "energy_end",
    "peaks",
    "points",
];
/// Pairs of tasks that are compared for whether a result depends on the axis.
const MOST_PAIRS: usize = 100_000;
/// Differences below this are rounding, and drawn only when they are asked for.
const ROUNDING: f64 = 1e-9;
/// More tasks than this are parted by the first key, if it has at most [`MOST_PANELS`] values.
const FEW: usize = 8;
const MOST_PANELS: usize = 6;
/// More series than this are told by no legend.
const MOST_NAMED: usize = 24;

const MARKS: [Mark; 5] = [Mark::Disc, Mark::Square, Mark::Triangle, Mark::Diamond, Mark::Circle];

/// A cell of a CSV.
fn cell(text: &str) -> String {
    let is_plain = !text.contains([',', '"', '\n', '\r', ';']);
    if is_plain { text.to_owned() } else { format!("\"{}\"", text.replace('"', "\"\"")) }
}

fn number(x: f64) -> String {
    match x.abs() {
        size if !size.is_finite() => String::new(),
        size if size == 0.0 || (1e-4..1e15).contains(&size) => format!("{x}"),
        _ => format!("{x:e}"),
    }
}

/// A row for each task: `index,id,state`, varied keys, results, message.
pub fn tasks_csv(table: &StudyTable) -> String {
    let names = table.varied.iter().map(|v| &v.0).chain(table.results.iter().map(|r| &r.0));
    let head: Vec<String> = names.map(|n| cell(n)).collect();
    let mut out = format!("index,id,state,{},message\n", head.join(","));
    for row in 0..table.ids.len() {
        let values = table.varied.iter().map(|v| cell(&v.1[row]));
        let values = values.chain(table.results.iter().map(|r| number(r.1[row])));
        let values: Vec<String> = values.collect();
        let (id, state) = (&table.ids[row], &table.states[row]);
        let message = cell(table.messages[row].lines().next().unwrap_or_default());
        let _ = writeln!(out, "{row},{id},{state},{},{message}", values.join(","));
    }
    out
}

/// A row for each point of a family: the task, its varied keys, the point.
pub fn points_csv(table: &StudyTable) -> String {
    let points = &table.points;
    let names = table.varied.iter().map(|v| &v.0).chain(points.columns.iter().map(|c| &c.0));
    let head: Vec<String> = names.map(|n| cell(n)).collect();
    let mut out = format!("task,id,{}\n", head.join(","));
    for (row, &task) in points.task.iter().enumerate() {
        let values = table.varied.iter().map(|v| cell(&v.1[task]));
        let values = values.chain(points.columns.iter().map(|c| number(c.1[row])));
        let _ =
            writeln!(out, "{task},{},{}", table.ids[task], values.collect::<Vec<_>>().join(","));
    }
    out
}

/// Colour and mark of the `k`-th series.
fn look(k: usize) -> (RGBColor, Mark) {
    (series_colour(k), MARKS[(k / 8) % MARKS.len()])
}

/// All pictures: families over the frequency, and results over the first varied key whose values are numbers.
pub fn pictures(
    table: &StudyTable,
    stem: &Path,
    show: &[String],
) -> Result<Vec<Drawing>, FigureError> {
    let mut drawings = vec![];
    if let Some(svg) = families(table)? {
        drawings.push(Drawing { stem: beside(stem, "-families"), svg });
    }
    if let Some(svg) = results(table, show)? {
        drawings.push(Drawing { stem: beside(stem, "-results"), svg });
    }
    Ok(drawings)
}

/// What a task is called in a legend: its values of the keys with more than one; nothing where every task has values of its own (lists side by side).
fn named(table: &StudyTable, task: usize, without: Option<usize>) -> String {
    let first = |v: &(String, Vec<String>)| v.1.iter().filter(|x| **x == v.1[task]).count();
    if without.is_some()
        && table.ids.len() > 1
        && table.varied.len() > 1
        && table.varied.iter().all(|v| first(v) == 1)
    {
        return String::new();
    }
    let told = table
        .varied
        .iter()
        .enumerate()
        .filter(|(k, v)| Some(*k) != without && v.1.iter().any(|x| *x != v.1[0]));
    let short = |key: &str| key.rsplit('.').next().unwrap_or(key).to_owned();
    told.map(|(_, v)| format!("{} {}", short(&v.0), v.1[task])).collect::<Vec<_>>().join(", ")
}

/// Energy against frequency: many tasks in a panel for each value of the first key, a colour for each combination of the others.
fn families(table: &StudyTable) -> Result<Option<String>, FigureError> {
    let lines = Lines::of(table);
    if lines.is_empty() {
        return Ok(None);
    }
    let first = &table.varied[0].1;
    let mut values: Vec<&String> = vec![];
    first.iter().for_each(|v| {
        if !values.contains(&v) {
            values.push(v)
        }
    });
    let parted = table.ids.len() > FEW && (2..=MOST_PANELS).contains(&values.len());
    let without = parted.then_some(0);
    let mut labels: Vec<String> = vec![];
    let mut colour = vec![];
    for task in 0..table.ids.len() {
        let name = named(table, task, without);
        let at = labels.iter().position(|l| *l == name).unwrap_or_else(|| {
            labels.push(name);
            labels.len() - 1
        });
        colour.push(at);
    }
    let panels: Vec<Option<&String>> =
        if parted { values.into_iter().map(Some).collect() } else { vec![None] };
    let rows = panels.len().div_ceil(2);
    let legend = if labels.len() <= MOST_NAMED { 24 * labels.len().div_ceil(3) as u32 } else { 0 };
    figure::svg((980, 60 + legend + 420 * rows as u32), |root| {
        title(root, &table.name, &format!("{} of {} tasks", table.command, table.ids.len()))?;
        let (_, mut sheet) = root.split_vertically(px(32.0));
        if labels.len() <= MOST_NAMED && labels.len() > 1 {
            let entry = |(k, l)| -> Entry { (l, look(k).0, look(k).1) };
            let entries: Vec<Entry> =
                labels.iter().map(String::as_str).enumerate().map(entry).collect();
            sheet = legend_columns(sheet, &entries)?;
        }
        // energies of a family span decades
        let all = || lines.iter().flat_map(|l| &l.points);
        let (x, y) = (range(all().map(|p| p.0)), range(all().map(|p| p.1.log10())));
        let areas = sheet.split_evenly((rows, panels.len().min(2)));
        for (area, value) in areas.iter().zip(&panels) {
            let label = value.map_or("energy".into(), |v| format!("energy ({v})"));
            let mut chart = semilog(area, x.clone(), y.clone(), "frequency ω", &label)?;
            for line in lines.iter().filter(|l| value.is_none_or(|v| first[l.task] == *v)) {
                let points: Vec<_> = line.points.iter().map(|p| (p.0, p.1.log10())).collect();
                series(&mut chart, &points, colour[line.task])?;
            }
        }
        Ok(())
    })
    .map(Some)
}

/// A branch of a task.
struct Lines {
    task: usize,
    branch: f64,
    /// Frequency and energy.
    points: Vec<(f64, f64)>,
}

impl Lines {
    /// Those of all tasks, points in their order.
    fn of(table: &StudyTable) -> Vec<Lines> {
        let points = &table.points;
        let (Some(omega), Some(energy)) = (points.column("omega"), points.column("energy")) else {
            return vec![];
        };
        let branches = points.column("branch");
        let mut all: Vec<Lines> = vec![];
        for k in (0..omega.len()).filter(|&k| omega[k].is_finite() && energy[k] > 0.0) {
            let (task, branch) = (points.task[k], branches.map_or(0.0, |b| b[k]));
            let at = all.iter().position(|l| (l.task, l.branch) == (task, branch));
            let at = at.unwrap_or_else(|| {
                all.push(Lines { task, branch, points: vec![] });
                all.len() - 1
            });
            all[at].points.push((omega[k], energy[k]));
        }
        all
    }
}

fn series(chart: &mut Chart, points: &[(f64, f64)], k: usize) -> Drawn {
    let (colour, mark) = look(k);
    draw_line(chart, points.to_vec(), line(colour, 1.4))?;
    symbols(chart, points.iter().copied(), mark, colour)
}

/// A curve of results: its name and its points.
type Named = (String, Vec<(f64, f64)>);

/// What results are drawn over.
struct Axis {
    /// The key.
    over: usize,
    /// Its value for each task; of words the number of the word.
    x: Vec<f64>,
    /// The words at their numbers; none of a key whose values are numbers.
    words: Vec<(f64, String)>,
    label: String,
}

impl Axis {
    /// The first key whose values are numbers and differ; where there is none, the first whose words differ.
    fn of(table: &StudyTable) -> Option<Axis> {
        let differ = |k: &usize| table.varied[*k].1.iter().any(|v| *v != table.varied[*k].1[0]);
        let keys: Vec<usize> = (0..table.varied.len()).filter(differ).collect();
        let name = |k: usize| table.varied[k].0.clone();
        let numbers = keys.iter().find_map(|&k| Some((k, table.numbers(k)?)));
        if let Some((over, x)) = numbers {
            return Some(Axis { over, x, words: vec![], label: name(over) });
        }
        let over = *keys.first()?;
        let mut words: Vec<&String> = vec![];
        let place = |word| {
            words.iter().position(|w| *w == word).unwrap_or_else(|| {
                words.push(word);
                words.len() - 1
            })
        };
        let x = table.varied[over].1.iter().map(place).map(|k| k as f64 + 1.0).collect();
        let words = words.iter().enumerate().map(|(k, w)| (k as f64 + 1.0, (*w).clone())).collect();
        Some(Axis { over, x, words, label: name(over) })
    }
}

/// A panel for each result over the first key whose values are numbers and differ; a series for every combination of the others.
fn results(table: &StudyTable, show: &[String]) -> Result<Option<String>, FigureError> {
    let Some(Axis { over, x, words, label: across }) = Axis::of(table) else { return Ok(None) };
    let is_done = |task: &usize| table.states[*task] == "done";
    // along the axis, at the same values of all other keys
    let is_drawn = |values: &[f64]| {
        let known = |&t: &usize| is_done(&t) && values[t].is_finite();
        let of: Vec<usize> = (0..values.len()).filter(known).collect();
        let size = of.iter().fold(0.0f64, |m, &t| m.max(values[t].abs()));
        let is_axis = of.iter().all(|&t| values[t] == x[t]);
        let differ = |a: usize, b: usize| {
            (values[a] - values[b]).abs() > ROUNDING * size.max(1.0)
                && named(table, a, Some(over)) == named(table, b, Some(over))
        };
        let pairs = of.iter().enumerate().flat_map(|(k, &a)| of[..k].iter().map(move |&b| (a, b)));
        !is_axis && pairs.take(MOST_PAIRS).any(|(a, b)| differ(a, b))
    };
    let chosen: Vec<&(String, Vec<f64>)> = match show.is_empty() {
        true => {
            let drawn = || table.results.iter().filter(|r| is_drawn(&r.1));
            let rank = |r: &(String, Vec<f64>)| FIRST.iter().position(|f| *f == r.0);
            let mut first: Vec<_> = drawn().filter(|r| rank(r).is_some()).collect();
            first.sort_by_key(|r| rank(r));
            first.into_iter().chain(drawn().filter(|r| rank(r).is_none())).take(SHOWN).collect()
        }
        false => table.results.iter().filter(|r| show.contains(&r.0)).collect(),
    };
    if chosen.is_empty() {
        return Ok(None);
    }
    let curves = |values: &[f64]| -> Vec<Named> {
        let mut all: Vec<Named> = vec![];
        for task in (0..table.ids.len()).filter(is_done) {
            let name = named(table, task, Some(over));
            let at = all.iter().position(|c| c.0 == name).unwrap_or_else(|| {
                all.push((name, vec![]));
                all.len() - 1
            });
            if values[task].is_finite() {
                all[at].1.push((x[task], values[task]));
            }
        }
        all.iter_mut().for_each(|c| c.1.sort_by(|a, b| a.0.total_cmp(&b.0)));
        all
    };
    let rows = chosen.len().div_ceil(2) as u32;
    let abreast = chosen.len().min(2);
    figure::svg((980, 90 + 320 * rows), |root| {
        title(root, &table.name, &format!("{} of {} tasks", table.command, table.ids.len()))?;
        let (_, mut sheet) = root.split_vertically(px(32.0));
        let names = curves(&chosen[0].1);
        if names.len() <= MOST_NAMED && names.len() > 1 {
            let entry = |(k, c): (usize, &Named)| (c.0.clone(), look(k));
            let entries: Vec<(String, (RGBColor, Mark))> =
                names.iter().enumerate().map(entry).collect();
            let entries: Vec<Entry> =
                entries.iter().map(|(l, (c, m))| (l.as_str(), *c, *m)).collect();
            sheet = legend_columns(sheet, &entries)?;
        }
        let panels = sheet.split_evenly((rows as usize, abreast));
        for (area, (name, values)) in panels.iter().zip(&chosen) {
            let curves = curves(values);
            let all = || curves.iter().flat_map(|c| &c.1);
            let (sides, up) = (range(all().map(|p| p.0)), range(all().map(|p| p.1)));
            let label = name.replace('_', " ");
            if words.is_empty() {
                let mut chart = panel(area, sides, up, &across, &label)?;
                for (k, (_, points)) in curves.iter().enumerate() {
                    series(&mut chart, points, k)?;
                }
                continue;
            }
            // words have no order that a line could mean
            let sides = 0.5..words.len() as f64 + 0.5;
            let chart = columns(area, (sides, &words), (up, false), &across, &label)?;
            for (k, (_, points)) in curves.iter().enumerate() {
                symbols(&chart, points.iter().copied(), look(k).1, look(k).0)?;
            }
        }
        Ok(())
    })
    .map(Some)
}
