//! The visits of a chart: how points come and leave along a sequence of active sets, and the sequence without some of them.

use super::chain::Chain;
use crate::contact::{PointState, States};

/// Visits whose ends differ by less of their duration are one.
const TOGETHER: f64 = 1e-3;
/// Times that differ by less, over the period, are one time of contacts that graze together.
const AT_ONCE: f64 = 1e-9;
/// Visits below this, over the period, are what rounding errors make of a grazing.
pub(super) const MOMENT: f64 = 1e-6;

/// A visit in a chart: of a point that comes and leaves, or of several that do so together.
#[derive(Debug)]
pub(super) struct Visit {
    /// The points, with their states during it, and the switches by which each comes and leaves.
    pub of: Vec<((usize, PointState), (usize, usize))>,
    /// When it begins and ends.
    pub span: (f64, f64),
}

impl Visit {
    /// How long it lasts.
    pub fn duration(&self) -> f64 {
        self.span.1 - self.span.0
    }

    /// The time of its middle.
    pub fn middle(&self) -> f64 {
        0.5 * (self.span.0 + self.span.1)
    }

    /// Whether a switch of a point is one end of it.
    pub fn has(&self, j: usize, point: usize) -> bool {
        self.of.iter().any(|((p, _), (a, b))| *p == point && (j == *a || j == *b))
    }
}

/// The switches of a point in a chart.
pub(super) fn switches_of(chain: &Chain, point: usize) -> Vec<usize> {
    let at = |j: usize| chain.sets[j].at(point);
    (0..chain.events()).filter(|&j| at(j) != at(j + 1)).collect()
}

/// The stays of a point: neighbouring switches of it, the second of which takes back what the first does.
fn stays(chain: &Chain, point: usize) -> impl Iterator<Item = (usize, usize)> {
    let at = move |j: usize| chain.sets[j].at(point);
    let switches = switches_of(chain, point);
    let pairs = switches.windows(2).map(|pair| (pair[0], pair[1])).collect::<Vec<_>>();
    pairs.into_iter().filter(move |&(a, b)| at(a) == at(b + 1))
}

/// The visits of a chart that are no longer than `longest`, in the order of their beginnings; what lies between is another's business.
pub(super) fn visits(chain: &Chain, times: &[f64], longest: f64) -> Vec<Visit> {
    let mut found: Vec<Visit> = vec![];
    for point in 0..chain.sets[0].len() {
        for (a, b) in stays(chain, point).filter(|&(a, b)| times[b] - times[a] <= longest) {
            let to = chain.sets[a + 1].at(point);
            found.push(Visit { of: vec![((point, to), (a, b))], span: (times[a], times[b]) });
        }
    }
    found.sort_by(|a, b| a.span.0.total_cmp(&b.span.0));
    found.dedup_by(|b, a| {
        let tolerance = TOGETHER * a.duration();
        let is_same = b.span.0 - a.span.0 <= tolerance && (b.span.1 - a.span.1).abs() <= tolerance;
        if is_same {
            a.of.append(&mut b.of);
        }
        is_same
    });
    found
}

/// The active sets of a chart where they change, those of switches at one time as one change.
pub(super) fn merged(chain: &Chain, times: &[f64], end: f64) -> (States, Vec<(f64, States)>) {
    let is_last = |&j: &usize| times.get(j + 1).is_none_or(|t| t - times[j] > AT_ONCE * end);
    let changes = (0..times.len()).filter(is_last).map(|j| (times[j], chain.sets[j + 1].clone()));
    (chain.sets[0].clone(), changes.collect())
}

/// Whether a visit in one state may be one in the other: of a point that touches, whatever it does along the obstacle.
pub(super) fn is_like(a: PointState, b: PointState) -> bool {
    a == b || a.touches() && b.touches()
}

/// Whether switch `j` of a point is one end of a visit in a state that rounding errors make of a grazing.
pub(super) fn is_moment(
    chain: &Chain,
    times: &[f64],
    (j, (point, to)): (usize, (usize, PointState)),
    end: f64,
) -> bool {
    let is_brief = |a: usize, b: usize| times[b] - times[a] <= MOMENT * end;
    let is_in = |a: usize| is_like(chain.sets[a + 1].at(point), to);
    stays(chain, point).any(|(a, b)| (a == j || b == j) && is_brief(a, b) && is_in(a))
}

