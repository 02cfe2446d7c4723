//! Contact methods, meshes and parameters side by side: one row of numbers for each, and what the rows say together: observed orders of convergence, limits.

use std::collections::BTreeMap;

/// What is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Compared {
    /// The motion of `run` at its end.
    Run,
    /// Conservative or forced orbits at given frequencies.
    Orbit,
    /// Viscous nonlinear modes at given frequencies.
    Viscous,
}

/// A number of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// Circular frequency of an orbit.
    Omega,
    /// Displacements that move by themselves.
    Unknowns,
    /// `‖u − u_ref‖/‖u_ref‖` over the nodes that do not touch, at the end of the run.
    Error,
    /// `‖u_h − u_H‖/‖u_H‖` to the next coarser mesh H, at its nodes that do not touch.
    Difference,
    /// Largest penetration.
    Penetration,
    /// Largest tension.
    Tension,
    /// Largest pressure over that of the reference.
    Overshoot,
    /// `‖F − F_ref‖/‖F_ref‖` of the contact force over time.
    PressureError,
    /// `∫∫ p dA dt`, impulses included.
    Impulse,
    /// What the method adds to the energy, over the energy at the start.
    EnergyChange,
    /// What the integration adds, the same.
    EnergyDrift,
    /// Energy of an orbit.
    Energy,
    /// `E/E_exact − 1`.
    EnergyError,
    /// Feedback of a viscous orbit.
    Alpha,
    /// Time in contact over a period.
    ContactTime,
    /// Largest multiplier in magnitude.
    Multiplier,
    /// Return error.
    Residual,
    /// Newton steps.
    Iterations,
    /// Switches.
    Switches,
    /// Wall time.
    Wall,
}

impl Quantity {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Quantity::Omega => "omega",
            Quantity::Unknowns => "unknowns",
            Quantity::Error => "error",
            Quantity::Difference => "difference",
            Quantity::Penetration => "max_penetration",
            Quantity::Tension => "max_tension",
            Quantity::Overshoot => "overshoot",
            Quantity::PressureError => "pressure_error",
            Quantity::Impulse => "impulse",
            Quantity::EnergyChange => "energy_change",
            Quantity::EnergyDrift => "energy_drift",
            Quantity::Energy => "energy",
            Quantity::EnergyError => "energy_error",
            Quantity::Alpha => "alpha",
            Quantity::ContactTime => "contact_time",
            Quantity::Multiplier => "largest_multiplier",
            Quantity::Residual => "residual",
            Quantity::Iterations => "newton_iterations",
            Quantity::Switches => "switches",
            Quantity::Wall => "wall_s",
        }
    }

    /// Units in files.
    pub fn units(self) -> &'static str {
        match self {
            Quantity::Omega | Quantity::Alpha => "1/time",
            Quantity::Penetration => "length",
            Quantity::Tension => "force per area",
            Quantity::Impulse => "force times time",
            Quantity::Energy => "energy",
            Quantity::ContactTime => "time",
            Quantity::Wall => "s",
            _ => "1",
        }
    }
}

impl Compared {
    /// All kinds.
    pub const ALL: [Compared; 3] = [Compared::Run, Compared::Orbit, Compared::Viscous];

    /// Name in files and JSON.
    pub fn name(self) -> &'static str {
        match self {
            Compared::Run => "run",
            Compared::Orbit => "orbit",
            Compared::Viscous => "viscous",
        }
    }

    /// The numbers of a row, in their order.
    pub(crate) fn quantities(self) -> &'static [Quantity] {
        use Quantity::*;
        match self {
            Compared::Run => &[
                Unknowns,
                Error,
                Difference,
                Penetration,
                Tension,
                Overshoot,
                PressureError,
                Impulse,
                EnergyChange,
                EnergyDrift,
                Switches,
                Wall,
            ],
            Compared::Orbit => &[
                Omega,
                Unknowns,
                Energy,
                EnergyError,
                ContactTime,
                Multiplier,
                Penetration,
                Switches,
                Residual,
                Iterations,
                Wall,
            ],
            Compared::Viscous => &[
                Omega,
                Unknowns,
                Energy,
                Alpha,
                ContactTime,
                Multiplier,
                Penetration,
                Switches,
                Residual,
                Iterations,
                Wall,
            ],
        }
    }

    /// The quantities whose limits under refinement are of interest.
    pub fn limits(self) -> &'static [Quantity] {
        match self {
            Compared::Run => &[Quantity::Impulse],
            Compared::Orbit => &[Quantity::Energy, Quantity::ContactTime],
            Compared::Viscous => &[Quantity::Energy, Quantity::Alpha],
        }
    }
}

