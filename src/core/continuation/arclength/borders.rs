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

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use faer::Mat;

    use super::*;
    use crate::continuation::{InChart, Options, Units, follow};

    /// A border of a piece: its margin, and the piece behind it, if any.
    type Edge = (fn(f64, f64) -> f64, Option<usize>);

    /// `R(x, λ) = 0` between borders. A piece may have another unknown, `y = 2x`, that the others do not know.
    #[derive(Clone)]
    struct Piece {
        residual: fn(f64, f64) -> f64,
        derivative: fn(f64, f64) -> [f64; 2],
        edges: Vec<Edge>,
        has_another: bool,
    }

    struct Pieces {
        all: Vec<Piece>,
        chart: usize,
        signature: fn(f64, f64) -> Vec<i64>,
        /// Which piece a point lies in, where that is told.
        reread: Option<fn(f64, f64) -> usize>,
    }

    fn piece(
        residual: fn(f64, f64) -> f64,
        derivative: fn(f64, f64) -> [f64; 2],
        edges: &[Edge],
    ) -> Piece {
        Piece { residual, derivative, edges: edges.to_vec(), has_another: false }
    }

    /// `x = λ` before zero.
    fn rising(to: Option<usize>) -> Piece {
        piece(|x, l| x - l, |_, _| [1.0, -1.0], &[(|x, _| -x, to)])
    }

    impl Pieces {
        fn new(all: Vec<Piece>) -> Pieces {
            Pieces { all, chart: 0, signature: |_, _| vec![], reread: None }
        }

        fn piece(&self) -> &Piece {
            &self.all[self.chart]
        }

        fn numbers(x: &[f64]) -> (f64, f64) {
            (x[0], x[x.len() - 1])
        }

        fn state(&self, chart: usize, (x, lambda): (f64, f64)) -> Vec<f64> {
            if self.all[chart].has_another { vec![x, 2.0 * x, lambda] } else { vec![x, lambda] }
        }
    }

    impl Family for Pieces {
        type Chart = usize;
        type Border = usize;
        type Error = Infallible;

        fn linearise(&mut self, x: &[f64]) -> Result<(Vec<f64>, Mat<f64>), Infallible> {
            let ((y, lambda), n) = (Pieces::numbers(x), x.len());
            let piece = self.piece();
            let (r, [dx, dl]) = ((piece.residual)(y, lambda), (piece.derivative)(y, lambda));
            if n == 2 {
                return Ok((vec![r], Mat::from_fn(1, 2, |_, j| [dx, dl][j])));
            }
            let rows = [[dx, 0.0, dl], [-2.0, 1.0, 0.0]];
            Ok((vec![r, x[1] - 2.0 * y], Mat::from_fn(2, 3, |i, j| rows[i][j])))
        }

        fn units(&self) -> Units {
            let n = if self.piece().has_another { 3 } else { 2 };
            Units { unknowns: vec![1.0; n], residual: 1.0 }
        }

        fn rounding(&self, _: &[f64]) -> f64 {
            1e-14
        }

        fn weights(&self, x: &[f64]) -> Vec<f64> {
            if x.len() == 3 { vec![1.0, 0.0, 1.0] } else { vec![1.0, 1.0] }
        }

        fn chart(&self) -> usize {
            self.chart
        }

        fn set_chart(&mut self, chart: &usize) {
            self.chart = *chart;
        }

        fn overstepped(&mut self, x: &[f64]) -> Result<Vec<usize>, Infallible> {
            let (y, lambda) = Pieces::numbers(x);
            let edges = self.piece().edges.iter().enumerate();
            Ok(edges.filter(|(_, e)| (e.0)(y, lambda) < -1e-12).map(|(k, _)| k).collect())
        }

        fn margin(&mut self, x: &[f64], border: &usize) -> Result<f64, Infallible> {
            let (y, lambda) = Pieces::numbers(x);
            Ok((self.piece().edges[*border].0)(y, lambda))
        }

        fn beyond(&mut self, x: &[f64], border: &usize) -> Option<InChart<Self>> {
            let to = self.piece().edges[*border].1?;
            Some((to, self.state(to, Pieces::numbers(x))))
        }

        fn reread(&mut self, x: &[f64]) -> Result<Option<InChart<Self>>, Infallible> {
            let (y, lambda) = Pieces::numbers(x);
            Ok(self.reread.map(|of| (of(y, lambda), self.state(of(y, lambda), (y, lambda)))))
        }

        fn signature(&mut self, x: &[f64]) -> Result<Vec<i64>, Infallible> {
            let (y, lambda) = Pieces::numbers(x);
            Ok((self.signature)(y, lambda))
        }
    }

    type Told = (Option<Special<usize>>, usize, f64, f64);

    /// All points of the branch that begins in the first piece: what they are, the piece they stand in, `x`, `λ`.
    fn walk(
        pieces: &mut Pieces,
        from: (f64, f64),
        step: f64,
        range: (f64, f64),
    ) -> (Vec<Told>, Stop) {
        let options =
            Options { range, step: (step, 1e-9, step), points: 60, locate: true, natural: false };
        let x = pieces.state(0, from);
        let place = Place::start(pieces, x, 1.0, step).unwrap().unwrap();
        let mut told = vec![];
        let stop = follow(pieces, place, &options, |pieces, p| {
            let (x, lambda) = Pieces::numbers(&p.x);
            told.push((p.special, pieces.chart, x, lambda));
            Go::Continue(())
        });
        (told, stop.unwrap())
    }

    fn borders(told: &[Told]) -> Vec<(usize, bool, f64, f64)> {
        let of = |(special, chart, x, lambda): &Told| match special {
            Some(Special::Border { turns, .. }) => Some((*chart, *turns, *x, *lambda)),
            _ => None,
        };
        told.iter().filter_map(of).collect()
    }

    /// What stands in a piece lies on its curve and within its borders.
    fn belong(pieces: &Pieces, told: &[Told]) {
        for (_, chart, x, lambda) in told {
            let piece = &pieces.all[*chart];
            assert!((piece.residual)(*x, *lambda).abs() < 1e-12, "{told:?}");
            assert!(piece.edges.iter().all(|e| (e.0)(*x, *lambda) > -1e-11), "{told:?}");
        }
    }

    #[test]
    fn a_corner_is_met_and_the_branch_goes_on_behind_it() {
        for has_another in [false, true] {
            let flat = piece(|x, l| x - 0.5 * l, |_, _| [1.0, -0.5], &[(|x, _| x, Some(0))]);
            let flat = Piece { has_another, ..flat };
            let mut pieces = Pieces::new(vec![rising(Some(1)), flat]);
            let (told, stop) = walk(&mut pieces, (-1.0, -1.0), 0.3, (-2.0, 1.0));
            assert_eq!(stop, Stop::Range);
            belong(&pieces, &told);
            let met = borders(&told);
            assert_eq!(met.len(), 1, "{told:?}");
            let (chart, turns, x, lambda) = met[0];
            assert!(chart == 1 && !turns && x.abs() < 1e-9 && lambda.abs() < 1e-9, "{met:?}");
            assert_eq!(told.last().map(|p| (p.1, p.3)), Some((1, 1.0)));
            // the steps behind it are as long as those before
            assert!(told.len() < 24, "{}", told.len());
        }
    }

    #[test]
    fn a_branch_turns_at_a_corner_where_its_next_piece_lies_that_way() {
        let back = piece(|x, l| x + 2.0 * l, |_, _| [1.0, 2.0], &[(|x, _| x, Some(0))]);
        let mut pieces = Pieces::new(vec![rising(Some(1)), back]);
        let (told, stop) = walk(&mut pieces, (-1.0, -1.0), 0.3, (-2.0, 1.0));
        assert_eq!(stop, Stop::Range);
        belong(&pieces, &told);
        let met = borders(&told);
        assert!(met.len() == 1 && met[0].0 == 1 && met[0].1, "{told:?}");
        assert_eq!(told.last().map(|p| (p.1, p.3)), Some((1, -2.0)));
    }

    /// A next piece that is admissible on neither side, and one that nobody knows.
    #[test]
    fn where_nothing_is_admissible_behind_a_border_the_branch_ends() {
        let never: Edge = (|_, _| -1.0, None);
        let nowhere = piece(|x, l| x - l, |_, _| [1.0, -1.0], &[never]);
        for (to, next) in [(Some(1), vec![nowhere]), (None, vec![])] {
            let mut pieces = Pieces::new([vec![rising(to)], next].concat());
            let (told, stop) = walk(&mut pieces, (-1.0, -1.0), 0.3, (-2.0, 1.0));
            let Stop::DeadEnd { lambda, border } = stop else { panic!("{stop:?}") };
            assert!(lambda.abs() < 1e-9 && border == "0", "{lambda} {border}");
            assert!(told.iter().all(|p| p.1 == 0) && borders(&told).is_empty());
            assert_eq!(pieces.chart, 0);
        }
    }

    /// A piece so short that a step leaps over it; of two borders that a step oversteps the nearer comes first.
    #[test]
    fn borders_of_one_step_are_met_in_their_order() {
        let short = piece(
            |x, l| x - 3.0 * l,
            |_, _| [1.0, -3.0],
            &[(|x, _| x, Some(0)), (|x, _| 0.01 - x, Some(2))],
        );
        let last = piece(
            |x, l| x - 0.01 - (l - 0.01 / 3.0),
            |_, _| [1.0, -1.0],
            &[(|x, _| x - 0.01, Some(1))],
        );
        // the first piece has a border that lies further off, too
        let mut first = rising(Some(1));
        first.edges.insert(0, (|x, _| 0.1 - x, None));
        let mut pieces = Pieces::new(vec![first, short, last]);
        let (told, stop) = walk(&mut pieces, (-1.0, -1.0), 0.4, (-2.0, 1.0));
        assert_eq!(stop, Stop::Range);
        belong(&pieces, &told);
        let met = borders(&told);
        let wanted = [(1, 0.0, 0.0), (2, 0.01, 0.01 / 3.0)];
        assert_eq!(met.len(), 2, "{told:?}");
        for (met, wanted) in met.iter().zip(wanted) {
            let near = (met.2 - wanted.1).abs() < 1e-8 && (met.3 - wanted.2).abs() < 1e-8;
            assert!(met.0 == wanted.0 && near, "{met:?}");
        }
    }

    /// Folds and changes of stability on the way to a border come before it, with the piece that they stand in.
    #[test]
    fn what_lies_before_a_border_in_the_same_step_is_told_first() {
        let flat = piece(|x, l| x - 0.5 * l, |_, _| [1.0, -0.5], &[(|x, _| x, Some(0))]);
        let mut pieces = Pieces::new(vec![rising(Some(1)), flat.clone()]);
        pieces.signature = |x, _| vec![0, i64::from(x > -0.02), 0];
        let (told, _) = walk(&mut pieces, (-0.9, -0.9), 0.3, (-2.0, 1.0));
        let special: Vec<_> = told.iter().filter_map(|t| Some((t.0.clone()?, t.1, t.2))).collect();
        let changed = Special::Stability(vec![0, 0, 0], vec![0, 1, 0]);
        assert!(special[0].0 == changed && special[0].1 == 0, "{special:?}");
        assert!((special[0].2 + 0.02).abs() < 1e-3, "{special:?}");
        assert!(matches!(special[1].0, Special::Border { .. }) && special.len() == 3);

        // λ = −x² / 2 + … turns at x = −0.05, before the border
        let bent = piece(
            |x, l| l + 4.0 * (x + 0.05).powi(2),
            |x, _| [8.0 * (x + 0.05), 1.0],
            &[(|x, _| -x, Some(1))],
        );
        let on = piece(|x, l| l + 0.01 + x, |_, _| [1.0, 1.0], &[(|x, _| x, Some(0))]);
        let mut pieces = Pieces::new(vec![bent, on]);
        let (told, stop) = walk(&mut pieces, (-0.6, -1.21), 0.3, (-2.0, 1.0));
        assert_eq!(stop, Stop::Range);
        belong(&pieces, &told);
        let special: Vec<_> = told.iter().filter_map(|t| Some((t.0.clone()?, t.2))).collect();
        assert!(special[0].0 == Special::Fold && (special[0].1 + 0.05).abs() < 1e-6);
        assert!(matches!(special[1].0, Special::Border { turns: false, .. }), "{special:?}");
    }

    /// Where the branch does not feel its borders it steps over them, into the piece where it lands; folds on the way are not lost, nor is the end of the range.
    #[test]
    fn borders_that_are_not_felt_are_leapt_over() {
        let flat = piece(|x, l| x - 0.9 * l, |_, _| [1.0, -0.9], &[(|x, _| x, Some(0))]);
        let mut pieces = Pieces::new(vec![rising(Some(1)), flat]);
        pieces.reread = Some(|x, _| usize::from(x > 0.0));
        let (told, stop) = walk(&mut pieces, (-1.0, -1.0), 0.3, (-2.0, 1.0));
        assert_eq!(stop, Stop::Range);
        belong(&pieces, &told);
        assert!(borders(&told).is_empty() && told.len() < 14, "{told:?}");
        assert!(told.iter().filter(|t| t.1 == 1).count() > 3);
        assert!(told.iter().all(|t| (t.1 == 1) == (t.2 > 0.0)));

        // a signature that changes in the leap is told where it landed
        pieces.signature = |x, _| vec![0, i64::from(x > 0.0), 0];
        pieces.chart = 0;
        let (told, _) = walk(&mut pieces, (-1.0, -1.0), 0.3, (-2.0, 1.0));
        let special: Vec<_> = told.iter().filter_map(|t| t.0.clone()).collect();
        assert_eq!(special, [Special::Stability(vec![0, 0, 0], vec![0, 1, 0]), Special::End]);

        // a circle in two halves: its fold lies on the border
        let half =
            |edge: Edge| piece(|x, l| x * x + l * l - 1.0, |x, l| [2.0 * x, 2.0 * l], &[edge]);
        let halves = [half((|x, _| -x, Some(1))), half((|x, _| x, Some(0)))];
        let mut pieces = Pieces::new(halves.to_vec());
        pieces.reread = Some(|x, _| usize::from(x > 0.0));
        let (told, stop) = walk(&mut pieces, (-1.0, 0.0), 0.3, (-0.5, 2.0));
        assert_eq!(stop, Stop::Range);
        belong(&pieces, &told);
        let folds: Vec<_> = told.iter().filter(|t| t.0 == Some(Special::Fold)).collect();
        assert!(folds.len() == 1 && folds[0].2.abs() < 1e-4, "{folds:?}");
        assert!(told.last().unwrap().1 == 1);
    }
}
