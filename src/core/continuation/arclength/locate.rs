//! What lies between two points of a branch: zeros, folds, branch points, changes of stability.

use super::{Family, Go, Special, Step, Stop, Walker};

/// Changes of stability are located to this part of a step.
const LOCATED: f64 = 1.0 / 4096.0;

/// Where a branch folds its direction is that of no `λ`; a share of what it is at the ends of the step that is more than this is that of a corner.
const SHARP: f64 = 1e-2;

/// A fold this near to a border, relative, is the same point.
const SAME: f64 = 1e-6;

/// A special point inside a step: its arclength, the point.
type Found<B> = (f64, Step, Special<B>);

/// A point of a step with its signature.
type Signed = (f64, Vec<i64>);

/// Whether a multiplier that passes +1 is all that happened: what belongs to a fold and to a branch point.
fn is_one_multiplier(before: &[i64], after: &[i64]) -> bool {
    let changes = before.iter().zip(after).map(|(a, b)| (a - b).abs());
    before.len() == after.len() && changes.enumerate().all(|(k, d)| d <= i64::from(k == 0))
}

impl<F: Family, T: FnMut(&mut F, super::PointOf<F>) -> Go> Walker<'_, F, T> {
    /// A zero of `value` in `(0, s]`, where it is positive at 0 and negative at `s` (or the other way round): Illinois. None where a point of the branch
    /// on the way could not be computed.
    pub(super) fn root(
        &mut self,
        (fa, s, fb): (f64, f64, f64),
        value: impl FnMut(&mut F, &Step) -> Result<f64, F::Error>,
    ) -> Result<Option<(f64, Step)>, F::Error> {
        self.root_in((0.0, fa), (s, fb), value)
    }

    /// The same in `(a, b]`.
    fn root_in(
        &mut self,
        (mut a, mut fa): (f64, f64),
        (mut b, mut fb): (f64, f64),
        mut value: impl FnMut(&mut F, &Step) -> Result<f64, F::Error>,
    ) -> Result<Option<(f64, Step)>, F::Error> {
        let s = b;
        let mut best = None;
        let mut side = 0;
        for _ in 0..60 {
            let mut c = (a * fb - b * fa) / (fb - fa);
            if !(c > a && c < b) {
                c = 0.5 * (a + b);
            }
            let Some(step) = self.at(c)? else { return Ok(None) };
            let f = value(self.family, &step)?;
            best = Some((c, step));
            if f == 0.0 || (b - a) <= 1e-13 * s {
                break;
            }
            if (f > 0.0) == (fa > 0.0) {
                if (c - a).abs() <= 1e-12 * s && side == 1 {
                    break;
                }
                (a, fa) = (c, f);
                if side == 1 {
                    fb *= 0.5;
                }
                side = 1;
            } else {
                if (b - c).abs() <= 1e-12 * s && side == -1 {
                    break;
                }
                (b, fb) = (c, f);
                if side == -1 {
                    fa *= 0.5;
                }
                side = -1;
            }
        }
        Ok(best)
    }

    /// The last point of `(0, s)` at which `holds`, to a four-thousandth of the step.
    fn bisect(
        &mut self,
        s: f64,
        mut holds: impl FnMut(&Step) -> bool,
    ) -> Result<Option<(f64, Step)>, F::Error> {
        let (mut a, mut b) = (0.0, s);
        let mut best = None;
        while b - a > LOCATED * s {
            let c = 0.5 * (a + b);
            let Some(step) = self.at(c)? else { break };
            if holds(&step) {
                a = c;
            } else {
                b = c;
            }
            best = Some((c, step));
        }
        Ok(best)
    }

    /// Special points inside a step to `step` at arclength `s`, handed out in their order.
    pub(super) fn between(
        &mut self,
        s: f64,
        step: &Step,
        signature: &[i64],
    ) -> Result<Option<Stop>, F::Error> {
        let mut found = self.folds(s, step)?;
        found.extend(self.branch_point(s, step)?);
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        let changes = self.changes(s, step, signature, &found)?;
        found.extend(changes);
        Ok(self.hand_out_in_order(found))
    }

    /// Special points inside a step, handed out in the order of their arclengths.
    fn hand_out_in_order(&mut self, mut found: Vec<Found<F::Border>>) -> Option<Stop> {
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found
            .into_iter()
            .find_map(|(_, p, special)| self.hand_out(p.x, Some(special), p.iterations))
    }

    /// A step over borders, and the folds inside it that are not a border's own: where that does not explain the direction of `λ` behind it, `λ` turns back at the
    /// outermost border.
    pub(super) fn between_borders(
        &mut self,
        s: f64,
        step: &Step,
        borders: Vec<(Vec<f64>, F::Border)>,
    ) -> Result<Option<Stop>, F::Error> {
        let before = Self::lambda(&self.place.tangent);
        let is_own = |lambda: f64| {
            borders.iter().any(|(x, _)| (Self::lambda(x) - lambda).abs() <= SAME * lambda.abs())
        };
        let mut found = self.folds(s, step)?;
        // where the branch turns in this step is at one of the borders, if it is nowhere else
        let is_elsewhere = |(_, p, special): &Found<F::Border>| {
            !matches!(special, Special::Corner { located: false }) && !is_own(Self::lambda(&p.x))
        };
        found.retain(is_elsewhere);
        let is_turned = before * Self::lambda(&step.tangent) < 0.0;
        let is_left = is_turned != (found.len() % 2 == 1);
        let far = |x: &[f64]| before.signum() * Self::lambda(x);
        let outermost = borders.iter().map(|(x, _)| far(x)).fold(f64::NEG_INFINITY, f64::max);
        for (x, border) in borders {
            let turns = is_left && far(&x) == outermost;
            let way: Vec<f64> = x.iter().zip(&self.place.x).map(|(a, b)| a - b).collect();
            let along: f64 = self.plane(&x).iter().zip(&way).map(|(c, d)| c * d).sum();
            found.push((along, Step { x, ..step.clone() }, Special::Border { border, turns }));
        }
        Ok(self.hand_out_in_order(found))
    }

    /// Folds: zeros of `dλ/ds`, or corners at which it jumps over zero. Two of them leave its sign as it was: where the cubic through both ends turns, the branch is
    /// asked.
    fn folds(&mut self, s: f64, step: &Step) -> Result<Vec<Found<F::Border>>, F::Error> {
        let rate = |step: &Step| Self::lambda(&step.tangent);
        let (before, after) = (Self::lambda(&self.place.tangent), rate(step));
        let mut ends = vec![(0.0, before), (s, after)];
        if before * after > 0.0
            && let Some(turn) = turn_of_cubic(before, after, self.rise(step) / s)
            && let Some(inside) = self.at(turn * s)?
            && rate(&inside) * before < 0.0
        {
            ends.insert(1, (turn * s, rate(&inside)));
        }
        let mut found = vec![];
        for pair in ends.windows(2) {
            if pair[0].1 * pair[1].1 >= 0.0 {
                continue;
            }
            let sharp = SHARP * pair[0].1.abs().max(pair[1].1.abs());
            found.push(match self.root_in(pair[0], pair[1], |_, p| Ok(rate(p)))? {
                Some((s, p)) if rate(&p).abs() <= sharp => (s, p, Special::Fold),
                Some((s, p)) => (s, p, Special::Corner { located: true }),
                // what cannot be located lies before the end of its piece all the same
                None => (pair[1].0, step.clone(), Special::Corner { located: false }),
            });
        }
        Ok(found)
    }

    /// How much `λ` grows over a step.
    fn rise(&self, step: &Step) -> f64 {
        Self::lambda(&step.x) - Self::lambda(&self.place.x)
    }

    /// A simple branch point: the determinant changes its sign.
    fn branch_point(&mut self, s: f64, step: &Step) -> Result<Option<Found<F::Border>>, F::Error> {
        let first = self.place.orientation;
        if step.orientation * first >= 0.0 {
            return Ok(None);
        }
        let at = self.bisect(s, |p| p.orientation == first)?;
        let (s, p) = at.unwrap_or_else(|| (s, step.clone()));
        Ok(Some((s, p, Special::BranchPoint)))
    }

    /// Changes of the signature. At a fold and at a branch point a multiplier passes +1: the same event, told once; what else changes in the step is not.
    fn changes(
        &mut self,
        s: f64,
        step: &Step,
        signature: &[i64],
        known: &[Found<F::Border>],
    ) -> Result<Vec<Found<F::Border>>, F::Error> {
        let first = self.place.signature.clone();
        if *signature == first {
            return Ok(vec![]);
        }
        let at_end = |before: &[i64]| {
            vec![(s, step.clone(), Special::Stability(before.to_vec(), signature.to_vec()))]
        };
        if !self.options.locate {
            let told = !known.is_empty() && is_one_multiplier(&first, signature);
            return Ok(if told { vec![] } else { at_end(&first) });
        }
        // pieces between the known points, without what is right beside these
        let mut found = vec![];
        let mut left: Signed = (0.0, first);
        for &(at, ..) in known {
            let aside = LOCATED * s;
            let (Some(before), Some(behind)) =
                (self.signed((at - aside).max(left.0))?, self.signed((at + aside).min(s))?)
            else {
                continue;
            };
            self.locate(&left, &before, s, &mut found)?;
            if !is_one_multiplier(&before.1, &behind.1)
                && let Some(p) = self.at(at)?
            {
                let special = Special::Stability(before.1, behind.1.clone());
                found.push((at, p, special));
            }
            left = behind;
        }
        self.locate(&left, &(s, signature.to_vec()), s, &mut found)?;
        Ok(found)
    }

    /// The signature at arclength `s`.
    fn signed(&mut self, s: f64) -> Result<Option<Signed>, F::Error> {
        if s == 0.0 {
            return Ok(Some((s, self.place.signature.clone())));
        }
        let Some(step) = self.at(s)? else { return Ok(None) };
        Ok(Some((s, self.family.signature(&step.x)?)))
    }

    /// All changes of the signature between two points that differ, by halving.
    fn locate(
        &mut self,
        left: &Signed,
        right: &Signed,
        s: f64,
        found: &mut Vec<Found<F::Border>>,
    ) -> Result<(), F::Error> {
        if left.1 == right.1 {
            return Ok(());
        }
        if right.0 - left.0 > LOCATED * s
            && let Some(middle) = self.signed(0.5 * (left.0 + right.0))?
        {
            self.locate(left, &middle, s, found)?;
            return self.locate(&middle, right, s, found);
        }
        if let Some(p) = self.at(right.0)? {
            found.push((right.0, p, Special::Stability(left.1.clone(), right.1.clone())));
        }
        Ok(())
    }
}

/// Where in `(0, 1)` the derivative of the cubic with end slopes `a`, `b` and mean slope `m` has its least value, over the sign of `a`, if that is on
/// the other side of zero.
fn turn_of_cubic(a: f64, b: f64, m: f64) -> Option<f64> {
    // p′(x) = a + 2 (3m − 2a − b) x + 3 (a + b − 2m) x²
    let (linear, square) = (2.0 * (3.0 * m - 2.0 * a - b), 3.0 * (a + b - 2.0 * m));
    let x = -0.5 * linear / square;
    let value = a + x * (linear + square * x);
    (x > 0.0 && x < 1.0 && value * a < 0.0).then_some(x)
}