/// One method on one mesh with one set of parameters.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Row {
    /// The variant: `nbm:constant`.
    pub variant: String,
    /// The parameters: `contact.gamma = 2`; empty without.
    pub changed: String,
    /// The mesh: `10x3`.
    pub mesh: String,
    /// Size of its elements along the contact normal.
    pub h: f64,
    /// What there is no number for is not in it.
    pub values: BTreeMap<Quantity, f64>,
    /// What is to be said: why there are no numbers, what stands beside them.
    pub note: String,
}

impl Row {
    /// A number; not a number where there is none.
    pub fn get(&self, quantity: Quantity) -> f64 {
        self.values.get(&quantity).copied().unwrap_or(f64::NAN)
    }
}

/// Observed orders of convergence: of each pair or triple of neighbouring meshes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Orders(pub Vec<f64>);

impl Orders {
    /// Mean of those that there are.
    pub fn mean(&self) -> f64 {
        let known: Vec<f64> = self.0.iter().copied().filter(|p| p.is_finite()).collect();
        known.iter().sum::<f64>() / known.len() as f64
    }

    /// Least and largest.
    pub fn spread(&self) -> [f64; 2] {
        let known = || self.0.iter().copied().filter(|p| p.is_finite());
        [known().fold(f64::NAN, f64::min), known().fold(f64::NAN, f64::max)]
    }

    /// Pairs or triples that show none: their differences change sign or grow.
    pub fn missing(&self) -> usize {
        self.0.iter().filter(|p| !p.is_finite()).count()
    }
}

/// A whole comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// What is compared.
    pub compared: Compared,
    /// Title of the scene.
    pub title: String,
    /// What errors refer to, in words; empty if there are none.
    pub reference: String,
    /// Whether the reference is exact, and no finer mesh.
    pub exact: bool,
    /// Program, machine, how times were taken.
    pub footer: String,
    /// The rows.
    pub rows: Vec<Row>,
}

/// Most steps of the search for an order.
const BISECTIONS: usize = 60;
/// Orders that are looked for.
const ORDERS: [f64; 2] = [0.02, 8.0];

/// The order `p` of `f(h) = f_0 + C h^p` through three points of falling `h` (Richardson); none if the differences change sign, or grow.
pub(crate) fn richardson(h: [f64; 3], f: [f64; 3]) -> Option<f64> {
    let ratio = (f[0] - f[1]) / (f[1] - f[2]);
    let of = |p: f64| (h[0].powf(p) - h[1].powf(p)) / (h[1].powf(p) - h[2].powf(p));
    let [mut low, mut high] = ORDERS;
    if !(ratio >= of(low) && ratio <= of(high)) {
        return None;
    }
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if of(middle) < ratio { low = middle } else { high = middle }
    }
    Some(0.5 * (low + high))
}

/// `f_0` of the same.
pub fn limit(h: [f64; 3], f: [f64; 3]) -> Option<f64> {
    let p = richardson(h, f)?;
    Some(f[2] + (f[2] - f[1]) * h[2].powf(p) / (h[1].powf(p) - h[2].powf(p)))
}

/// Errors above this say that two motions have nothing in common.
const LARGE: f64 = 0.5;
/// Errors below this are rounding.
const ROUNDING: f64 = 1e-11;

impl Comparison {
    /// Parameters that all rows have.
    pub fn common(&self) -> Option<&str> {
        let first = self.rows.first().map(|r| r.changed.as_str())?;
        (!first.is_empty() && self.rows.iter().all(|r| r.changed == first)).then_some(first)
    }

    /// Name of a row's variant, with the parameters that others do not have.
    pub fn name(&self, row: &Row) -> String {
        match row.changed.is_empty() || self.common().is_some() {
            true => row.variant.clone(),
            false => format!("{} ({})", row.variant, row.changed),
        }
    }

    /// Whether the errors of a series are rounding on every mesh.
    pub(crate) fn is_exact(&self, series: &[&Row]) -> bool {
        let small = |r: &&Row| r.get(Quantity::Error) <= ROUNDING;
        series.iter().all(small)
    }

