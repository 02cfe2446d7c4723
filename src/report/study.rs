//! Tables and pictures of a study.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::Path;

use plotters::style::RGBColor;

use super::figure::{
    Axis as Ruler, Cell, Chart, Drawing, Legend, Mark, Sheet, entry, range, series_colour,
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

/// Colours that are told apart.
const COLOURS: usize = 8;
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
pub(crate) fn tasks_csv(table: &StudyTable) -> String {
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
pub(crate) fn points_csv(table: &StudyTable) -> String {
    let points = &table.points;
    let names = table.varied.iter().map(|v| &v.0).chain(points.columns.iter().map(|c| &c.0));
    let head: Vec<String> = names.map(|n| cell(n)).collect();
    let mut out = format!("task,id,{},special\n", head.join(","));
    for (row, &task) in points.task.iter().enumerate() {
        let values = table.varied.iter().map(|v| cell(&v.1[task]));
        let values = values.chain(points.columns.iter().map(|c| number(c.1[row])));
        let (id, values) = (&table.ids[task], values.collect::<Vec<_>>().join(","));
        let _ = writeln!(out, "{task},{id},{values},{}", cell(&points.special[row]));
    }
    out
}

/// All pictures: families over the frequency, and results over the first varied key whose values are numbers.
pub fn pictures(table: &StudyTable, stem: &Path, show: &[String]) -> Vec<Drawing<'static>> {
    let named =
        |name, sheet: Option<_>| sheet.map(|sheet| Drawing { stem: beside(stem, name), sheet });
    let all = [named("-families", families(table)), named("-results", results(table, show))];
    all.into_iter().flatten().collect()
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
    let short = |key: &str| key.rsplit('.').next().unwrap_or(key).to_owned();
    let told = told(table, without).map(|(_, v)| format!("{} {}", short(&v.0), v.1[task]));
    told.collect::<Vec<_>>().join(", ")
}

/// The keys that differ, but for the one that is told elsewhere.
fn told(
    table: &StudyTable,
    without: Option<usize>,
) -> impl Iterator<Item = (usize, &(String, Vec<String>))> {
    let all = table.varied.iter().enumerate();
    all.filter(move |(k, v)| Some(*k) != without && v.1.iter().any(|x| *x != v.1[0]))
}

/// Energy against frequency: many tasks in a panel for each value of the first key, a colour for each combination of the others.
fn families(table: &StudyTable) -> Option<Sheet<'static>> {
    let lines = Lines::of(table);
    if lines.is_empty() {
        return None;
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
    let styles = Series::of(table, without);
    let panels: Vec<Option<&String>> =
        if parted { values.into_iter().map(Some).collect() } else { vec![None] };
    // energies of a family span decades
    let all = || lines.iter().flat_map(|l| &l.points);
    let (x, y) = (range(all().map(|p| p.0)), range(all().map(|p| p.1.log10())));
    let chart = |value: &Option<&String>| {
        let label = value.map_or("energy".into(), |v| format!("energy ({v})"));
        let x = Ruler::linear("frequency ω", x.clone());
        let mut chart = Chart::new(x, Ruler::scaled(label, y.clone(), true));
        for line in lines.iter().filter(|l| value.is_none_or(|v| first[l.task] == *v)) {
            let points: Vec<_> = line.points.iter().map(|p| (p.0, p.1.log10())).collect();
            let (colour, mark) = styles.looks[styles.of[line.task]];
            chart.series(&points, mark, colour);
        }
        chart
    };
    Some(abreast(styles.sheet(table), 420.0, panels.iter().map(chart).collect()))
}

/// Charts in rows of two.
fn abreast(mut sheet: Sheet<'static>, height: f64, charts: Vec<Chart>) -> Sheet<'static> {
    let mut cells = charts.into_iter().map(Cell::from).peekable();
    while cells.peek().is_some() {
        sheet = sheet.row(height, cells.by_ref().take(2).collect());
    }
    sheet
}

/// A piece of a branch of a task: where no orbit was found, or the family jumped, another begins.
struct Lines {
    task: usize,
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
        let branch = |k: usize| points.column("branch").map_or(0.0, |b| b[k]);
        let mut all: Vec<Lines> = vec![];
        let mut before: Option<usize> = None;
        for k in 0..omega.len() {
            if !(omega[k].is_finite() && energy[k] > 0.0) {
                before = None;
                continue;
            }
            let goes_on = before.is_some_and(|b| {
                (points.task[b], branch(b)) == (points.task[k], branch(k))
                    && points.special[k] != "jump"
            });
            if !goes_on {
                all.push(Lines { task: points.task[k], points: vec![] });
            }
            if let Some(line) = all.last_mut() {
                line.points.push((omega[k], energy[k]));
            }
            before = Some(k);
        }
        all
    }
}

/// The number of each value among those that differ, in the order in which they are met.
fn places(values: &[String]) -> Vec<usize> {
    let mut known: HashMap<&String, usize> = HashMap::new();
    values
        .iter()
        .map(|value| {
            let next = known.len();
            *known.entry(value).or_insert(next)
        })
        .collect()
}

/// What tasks are called, and how they are drawn: those of one name are one series.
struct Series {
    names: Vec<String>,
    looks: Vec<Look>,
    /// The series of each task.
    of: Vec<usize>,
}

/// Colour and mark.
type Look = (RGBColor, Mark);

impl Series {
    /// `without` the key that is told elsewhere. Of two keys the first has the colours and the second the marks.
    fn of(table: &StudyTable, without: Option<usize>) -> Series {
        let told: Vec<Vec<usize>> = told(table, without).map(|(_, v)| places(&v.1)).collect();
        let kinds = |places: &[usize]| places.iter().max().map_or(0, |k| k + 1);
        let is_pair =
            told.len() == 2 && kinds(&told[0]) <= COLOURS && kinds(&told[1]) <= MARKS.len();
        let (mut names, mut looks): (Vec<String>, Vec<Look>) = (vec![], vec![]);
        let all: Vec<String> = (0..table.ids.len()).map(|t| named(table, t, without)).collect();
        let of = places(&all);
        for (task, (name, &k)) in all.iter().zip(&of).enumerate() {
            if k < names.len() {
                continue;
            }
            let (colour, mark) = match is_pair {
                true => (told[0][task], told[1][task]),
                false => (k, k / COLOURS),
            };
            names.push(name.clone());
            looks.push((series_colour(colour), MARKS[mark % MARKS.len()]));
        }
        Series { names, looks, of }
    }

    /// A sheet with a legend, where there is something to tell.
    fn sheet(&self, table: &StudyTable) -> Sheet<'static> {
        let what = format!("{} of {} tasks", table.command, table.ids.len());
        let sheet = Sheet::new(&table.name, &what);
        if !(2..=MOST_NAMED).contains(&self.names.len()) {
            return sheet;
        }
        let both = self.names.iter().zip(&self.looks);
        sheet.legend(Legend::Columns(both.map(|(n, l)| entry(n, l.0, l.1)).collect()))
    }
}

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
fn results(table: &StudyTable, show: &[String]) -> Option<Sheet<'static>> {
    let Axis { over, x, words, label: across } = Axis::of(table)?;
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
        return None;
    }
    let styles = Series::of(table, Some(over));
    let curves = |values: &[f64]| -> Vec<Vec<(f64, f64)>> {
        let mut all = vec![vec![]; styles.names.len()];
        for task in (0..table.ids.len()).filter(is_done).filter(|&t| values[t].is_finite()) {
            all[styles.of[task]].push((x[task], values[task]));
        }
        all.iter_mut().for_each(|c| c.sort_by(|a, b| a.0.total_cmp(&b.0)));
        all
    };
    let chart = |(name, values): &&(String, Vec<f64>)| {
        let curves = curves(values);
        let all = || curves.iter().flatten();
        let (sides, up) = (range(all().map(|p| p.0)), range(all().map(|p| p.1)));
        // words have no order that a line could mean
        let ruler = match words.is_empty() {
            true => Ruler::linear(&across, sides),
            false => Ruler::named(&across, 0.5..words.len() as f64 + 0.5, words.clone()),
        };
        let mut chart = Chart::new(ruler, Ruler::linear(name.replace('_', " "), up));
        for (points, &(colour, mark)) in curves.iter().zip(&styles.looks) {
            match words.is_empty() {
                true => chart.series(points, mark, colour),
                false => chart.marks(points.iter().copied(), mark, colour),
            }
        }
        chart
    };
    Some(abreast(styles.sheet(table), 320.0, chosen.iter().map(chart).collect()))
}
