//! What lies between two points of a branch: zeros, folds, changes of stability.

use super::{Family, Go, Point, Special, Step, Stop, Walker};

impl<F: Family, T: FnMut(&mut F, Point<F::Chart>) -> Go> Walker<'_, F, T> {
    /// A zero of `value` in `(0, s]`, where it is positive at 0 and negative at `s` (or the other way round): Illinois.
    pub(super) fn root(
        &mut self,
        (mut fa, s, mut fb): (f64, f64, f64),
        mut value: impl FnMut(&mut F, &Step) -> Result<f64, F::Error>,
    ) -> Result<Option<(f64, Step)>, F::Error> {
        let (mut a, mut b) = (0.0, s);
        let mut best = None;
        let mut side = 0;
        for _ in 0..60 {
            let mut c = (a * fb - b * fa) / (fb - fa);
            if !(c > a && c < b) {
                c = 0.5 * (a + b);
            }
            let Some(step) = self.at(c)? else { return Ok(best) };
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
    pub(super) fn bisect(
        &mut self,
        s: f64,
        mut holds: impl FnMut(&mut F, &Step) -> Result<bool, F::Error>,
    ) -> Result<Option<(f64, Step)>, F::Error> {
        let (mut a, mut b) = (0.0, s);
        let mut best = None;
        for _ in 0..12 {
            let c = 0.5 * (a + b);
            let Some(step) = self.at(c)? else { break };
            if holds(self.family, &step)? {
                a = c;
            } else {
                b = c;
            }
            best = Some((c, step));
        }
        Ok(best)
    }

    /// Special points inside a step.
    pub(super) fn between(
        &mut self,
        s: f64,
        step: &Step,
        signature: &[i64],
    ) -> Result<Option<Stop>, F::Error> {
        let lambda_rate = |step: &Step| Self::lambda(&step.tangent);
        let (before, after) = (Self::lambda(&self.place.tangent), lambda_rate(step));
        let mut found = vec![];
        let folds = before * after < 0.0;
        if folds && let Some((s, p)) = self.root((before, s, after), |_, p| Ok(lambda_rate(p)))? {
            found.push((s, p, Special::Fold));
        }
        if step.orientation * self.place.orientation < 0.0 {
            let first = self.place.orientation;
            let at = self.bisect(s, |_, p| Ok(p.orientation == first))?;
            found.extend(at.map(|(s, p)| (s, p, Special::BranchPoint)));
        } else if *signature != self.place.signature {
            let first = self.place.signature.clone();
            let special = Special::Stability(first.clone(), signature.to_vec());
            // at a fold a multiplier passes +1: the same event, told once
            let at = if folds || !self.options.locate {
                None
            } else {
                self.bisect(s, |family, p| Ok(family.signature(&p.x)? == first))?
            };
            match at {
                Some((s, p)) => found.push((s, p, special)),
                None if folds => {}
                None => found.push((
                    s,
                    Step { x: step.x.clone(), tangent: step.tangent.clone(), ..*step },
                    special,
                )),
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, p, special) in found {
            if let Some(stop) = self.hand_out(p.x, Some(special), p.iterations) {
                return Ok(Some(stop));
            }
        }
        Ok(None)
    }
}
