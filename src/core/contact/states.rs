//! What each contact point is doing. The points that touch are the active set.

use std::fmt;

use serde::{Deserialize, Serialize};

/// What one contact point is doing; the words of files, letters of print and numbers of tables are made here.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum PointState {
    /// It is free: `p = 0`, gap `w ≥ 0`.
    Open = 0,
    /// It touches: `w = 0`, pressure `p ≥ 0`.
    Closed = 1,
    /// It touches, and friction holds it: `v_t = V`, `|r_t| ≤ μ r_n`.
    Stick = 2,
    /// It touches and slips forwards: `v_t > V`, `r_t = μ r_n`.
    SlipPlus = 3,
    /// It touches and slips backwards: `v_t < V`, `r_t = −μ r_n`.
    SlipMinus = 4,
}

impl PointState {
    /// All states in the order of their numbers.
    pub const ALL: [PointState; 5] = [
        PointState::Open,
        PointState::Closed,
        PointState::Stick,
        PointState::SlipPlus,
        PointState::SlipMinus,
    ];

    /// Closed if the point touches.
    pub fn of_contact(touches: bool) -> Self {
        if touches { PointState::Closed } else { PointState::Open }
    }

    /// The slip of a sign.
    pub fn of_slip(sign: f64) -> Self {
        if sign > 0.0 { PointState::SlipPlus } else { PointState::SlipMinus }
    }

    /// `σ = ±1` of a point that slips.
    pub fn slip(self) -> Option<f64> {
        match self {
            PointState::SlipPlus => Some(1.0),
            PointState::SlipMinus => Some(-1.0),
            _ => None,
        }
    }

    /// Whether a point in this state is in contact.
    pub fn touches(self) -> bool {
        self != PointState::Open
    }

    /// Number in tables.
    pub fn code(self) -> u8 {
        self as u8
    }

    /// The state of a number, if it is one of a state.
    pub(crate) fn of_code(code: u8) -> Option<Self> {
        Self::ALL.get(usize::from(code)).copied()
    }

    /// Word in files.
    pub fn word(self) -> &'static str {
        match self {
            PointState::Open => "open",
            PointState::Closed => "closed",
            PointState::Stick => "stick",
            PointState::SlipPlus => "slip+",
            PointState::SlipMinus => "slip-",
        }
    }

    /// Letter in print.
    pub fn letter(self) -> char {
        match self {
            PointState::Open => '.',
            PointState::Closed => '|',
            PointState::Stick => 'S',
            PointState::SlipPlus => '+',
            PointState::SlipMinus => '-',
        }
    }

    /// The state of a letter, if it is one of a state.
    pub(crate) fn of_letter(letter: char) -> Option<Self> {
        Self::ALL.into_iter().find(|s| s.letter() == letter)
    }
}

/// The states of all contact points: of a phase, of an instant.
#[derive(Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(into = "String", try_from = "Written")]
pub struct States(Box<[PointState]>);

impl States {
    /// No point touches.
    pub fn open(points: usize) -> Self {
        States(vec![PointState::Open; points].into())
    }

    /// Every point touches.
    pub fn closed(points: usize) -> Self {
        States(vec![PointState::Closed; points].into())
    }

    /// From flags, one a point: does it touch?
    pub fn of_contact(touches: impl IntoIterator<Item = bool>) -> Self {
        touches.into_iter().map(PointState::of_contact).collect()
    }

    /// From numbers of a table; a number of no state touches, as in files of programs before there were states.
    pub fn of_codes(codes: impl IntoIterator<Item = u8>) -> Self {
        codes.into_iter().map(|c| PointState::of_code(c).unwrap_or(PointState::Closed)).collect()
    }

    /// Numbers for a table.
    pub fn codes(&self) -> impl Iterator<Item = u8> {
        self.0.iter().map(|s| s.code())
    }

    /// Number of contact points.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there are no contact points.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The states in the order of the points.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = PointState> + ExactSizeIterator {
        self.0.iter().copied()
    }

    /// State of point `i`.
    pub fn at(&self, i: usize) -> PointState {
        self.0[i]
    }

    /// Whether point `i` is in contact.
    pub fn touches(&self, i: usize) -> bool {
        self.0[i].touches()
    }

    /// Set point `i`.
    pub fn set(&mut self, i: usize, state: PointState) {
        self.0[i] = state;
    }

    /// The same states but for point `i`.
    pub fn with(&self, i: usize, state: PointState) -> Self {
        let mut states = self.clone();
        states.set(i, state);
        states
    }

    /// The points whose state differs: point, state here, state there.
    pub fn changes<'a>(
        &'a self,
        after: &'a States,
    ) -> impl Iterator<Item = (usize, PointState, PointState)> + 'a {
        let pairs = self.iter().zip(after.iter()).enumerate();
        pairs.filter(|(_, (from, to))| from != to).map(|(i, (from, to))| (i, from, to))
    }

    /// Points in contact: the active set.
    pub(crate) fn closed_points(&self) -> Vec<usize> {
        (0..self.len()).filter(|&i| self.touches(i)).collect()
    }

    /// Number of points in contact.
    pub fn count_closed(&self) -> usize {
        self.iter().filter(|s| s.touches()).count()
    }

    /// One flag a point: is it in contact?
    pub fn flags(&self) -> Vec<bool> {
        self.iter().map(PointState::touches).collect()
    }
}

impl FromIterator<PointState> for States {
    fn from_iter<I: IntoIterator<Item = PointState>>(states: I) -> Self {
        States(states.into_iter().collect())
    }
}

/// One letter a point, as in `..|.`.
impl fmt::Display for States {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        use fmt::Write;
        self.iter().try_for_each(|s| f.write_char(s.letter()))
    }
}

impl fmt::Debug for States {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl From<States> for String {
    fn from(states: States) -> String {
        states.to_string()
    }
}

/// States as text files hold them: letters, or flags in files of earlier versions.
#[derive(Deserialize)]
#[serde(untagged)]
enum Written {
    Letters(String),
    Flags(Vec<bool>),
}

impl TryFrom<Written> for States {
    type Error = String;

    fn try_from(written: Written) -> Result<States, String> {
        let of_letter =
            |c| PointState::of_letter(c).ok_or_else(|| format!("{c} is no state of a point"));
        match written {
            Written::Letters(letters) => letters.chars().map(of_letter).collect(),
            Written::Flags(flags) => Ok(States::of_contact(flags)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_and_numbers_are_read_back() {
        for state in PointState::ALL {
            assert_eq!(PointState::of_letter(state.letter()), Some(state));
            assert_eq!(PointState::of_code(state.code()), Some(state));
        }
        let states = States::of_contact([false, true, true, false]);
        assert_eq!(states.to_string(), ".||.");
        assert_eq!(States::of_codes(states.codes()), states);
        let text = serde_json::to_string(&states).unwrap();
        assert_eq!(serde_json::from_str::<States>(&text).unwrap(), states);
        assert_eq!(serde_json::from_str::<States>("[false,true,true,false]").unwrap(), states);
        assert!(serde_json::from_str::<States>("\".x\"").is_err());
    }

    #[test]
    fn changes_are_told_with_both_states() {
        let (a, b) =
            (States::of_contact([false, true, true]), States::of_contact([true, true, false]));
        let (open, closed) = (PointState::Open, PointState::Closed);
        let all: Vec<_> = a.changes(&b).collect();
        assert_eq!(all, [(0, open, closed), (2, closed, open)]);
        assert_eq!(a.with(0, closed).with(2, open), b);
        assert_eq!(a.closed_points(), [1, 2]);
    }
}
