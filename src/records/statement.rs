//! How far the energies of a family may be off: the same orbits with another viscosity, mesh, discretisation of the contact, number of modes.

/// What is changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Changed {
    /// Half the viscosity: what is not the elastic body's, but the model's.
    HalfViscosity,
    /// Half as many elements in every direction, the same viscosity.
    HalfMesh,
    /// A quarter of them.
    QuarterMesh,
    /// The other discretisation of the contact, on the same mesh.
    OtherContact,
    /// Twice as many modes of a reduction.
    MoreModes,
}

impl Changed {
    /// All, in the order in which they are said.
    pub const ALL: [Changed; 5] = [
        Changed::HalfViscosity,
        Changed::HalfMesh,
        Changed::QuarterMesh,
        Changed::OtherContact,
        Changed::MoreModes,
    ];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Changed::HalfViscosity => "half_viscosity",
            Changed::HalfMesh => "half_mesh",
            Changed::QuarterMesh => "quarter_mesh",
            Changed::OtherContact => "other_contact",
            Changed::MoreModes => "more_modes",
        }
    }

    /// Whether it is an error of the computation, which another mesh or more modes make smaller, and no choice of the model.
    pub(crate) fn is_numerical(self) -> bool {
        self != Changed::HalfViscosity
    }
}

/// The energies of the same orbits with one thing changed.
#[derive(Debug, Clone, PartialEq)]
pub struct Variation {
    /// What is changed.
    pub changed: Changed,
    /// How, in words.
    pub text: String,
    /// Energy at each frequency of the statement; not a number where no orbit was found.
    pub energy: Vec<f64>,
}

/// The error statement of a family of viscous orbits.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ErrorStatement {
    /// Frequencies at which orbits were computed again.
    pub omega: Vec<f64>,
    /// Energy of the family there.
    pub energy: Vec<f64>,
    /// `dE/dω` of the family there; not a number where neighbours are missing.
    pub slope: Vec<f64>,
    /// What was changed.
    pub variations: Vec<Variation>,
}

impl ErrorStatement {
    /// `E′/E − 1` of a variation.
    pub fn relative(&self, v: &Variation) -> Vec<f64> {
        v.energy.iter().zip(&self.energy).map(|(a, b)| a / b - 1.0).collect()
    }

    /// The same as a shift of the frequency at given energy, `−(E′ − E)/(dE/dω)`, over the frequency.
    pub fn shift(&self, v: &Variation) -> Vec<f64> {
        let of = |k: usize| -(v.energy[k] - self.energy[k]) / (self.slope[k] * self.omega[k]);
        (0..self.omega.len()).map(of).collect()
    }

    /// A variation.
    pub fn of(&self, changed: Changed) -> Option<&Variation> {
        self.variations.iter().find(|v| v.changed == changed)
    }

    /// Observed order of convergence with the mesh, `log₂ (E_{n/2} − E_{n/4})/(E_n − E_{n/2})`; not a number where the differences have two signs.
    pub fn order(&self) -> Vec<f64> {
        let (Some(half), Some(quarter)) =
            (self.of(Changed::HalfMesh), self.of(Changed::QuarterMesh))
        else {
            return vec![];
        };
        let of = |k: usize| {
            let ratio = (half.energy[k] - quarter.energy[k]) / (self.energy[k] - half.energy[k]);
            if ratio > 0.0 { ratio.log2() } else { f64::NAN }
        };
        (0..self.omega.len()).map(of).collect()
    }

    /// Largest `|E′/E − 1|` at each frequency of what is numerical (`true`), or of everything: the half width of a band. Meshes coarser than half of the
    /// family's say nothing about its own error. Not a number where one of them has no orbit: the band would be too narrow.
    pub fn band(&self, numerical: bool) -> Vec<f64> {
        let counts = |v: &&Variation| {
            v.changed != Changed::QuarterMesh && (v.changed.is_numerical() || !numerical)
        };
        let counted: Vec<Vec<f64>> =
            self.variations.iter().filter(counts).map(|v| self.relative(v)).collect();
        let width = |k: usize| {
            let all = || counted.iter().map(|r| r[k].abs());
            match all().any(f64::is_nan) {
                true => f64::NAN,
                false => all().reduce(f64::max).unwrap_or(f64::NAN),
            }
        };
        (0..self.omega.len()).map(width).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_statement_knows_order_shift_and_band() {
        let v =
            |changed, energy: f64| Variation { changed, text: String::new(), energy: vec![energy] };
        let statement = ErrorStatement {
            omega: vec![2.0],
            energy: vec![1.0],
            slope: vec![5.0],
            variations: vec![
                v(Changed::HalfViscosity, 1.1),
                v(Changed::HalfMesh, 0.96),
                v(Changed::QuarterMesh, 0.8),
                v(Changed::OtherContact, 1.02),
            ],
        };
        assert!((statement.order()[0] - 2.0).abs() < 1e-12);
        assert!((statement.shift(&statement.variations[0])[0] + 0.01).abs() < 1e-12);
        assert!((statement.band(true)[0] - 0.04).abs() < 1e-12);
        assert!((statement.band(false)[0] - 0.1).abs() < 1e-12);
        let alone =
            ErrorStatement { variations: vec![v(Changed::OtherContact, f64::NAN)], ..statement };
        assert!(alone.band(true)[0].is_nan());
    }
}