/// A chart without the switches that `is_gone` tells of, by their number and point.
pub(super) fn thinned(
    chain: &Chain,
    times: &[f64],
    is_gone: impl Fn(usize, usize) -> bool,
) -> (Chain, Vec<f64>) {
    let mut set = chain.sets[0].clone();
    let (mut sets, mut points, mut left) = (vec![set.clone()], vec![], vec![]);
    for (j, pair) in chain.sets.windows(2).enumerate() {
        let stay: Vec<_> =
            pair[0].changes(&pair[1]).filter(|(point, ..)| !is_gone(j, *point)).collect();
        let Some(&(first, ..)) = stay.first() else { continue };
        stay.iter().for_each(|&(point, _, to)| set.set(point, to));
        let told = stay.iter().find(|change| change.0 == chain.points[j]).map_or(first, |c| c.0);
        sets.push(set.clone());
        points.push(told);
        left.push(times[j]);
    }
    (Chain { sets, points, struck: vec![] }, left)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chart of five points by what each switch changes, with the times of these.
    fn chart(switches: &[(f64, &[usize])]) -> (Chain, Vec<f64>) {
        let mut set = States::open(5);
        let (mut sets, mut points, mut times) = (vec![set.clone()], vec![], vec![]);
        for (t, of) in switches {
            of.iter().for_each(|&p| set.set(p, PointState::of_contact(!set.touches(p))));
            sets.push(set.clone());
            points.push(of[0]);
            times.push(*t);
        }
        (Chain { sets, points, struck: vec![] }, times)
    }

    fn found(chart: &(Chain, Vec<f64>), longest: f64) -> Vec<Vec<usize>> {
        let points = |v: Visit| v.of.iter().map(|((p, _), _)| *p).collect::<Vec<usize>>();
        visits(&chart.0, &chart.1, longest).into_iter().map(points).collect()
    }

    /// Nested, overlapping, and those of two points that come and leave together, by one switch or by two in any order.
    #[test]
    fn visits_are_those_of_each_point() {
        let nested = chart(&[(1.0, &[0]), (1.2, &[1]), (1.3, &[1]), (1.5, &[0])]);
        assert_eq!(found(&nested, 1.0), [vec![0], vec![1]]);
        assert_eq!(found(&nested, 0.2), [vec![1]]);
        let across = chart(&[(1.0, &[0]), (1.2, &[1]), (1.3, &[0]), (1.5, &[1])]);
        assert_eq!(found(&across, 0.31), [vec![0], vec![1]]);
        let twins = chart(&[(1.0, &[2]), (1.0 + 1e-12, &[3]), (1.5, &[2]), (1.5 + 1e-12, &[3])]);
        let at_once = chart(&[(1.0, &[2, 3]), (1.5, &[2, 3])]);
        for chart in [&twins, &at_once] {
            assert_eq!(found(chart, 1.0), [vec![2, 3]]);
        }
        // the time for which a point is away is a visit, too, if it is short
        let twice = chart(&[(1.0, &[0]), (2.0, &[0]), (2.1, &[0]), (3.0, &[0])]);
        let away = visits(&twice.0, &twice.1, 0.5);
        assert_eq!(away[0].of, [((0, PointState::Open), (1, 2))]);
        assert_eq!(found(&twice, 5.0).len(), 3);
    }

    #[test]
    fn a_chart_without_a_visit_keeps_the_others() {
        let across = chart(&[(1.0, &[0, 4]), (1.2, &[1]), (1.3, &[0]), (1.5, &[1]), (1.6, &[4])]);
        let of_0 = visits(&across.0, &across.1, 0.31).remove(0);
        assert_eq!(of_0.of[0].0.0, 0);
        let (chain, times) = thinned(&across.0, &across.1, |j, point| of_0.has(j, point));
        let wanted = chart(&[(1.0, &[4]), (1.2, &[1]), (1.5, &[1]), (1.6, &[4])]);
        assert_eq!(
            (&chain.sets, &chain.points, &times),
            (&wanted.0.sets, &wanted.0.points, &wanted.1)
        );
        let closed = |point: usize| (point, PointState::Closed);
        assert!(!is_moment(&across.0, &across.1, (0, closed(0)), 1.0));
        assert!(is_moment(&across.0, &across.1, (2, closed(0)), 1e7));
        assert!(!is_moment(&across.0, &across.1, (2, (0, PointState::Open)), 1e7));
        // a minimum of a gap does not know what the point does along the obstacle
        assert!(is_moment(&across.0, &across.1, (2, (0, PointState::Stick)), 1e7));
    }

    #[test]
    fn switches_at_one_time_are_one_change() {
        let twins = chart(&[(1.0, &[2]), (1.0 + 1e-12, &[3]), (1.5, &[3]), (1.5 + 1e-12, &[2])]);
        let swapped = chart(&[(1.0, &[3]), (1.0 + 1e-12, &[2]), (1.5, &[2, 3])]);
        let sets = |c: &(Chain, Vec<f64>)| {
            let (first, others) = merged(&c.0, &c.1, 2.0);
            (first, others.into_iter().map(|(_, set)| set).collect::<Vec<States>>())
        };
        assert_eq!(sets(&twins), sets(&swapped));
        assert_eq!(sets(&twins).1.len(), 2);
    }
}
