//! Pseudo-arclength continuation over charts.

mod borders;
mod locate;

use super::newton::{correct, tangent, tangent_of};
use super::{Family, Judgement};

/// How a branch is followed.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Stop when `λ` leaves this range.
    pub range: (f64, f64),
    /// First, least and largest step of arclength.
    pub step: (f64, f64, f64),
    /// Most points.
    pub points: usize,
    /// Locate changes of stability (each costs a dozen corrected points).
    pub locate: bool,
    /// Keep `λ` as the variable that is stepped (natural continuation): it ends at the first fold.
    pub natural: bool,
}

/// What a point is besides a regular one.
#[derive(Debug, Clone, PartialEq)]
pub enum Special<B> {
    /// The first point.
    Start,
    /// `λ` turns back.
    Fold,
    /// `λ` turns back at a corner of the branch that is no border that its family knows; whether this is the corner, or one lies near it in the same step.
    Corner {
        /// It is.
        located: bool,
    },
    /// A simple branch point: the determinant of the bordered Jacobian changes its sign.
    BranchPoint,
    /// The signature changes, from the first to the second.
    Stability(Vec<i64>, Vec<i64>),
    /// A border between two charts.
    Border {
        /// Which.
        border: B,
        /// `λ` turns back there.
        turns: bool,
    },
    /// An end of the range of `λ`.
    End,
}

/// Where a continuation stands: all that the next step depends on.
#[derive(Debug, Clone)]
pub struct Place<C> {
    /// The point.
    pub x: Vec<f64>,
    /// Unit tangent in the direction of travel.
    pub tangent: Vec<f64>,
    /// Step of arclength to try next.
    pub step: f64,
    /// Chart.
    pub chart: C,
    /// Sign of the bordered determinant.
    pub orientation: f64,
    /// Signature.
    pub signature: Vec<i64>,
}

/// A point of a branch, as it is handed out.
#[derive(Debug, Clone)]
pub struct Point<C, B> {
    /// What it is, if special.
    pub special: Option<Special<B>>,
    /// Newton steps it took.
    pub iterations: usize,
    /// Where to go on from. For a special point between two regular ones: where the step began.
    pub place: Place<C>,
    /// The point itself.
    pub x: Vec<f64>,
}

/// A point of a family.
pub(crate) type PointOf<F> = Point<<F as Family>::Chart, <F as Family>::Border>;

/// Why a continuation ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Stop {
    /// `λ` reached an end of the range.
    Range,
    /// As many points as were asked for.
    Points,
    /// No step, however small, could be corrected.
    Step {
        /// `λ` there.
        lambda: f64,
    },
    /// Behind a border nothing is admissible.
    DeadEnd {
        /// `λ` there.
        lambda: f64,
        /// The border.
        border: String,
    },
    /// Whoever took the points had enough.
    Interrupted,
}

impl std::fmt::Display for Stop {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Stop::Range => write!(f, "end of the range"),
            Stop::Points => write!(f, "number of points reached"),
            Stop::Step { lambda } => write!(f, "no smaller step converges at {lambda:.9}"),
            Stop::DeadEnd { lambda, border } => {
                write!(f, "no admissible continuation at {lambda:.9} behind: {border}")
            }
            Stop::Interrupted => write!(f, "interrupted"),
        }
    }
}

/// Whether to go on.
pub type Go = std::ops::ControlFlow<()>;

struct Walker<'f, F: Family, T> {
    family: &'f mut F,
    options: &'f Options,
    place: Place<F::Chart>,
    take: T,
    count: usize,
}

/// How a step over borders ended.
enum Leap {
    /// At a point of the branch.
    Landed(Option<Stop>),
    /// Nowhere; a shorter one may.
    TooFar,
    /// The family has borders that are to be located.
    NotOffered,
}

/// One corrected step.
#[derive(Clone)]
struct Step {
    x: Vec<f64>,
    tangent: Vec<f64>,
    orientation: f64,
    iterations: usize,
}

