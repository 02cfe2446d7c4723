//! Following one-parameter families `R(X) = 0`, `X = (x, λ) ∈ ℝⁿ⁺¹`, whatever `R` stands for.
//!
//! [`correct`] is Newton's method on `R(X) = 0` beside one linear condition `cᵀX = γ`: `λ` fixed (natural), or the plane at
//! an arclength (pseudo-arclength). [`follow`] walks along a branch: step control, folds, branch points and
//! changes of stability located, and *borders*: where a family is smooth only piece by piece (a sequence of active sets), each piece
//! is a chart; the branch is followed to the border, the chart is changed, and the direction is chosen by testing on which side the
//! new chart is admissible. [`guesses`] serve to solve at given values of `λ` one after the other, as the seed does.

mod arclength;
mod newton;
mod sequence;
#[cfg(test)]
mod tests;

pub use arclength::{Go, Options, Place, Point, Special, Stop, follow};
pub use newton::norm;
pub use newton::{Corrected, correct, tangent};
pub(crate) use newton::{apart, dot};
pub(crate) use newton::{approach, least_singular_value};
pub use sequence::{Guess, guesses};

use faer::Mat;

/// A solution further than this from what the points before it let expect, relative, is a jump to another branch.
pub const JUMP: f64 = 0.25;

/// A chart, and a state in it.
pub type InChart<F> = (<F as Family>::Chart, Vec<f64>);

/// Units of a family: `X` and `R` over them are numbers of the order of one, whatever units the problem was told in.
#[derive(Debug, Clone, PartialEq)]
pub struct Units {
    /// Of every unknown in the present chart, and of `λ`.
    pub unknowns: Vec<f64>,
    /// Of the residual.
    pub residual: f64,
}

/// How a corrected step stands to the branch.
#[derive(Debug, Clone)]
pub enum Judgement<B> {
    /// It follows it.
    Along,
    /// It does, over borders on the way: the points on them, and which they are.
    Over(Vec<(Vec<f64>, B)>),
    /// It does not: it came back the way it came, or landed on another branch.
    Astray,
}

/// A residual with a parameter, piece by piece smooth. A family that is smooth everywhere has one chart and no borders
/// ([`std::convert::Infallible`]): it keeps the defaults of what asks for them.
pub trait Family {
    /// One smooth piece.
    type Chart: Clone + std::fmt::Debug;
    /// Where a piece ends.
    type Border: Clone + std::fmt::Debug + std::fmt::Display;
    /// Why a residual could not be evaluated.
    type Error: std::error::Error;

    /// `R` at `X = (x, λ)`, and its derivative `n × (n + 1)`.
    fn linearise(&mut self, x: &[f64]) -> Result<(Vec<f64>, Mat<f64>), Self::Error>;
    /// `R` alone.
    fn residual(&mut self, x: &[f64]) -> Result<Vec<f64>, Self::Error> {
        Ok(self.linearise(x)?.0)
    }
    /// What unknowns and residuals are measured in.
    fn units(&self) -> Units;
    /// Size of `R` that is rounding error at `X`.
    fn rounding(&self, x: &[f64]) -> f64;
    /// Weights `w` of the arclength `Σ wᵢ δXᵢ²`.
    fn weights(&self, x: &[f64]) -> Vec<f64>;
    /// The present chart.
    fn chart(&self) -> Self::Chart;
    /// Go to a chart.
    fn set_chart(&mut self, chart: &Self::Chart);
    /// The borders that a solution has overstepped; none: it is admissible.
    fn overstepped(&mut self, _x: &[f64]) -> Result<Vec<Self::Border>, Self::Error> {
        Ok(vec![])
    }
    /// Distance to a border: positive inside, zero on it.
    fn margin(&mut self, _x: &[f64], _border: &Self::Border) -> Result<f64, Self::Error> {
        Ok(f64::INFINITY)
    }
    /// The chart behind a border, and the point there; none if nothing is known behind it.
    fn beyond(&mut self, _x: &[f64], _border: &Self::Border) -> Option<InChart<Self>> {
        None
    }
    /// Where the map behind the charts is differentiable across their borders (an acceleration that is continuous at switches), a branch needs
    /// not stop at them: the chart in which a state lies, and the state in it. None: borders are to be located and crossed.
    fn reread(&mut self, _x: &[f64]) -> Result<Option<InChart<Self>>, Self::Error> {
        Ok(None)
    }
    /// How a step that was corrected to `x`, with a tangent there, follows the branch. Newton's method on a map with corners leaps over them; its family can tell.
    fn judge(
        &mut self,
        _from: &Place<Self::Chart>,
        _x: &[f64],
        _tangent: &[f64],
    ) -> Result<Judgement<Self::Border>, Self::Error> {
        Ok(Judgement::Along)
    }
    /// The second derivative of the branch by arclength at a point where the next step begins, if it is known: steps are then predicted along a parabola.
    fn bend(&self, _x: &[f64]) -> Option<&[f64]> {
        None
    }
    /// Numbers that stay the same between bifurcations: of real multipliers above one, of real ones below minus one, of
    /// complex ones outside the unit circle. Empty where stability is not asked for.
    fn signature(&mut self, _x: &[f64]) -> Result<Vec<i64>, Self::Error> {
        Ok(vec![])
    }
}
