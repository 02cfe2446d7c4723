//! Over the borders of charts: located and crossed, or leapt over where the branch does not feel them.

use super::{
    Family, Go, Leap, Place, PointOf, Special, Step, Stop, Walker, correct, tangent, tangent_of,
};

/// A leap of so many least steps is not made shorter any more.
const SHORT: f64 = 64.0;

/// What lies before a border is looked at up to this part of the way to it: on it a multiplier may be infinite.
const BEFORE: f64 = 0.999;

impl<F: Family, T: FnMut(&mut F, PointOf<F>) -> Go> Walker<'_, F, T> {
    /// A step over borders that the branch does not feel: the prediction's own chart, read anew, and the solution in it.
    pub(super) fn leap(&mut self, s: f64) -> Result<Leap, F::Error> {
        let Place { x, tangent: t, .. } = &self.place;
        let predicted: Vec<f64> = x.iter().zip(t).map(|(x, t)| x + s * t).collect();
        let Some((chart, x)) = self.family.reread(&predicted)? else {
            return Ok(Leap::NotOffered);
        };
        let old = self.family.chart();
        self.family.set_chart(&chart);
        let Some(step) = self.landing(s, &x)? else {
            self.family.set_chart(&old);
            return Ok(Leap::TooFar);
        };
        // nothing is located across charts: a fold in a leap is for a shorter one
        let turns = Self::lambda(&step.tangent) * Self::lambda(&self.place.tangent) < 0.0;
        if turns && s > SHORT * self.options.step.1 {
            self.family.set_chart(&old);
            return Ok(Leap::TooFar);
        }
        let signature = self.family.signature(&step.x)?;
        let before = &self.place.signature;
        let special = if turns {
            Some(Special::Fold)
        } else if signature != *before {
            Some(Special::Stability(before.clone(), signature.clone()))
        } else {
            None
        };
        let Step { x, tangent, orientation, iterations } = step;
        if let Some(special) = special
            && let Some(stop) = self.hand_out(x.clone(), Some(special), iterations)
        {
            return Ok(Leap::Landed(Some(stop)));
        }
        self.place = Place { x: x.clone(), tangent, step: s, chart, orientation, signature };
        Ok(Leap::Landed(self.hand_out(x, None, iterations)))
    }

    /// The solution near `x` in its own chart, if it is admissible there, on the branch, and in the range.
    pub(super) fn landing(&mut self, s: f64, x: &[f64]) -> Result<Option<Step>, F::Error> {
        let mut c = self.plane(x);
        if self.options.natural {
            c.fill(0.0);
            c[x.len() - 1] = 1.0;
        }
        let gamma = c.iter().zip(x).map(|(c, x)| c * x).sum();
        let Some(found) = correct(self.family, x, &c, gamma)? else { return Ok(None) };
        let weights = self.family.weights(x);
        let off: f64 =
            found.x.iter().zip(x).zip(&weights).map(|((a, b), w)| w * (a - b).powi(2)).sum();
        let (low, high) = self.options.range;
        let inside = (low..=high).contains(&Self::lambda(&found.x));
        if off.sqrt() > 2.0 * s.abs() || !inside || !self.family.overstepped(&found.x)?.is_empty() {
            return Ok(None);
        }
        let along = self.plane(&found.x);
        let Some((tangent, orientation)) =
            tangent_of(self.family, &found.x, &found.jacobian, &along)
        else {
            return Ok(None);
        };
        let step = Step { x: found.x, tangent, orientation, iterations: found.iterations };
        Ok((!self.turned_too_far(&step)).then_some(step))
    }

    /// Go to the first border within the step and over it. The outer option: whether a border was found.
    #[allow(clippy::type_complexity)]
    pub(super) fn cross_first(
        &mut self,
        s: f64,
        step: &Step,
        borders: &[F::Border],
    ) -> Result<Option<Option<Stop>>, F::Error> {
        let mut first: Option<(f64, Step, F::Border)> = None;
        for border in borders {
            let (here, there) =
                (self.family.margin(&self.place.x, border)?, self.family.margin(&step.x, border)?);
            if !(here > 0.0 && there < 0.0) {
                continue;
            }
            let at = self.root((here, s, there), |family, p| family.margin(&p.x, border))?;
            if let Some((s, p)) = at
                && first.as_ref().is_none_or(|(least, ..)| s < *least)
            {
                first = Some((s, p, border.clone()));
            }
        }
        let Some((s, at, border)) = first else { return Ok(None) };
        if let Some(before) = self.at(BEFORE * s)?
            && self.family.overstepped(&before.x)?.is_empty()
        {
            let signature = self.family.signature(&before.x)?;
            if let Some(stop) = self.between(BEFORE * s, &before, &signature)? {
                return Ok(Some(Some(stop)));
            }
        }
        let lambda = Self::lambda(&at.x);
        let dead = Stop::DeadEnd { lambda, border: border.to_string() };
        let Some((chart, x)) = self.family.beyond(&at.x, &border) else {
            return Ok(Some(Some(dead)));
        };
        let old_chart = self.family.chart();
        self.family.set_chart(&chart);
        let Some(place) = self.departure(chart, x, &at)? else {
            self.family.set_chart(&old_chart);
            return Ok(Some(Some(dead)));
        };
        self.place = place;
        let x = self.place.x.clone();
        let turns = Self::lambda(&self.place.tangent) * Self::lambda(&at.tangent) < 0.0;
        Ok(Some(self.hand_out(x, Some(Special::Border { border, turns }), at.iterations)))
    }

    /// The direction in which a new chart is admissible, tested with small steps to both sides.
    pub(super) fn departure(
        &mut self,
        chart: F::Chart,
        x: Vec<f64>,
        at: &Step,
    ) -> Result<Option<Place<F::Chart>>, F::Error> {
        let (_, least, largest) = self.options.step;
        let mut c = vec![0.0; x.len()];
        // a condition that is not orthogonal to the branch: its direction in the old chart, as far as both charts share unknowns
        let shared = x.len().min(at.x.len()) - 1;
        let weights = self.family.weights(&x);
        for i in 0..shared {
            c[i] = weights[i] * at.tangent[i];
        }
        c[x.len() - 1] = weights[x.len() - 1] * Self::lambda(&at.tangent);
        let Some((t, orientation)) = tangent(self.family, &x, &c)? else { return Ok(None) };
        let present = std::mem::replace(
            &mut self.place,
            Place { x, tangent: t, step: least, chart, orientation, signature: vec![] },
        );
        for scale in [1e-3, 1e-2, 1e-1, 1e-4, 3e-6] {
            let s = (scale * largest).max(least);
            for sign in [1.0, -1.0] {
                let Some(trial) = self.at(sign * s)? else { continue };
                if !self.family.overstepped(&trial.x)?.is_empty() {
                    continue;
                }
                self.place.tangent.iter_mut().for_each(|t| *t *= sign);
                // on the border itself stability is that of the new side
                self.place.signature = self.family.signature(&trial.x)?;
                self.place.orientation = self.at(s)?.map_or(orientation, |p| p.orientation);
                self.place.step = present.step.min(0.25 * largest).max(s);
                return Ok(Some(self.place.clone()));
            }
        }
        self.place = present;
        Ok(None)
    }
}
