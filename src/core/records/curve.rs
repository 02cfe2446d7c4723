//! Curves of orbits that are singled out, over a number of the scene, as plain data.

/// What is singled out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CurveOf {
    /// Folds of the response.
    Fold,
    /// Period doublings.
    Doubling,
    /// Neimark–Sacker points.
    Torus,
    /// Peaks of the amplitude.
    Peak,
    /// Grazings.
    Grazing,
}

impl CurveOf {
    /// All, in the order in which they are told.
    pub const ALL: [CurveOf; 5] =
        [CurveOf::Fold, CurveOf::Doubling, CurveOf::Torus, CurveOf::Grazing, CurveOf::Peak];

    /// The word of files and commands.
    pub fn word(self) -> &'static str {
        match self {
            CurveOf::Fold => "fold",
            CurveOf::Doubling => "doubling",
            CurveOf::Torus => "torus",
            CurveOf::Peak => "peak",
            CurveOf::Grazing => "grazing",
        }
    }

    /// What a word of a file means.
    pub fn of_word(word: &str) -> Option<CurveOf> {
        CurveOf::ALL.into_iter().find(|of| of.word() == word)
    }
}

/// What a point of a curve is besides a regular one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CurvePointKind {
    /// Nothing special.
    Regular,
    /// Where the curve was begun.
    Start,
    /// An end of the range of the number.
    EndOfRange,
    /// Two folds meet and are no more: frequency and number turn back together.
    Cusp,
    /// The number alone turns back: of folds where an isola begins, or meets another branch.
    Turn,
}

impl CurvePointKind {
    /// The word of files.
    pub fn word(self) -> &'static str {
        match self {
            CurvePointKind::Regular => "",
            CurvePointKind::Start => "start",
            CurvePointKind::EndOfRange => "end of range",
            CurvePointKind::Cusp => "cusp",
            CurvePointKind::Turn => "turn",
        }
    }

    /// What a word of a file means.
    pub fn of_word(word: &str) -> CurvePointKind {
        let all = [Self::Start, Self::EndOfRange, Self::Cusp, Self::Turn];
        all.into_iter().find(|kind| kind.word() == word).unwrap_or(Self::Regular)
    }
}

/// A point of a curve.
#[derive(Debug, Clone, PartialEq)]
pub struct CurvePoint {
    /// Circular frequency.
    pub omega: f64,
    /// The number of the scene.
    pub value: f64,
    /// Angle of the multipliers `e^{±iθ}` at a Neimark–Sacker point.
    pub theta: Option<f64>,
    /// What it is.
    pub kind: CurvePointKind,
    /// Largest contact displacement.
    pub amplitude: f64,
    /// Largest energy.
    pub energy: f64,
    /// Multipliers outside of the unit circle, but for those that single the orbit out; none where they are not known.
    pub outside: Option<usize>,
    /// Nodal displacements at `t = 0`.
    pub u0: Vec<f64>,
    /// Nodal velocities.
    pub v0: Vec<f64>,
}

/// A curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Periods of the loads in one of the orbits.
    pub periods: usize,
    /// Node of the mesh that grazes.
    pub node: Option<usize>,
    /// Its points in their order.
    pub points: Vec<CurvePoint>,
    /// How it ended on both sides, in words; the same where it is closed.
    pub ends: [String; 2],
    /// It comes back to its start.
    pub closed: bool,
}

/// The curves that were found.
#[derive(Debug, Clone, PartialEq)]
pub struct Curves {
    /// What is singled out.
    pub of: CurveOf,
    /// Key of the number in the scene.
    pub key: String,
    /// Its range.
    pub range: [f64; 2],
    /// Range of the frequencies.
    pub frequencies: [f64; 2],
    /// The curves.
    pub all: Vec<Curve>,
    /// Starts from which none was found, in words.
    pub lost: Vec<String>,
}