    /// Rows that differ in the mesh alone, from coarse to fine; in the order in which they begin.
    pub fn series(&self) -> Vec<Vec<&Row>> {
        let mut all: Vec<Vec<&Row>> = vec![];
        let omega = |r: &Row| r.get(Quantity::Omega).to_bits();
        for row in &self.rows {
            let same = |s: &&mut Vec<&Row>| {
                let first = s[0];
                (&first.variant, &first.changed, omega(first))
                    == (&row.variant, &row.changed, omega(row))
            };
            match all.iter_mut().find(same) {
                Some(series) => series.push(row),
                None => all.push(vec![row]),
            }
        }
        all.iter_mut().for_each(|s| s.sort_by(|a, b| b.h.total_cmp(&a.h)));
        all
    }

    /// Orders at which the error of a series falls: from pairs of meshes where the reference is exact, from differences of neighbouring meshes otherwise.
    pub fn orders_of_error(&self, series: &[&Row]) -> Orders {
        let quantity = if self.exact { Quantity::Error } else { Quantity::Difference };
        if self.is_exact(series) {
            return Orders::default();
        }
        let known: Vec<(f64, f64)> = series
            .iter()
            .map(|r| (r.h, r.get(quantity)))
            .filter(|(_, e)| e.is_finite() && *e > 0.0)
            .collect();
        // of errors of the size of the motion nothing converges
        let of = |w: &[(f64, f64)]| match w[0].1.max(w[1].1) < LARGE {
            true => (w[0].1 / w[1].1).ln() / (w[0].0 / w[1].0).ln(),
            false => f64::NAN,
        };
        Orders(known.windows(2).map(of).collect())
    }

    /// Orders at which a quantity of a series converges, by Richardson from triples of meshes.
    pub fn orders_of(&self, series: &[&Row], quantity: Quantity) -> Orders {
        let of = |(h, f)| richardson(h, f).unwrap_or(f64::NAN);
        Orders(triples(series, quantity).into_iter().map(of).collect())
    }

    /// The limits of these triples.
    pub fn limits_of(&self, series: &[&Row], quantity: Quantity) -> Vec<f64> {
        let of = |(h, f)| limit(h, f).unwrap_or(f64::NAN);
        triples(series, quantity).into_iter().map(of).collect()
    }
}

/// Sizes and values on three neighbouring meshes.
fn triples(series: &[&Row], quantity: Quantity) -> Vec<([f64; 3], [f64; 3])> {
    let known: Vec<(f64, f64)> =
        series.iter().map(|r| (r.h, r.get(quantity))).filter(|(_, f)| f.is_finite()).collect();
    let of = |w: &[(f64, f64)]| ([w[0].0, w[1].0, w[2].0], [w[0].1, w[1].1, w[2].1]);
    known.windows(3).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(h: f64, quantity: Quantity, value: f64) -> Row {
        Row { h, values: [(quantity, value)].into(), ..Row::default() }
    }

    #[test]
    fn orders_and_limits_are_found() {
        let f = |h: f64| 0.7 + 3.0 * h.powf(1.6);
        for h in [[0.1, 0.05, 0.025], [0.1, 0.05, 1.0 / 30.0], [0.05, 1.0 / 30.0, 0.025]] {
            let values = h.map(f);
            assert!((richardson(h, values).unwrap() - 1.6).abs() < 1e-9);
            assert!((limit(h, values).unwrap() - 0.7).abs() < 1e-9);
        }
        assert_eq!(richardson([0.4, 0.2, 0.1], [1.0, 2.0, 1.5]), None);
        assert_eq!(richardson([0.4, 0.2, 0.1], [1.0, 1.1, 1.5]), None);
    }

    #[test]
    fn series_are_of_one_variant_and_ordered_by_mesh() {
        let e = |h: f64| row(h, Quantity::Error, 0.3 * h);
        let comparison = Comparison {
            compared: Compared::Run,
            title: String::new(),
            reference: String::new(),
            exact: true,
            footer: String::new(),
            rows: vec![e(0.1), e(0.025), e(0.05), Row { variant: "b".into(), ..e(0.1) }],
        };
        let series = comparison.series();
        assert_eq!(series.len(), 2);
        assert_eq!(series[0].iter().map(|r| r.h).collect::<Vec<_>>(), [0.1, 0.05, 0.025]);
        let orders = comparison.orders_of_error(&series[0]);
        assert!((orders.mean() - 1.0).abs() < 1e-12 && orders.missing() == 0);
        assert!(comparison.orders_of(&series[0], Quantity::Error).missing() == 0);
        assert!(comparison.orders_of_error(&series[1]).mean().is_nan());
    }
}
