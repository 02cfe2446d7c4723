//! Series of another program or method against the equations in time, each with the orbit that shooting finds from it.

use super::{FamilyError, digest};
use crate::hbm::check::{Candidate, Checked, check};
use crate::orbit::search::Effort;
use crate::orbit::{Closure, Propagator, branch};
use crate::records::{CheckRow, GapReason, PointKind, PointRecord, SeriesRecord, VerdictKind};

/// Check one series; `quick`: without looking for the cause where shooting fails. A point that cannot be judged is one that failed: it
/// does not take the others with it.
pub fn point(
    body: &mut Propagator,
    closure: Closure,
    series: &SeriesRecord,
    quick: bool,
) -> Result<PointRecord, FamilyError> {
    let SeriesRecord { omega, coefficients, alpha, .. } = series.clone();
    let candidate = Candidate { omega, coefficients, alpha };
    let effort = Effort { rescue: !quick, ..Effort::of(closure) };
    let checked = check(body, closure, &candidate, &effort);
    let orbit = checked.as_ref().ok().and_then(|checked| checked.verdict.orbit());
    let orbit = orbit.map(|orbit| branch::record(body, orbit)).transpose()?;
    let row = match &checked {
        Ok(checked) => row(series, checked),
        Err(e) => failed(series, e.to_string()),
    };
    let special = match &orbit {
        Some(_) if row.is_orbit() => PointKind::Regular,
        Some(_) => PointKind::NoOrbitNear(row.verdict.clone()),
        None => PointKind::Gap(GapReason::Verdict(row.verdict.clone())),
    };
    Ok(PointRecord {
        omega: series.omega,
        special,
        orbit,
        series: Some(series.clone()),
        check: Some(row),
        ..PointRecord::default()
    })
}

fn row(series: &SeriesRecord, checked: &Checked) -> CheckRow {
    CheckRow {
        omega: series.omega,
        n_h: series.n_h,
        energy: checked.energy,
        residual: checked.residual,
        return_error: checked.return_error,
        verdict: checked.kind(),
        message: checked.verdict.to_string(),
        moved: checked.likeness.moved,
        orbit_energy: checked.verdict.orbit().map_or(f64::NAN, |o| o.energy),
        contact_change: checked.contact_change,
        same_sequence: checked.likeness.same_sequence,
    }
}

/// The row of a series that cannot be judged.
fn failed(series: &SeriesRecord, message: String) -> CheckRow {
    CheckRow {
        omega: series.omega,
        n_h: series.n_h,
        energy: f64::NAN,
        residual: f64::NAN,
        return_error: f64::NAN,
        verdict: VerdictKind::Failed,
        message,
        moved: f64::NAN,
        orbit_energy: f64::NAN,
        contact_change: f64::NAN,
        same_sequence: false,
    }
}

/// All numbers of the series, as one.
pub fn fingerprint(series: &[SeriesRecord]) -> u64 {
    let numbers =
        series.iter().flat_map(|s| s.coefficients.iter().chain([&s.omega]).chain(&s.alpha));
    digest(series.len(), numbers)
}