/// Follow a branch from `place`; every point is handed to `take`.
pub fn follow<F: Family>(
    family: &mut F,
    place: Place<F::Chart>,
    options: &Options,
    take: impl FnMut(&mut F, PointOf<F>) -> Go,
) -> Result<Stop, F::Error> {
    family.set_chart(&place.chart);
    let mut walker = Walker { family, options, place, take, count: 0 };
    loop {
        if let Some(stop) = walker.advance()? {
            return Ok(stop);
        }
        if walker.count >= options.points {
            return Ok(Stop::Points);
        }
    }
}

impl<C: Clone> Place<C> {
    /// Start at a solution, towards growing (`direction > 0`) or falling `λ`.
    pub fn start<F: Family<Chart = C>>(
        family: &mut F,
        x: Vec<f64>,
        direction: f64,
        step: f64,
    ) -> Result<Option<Place<C>>, F::Error> {
        let mut c = vec![0.0; x.len()];
        c[x.len() - 1] = direction.signum();
        let Some((tangent, orientation)) = tangent(family, &x, &c)? else { return Ok(None) };
        let signature = family.signature(&x)?;
        Ok(Some(Place { chart: family.chart(), x, tangent, step, orientation, signature }))
    }
}

impl<F: Family, T: FnMut(&mut F, PointOf<F>) -> Go> Walker<'_, F, T> {
    fn hand_out(
        &mut self,
        x: Vec<f64>,
        special: Option<Special<F::Border>>,
        iterations: usize,
    ) -> Option<Stop> {
        self.count += 1;
        let point = Point { special, iterations, place: self.place.clone(), x };
        match (self.take)(self.family, point) {
            Go::Continue(()) => None,
            Go::Break(()) => Some(Stop::Interrupted),
        }
    }

    /// The branch at arclength `s` from the present point.
    fn at(&mut self, s: f64) -> Result<Option<Step>, F::Error> {
        let Place { x, tangent: t, .. } = &self.place;
        let mut predicted: Vec<f64> = x.iter().zip(t).map(|(x, t)| x + s * t).collect();
        if let Some(bend) = self.family.bend(x) {
            predicted.iter_mut().zip(bend).for_each(|(x, b)| *x += 0.5 * s * s * b);
        }
        let mut c: Vec<f64> = if self.options.natural {
            vec![0.0; x.len()]
        } else {
            self.family.weights(x).iter().zip(t).map(|(w, t)| w * t).collect()
        };
        if self.options.natural {
            c[x.len() - 1] = 1.0;
        }
        let gamma = c.iter().zip(&predicted).map(|(c, x)| c * x).sum();
        let Some(found) = correct(self.family, &predicted, &c, gamma)? else { return Ok(None) };
        // a solution far from the prediction belongs to another branch
        let weights = self.family.weights(&predicted);
        let off: f64 = found
            .x
            .iter()
            .zip(&predicted)
            .zip(&weights)
            .map(|((a, b), w)| w * (a - b).powi(2))
            .sum();
        if off.sqrt() > 2.0 * s.abs() {
            return Ok(None);
        }
        let along: Vec<f64> = if self.options.natural {
            c.iter().map(|c| c * t[x.len() - 1].signum()).collect()
        } else {
            c
        };
        let Some((tangent, orientation)) =
            tangent_of(self.family, &found.x, &found.jacobian, &along)
        else {
            return Ok(None);
        };
        Ok(Some(Step { x: found.x, tangent, orientation, iterations: found.iterations }))
    }

    fn lambda(x: &[f64]) -> f64 {
        x[x.len() - 1]
    }

    /// One regular step, or the way to a border and over it.
    fn advance(&mut self) -> Result<Option<Stop>, F::Error> {
        let (_, least, largest) = self.options.step;
        let mut s = self.place.step.min(largest).max(least);
        loop {
            let stop = Stop::Step { lambda: Self::lambda(&self.place.x) };
            if s < least {
                return Ok(Some(stop));
            }
            let Some(step) = self.at(s)? else {
                if let Leap::Landed(stop) = self.leap(s)? {
                    return Ok(stop);
                }
                s *= 0.5;
                continue;
            };
            if self.turned_too_far(&step) && s > 4.0 * least {
                s *= 0.5;
                continue;
            }
            let borders = self.family.overstepped(&step.x)?;
            if borders.is_empty() {
                return self.accept(s, step);
            }
            match self.leap(s)? {
                Leap::Landed(stop) => return Ok(stop),
                Leap::TooFar if s > 4.0 * least => {
                    s *= 0.5;
                    continue;
                }
                _ => {}
            }
            if let Some(stop) = self.cross_first(s, &step, &borders)? {
                return Ok(stop);
            }
            s *= 0.5;
        }
    }

    fn turned_too_far(&self, step: &Step) -> bool {
        let plane = self.plane(&step.x);
        plane.iter().zip(&step.tangent).map(|(c, t)| c * t).sum::<f64>() < 0.85
    }

    /// The present tangent as a condition on unknowns of another chart: charts share the unknowns that have a weight, and `λ`.
    fn plane(&self, x: &[f64]) -> Vec<f64> {
        let (t, weights) = (&self.place.tangent, self.family.weights(x));
        let (shared, last) = (x.len().min(t.len()) - 1, x.len() - 1);
        let mut c = vec![0.0; x.len()];
        (0..shared).for_each(|i| c[i] = weights[i] * t[i]);
        c[last] = weights[last] * Self::lambda(t);
        c
    }

    fn accept(&mut self, s: f64, step: Step) -> Result<Option<Stop>, F::Error> {
        let judgement = self.family.judge(&self.place, &step.x, &step.tangent)?;
        if let Judgement::Astray = judgement {
            return Ok(Some(Stop::Step { lambda: Self::lambda(&self.place.x) }));
        }
        let (low, high) = self.options.range;
        let lambda = Self::lambda(&step.x);
        if lambda < low || lambda > high {
            return self.end(s, &step, if lambda < low { low } else { high });
        }
        let signature = self.family.signature(&step.x)?;
        let stop = match judgement {
            Judgement::Over(borders) => self.between_borders(s, &step, borders)?,
            _ => self.between(s, &step, &signature)?,
        };
        if stop.is_some() {
            return Ok(stop);
        }
        let (_, least, largest) = self.options.step;
        let factor = match step.iterations {
            0..=3 => 1.5,
            4..=5 => 1.0,
            _ => 0.6,
        };
        self.place = Place {
            step: (s * factor).min(largest).max(least),
            chart: self.family.chart(),
            tangent: step.tangent,
            orientation: step.orientation,
            signature,
            x: step.x.clone(),
        };
        Ok(self.hand_out(step.x, None, step.iterations))
    }

    /// The end of the range within a step that leaves it: the point where the branch meets it, and what is special on the way there.
    fn end(&mut self, s: f64, step: &Step, bound: f64) -> Result<Option<Stop>, F::Error> {
        let off = |x: &[f64]| Self::lambda(x) - bound;
        let (here, there) = (off(&self.place.x), off(&step.x));
        // the branch leaves the range, and where it does could not be computed
        let lost = Stop::Step { lambda: Self::lambda(&self.place.x) };
        let mut last = self.place.x.clone();
        if here * there < 0.0 {
            let at = self.root((here, s, there), |_, p| Ok(off(&p.x)))?;
            let Some((s, at)) = at else { return Ok(Some(lost)) };
            let signature = self.family.signature(&at.x)?;
            if let Some(stop) = self.between(s, &at, &signature)? {
                return Ok(Some(stop));
            }
            last = at.x;
        }
        let mut c = vec![0.0; last.len()];
        c[last.len() - 1] = 1.0;
        match correct(self.family, &last, &c, bound)? {
            Some(found) if self.family.overstepped(&found.x)?.is_empty() => {
                self.hand_out(found.x, Some(Special::End), found.iterations);
                Ok(Some(Stop::Range))
            }
            _ => Ok(Some(lost)),
        }
    }
}
