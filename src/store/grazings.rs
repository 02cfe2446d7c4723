//! `/grazings` of a family: where a contact begins or ends to be along its branches.

use super::StoreError;
use super::columns::{FAMILY_GRAZINGS, GrazingRow};
use super::schema::Rows;
use super::table::Form;
use crate::records::{GrazingRecord, PointKind, PointRecord};

/// What of a point `/grazings` is made of.
pub(super) struct Passage {
    branch: usize,
    index: i64,
    omega: f64,
    grazing: Option<GrazingRecord>,
    /// Largest modulus of a multiplier of its orbit; not a number where that is not known.
    multiplier: f64,
}

impl Passage {
    /// That of a point.
    pub fn of(p: &PointRecord) -> Passage {
        let grazing = match &p.special {
            PointKind::Grazing(grazing) => Some(grazing.clone()),
            _ => None,
        };
        let orbit = p.orbit.as_ref();
        let multiplier = orbit.and_then(|o| o.largest_multiplier()).unwrap_or(f64::NAN);
        Passage { branch: p.branch, index: p.index, omega: p.omega, grazing, multiplier }
    }
}

/// Write `/grazings` of the points of a finished family, which come in the order of their rows; nothing where no branch grazes.
pub(super) fn write_grazings(file: &hdf5::File, points: &[Passage]) -> Result<(), StoreError> {
    let grazings =
        points.iter().enumerate().filter_map(|(row, p)| Some((row, p, p.grazing.clone()?)));
    let behind = |p: &Passage| {
        let after = points.iter().filter(|q| q.branch == p.branch && q.index > p.index);
        let is_orbit = |q: &&Passage| q.grazing.is_none() && q.multiplier.is_finite();
        after.filter(is_orbit).min_by_key(|q| q.index).map_or(f64::NAN, |q| q.multiplier)
    };
    let rows: Vec<GrazingRow> = grazings
        .flat_map(|(row, p, grazing)| {
            let (branch, point, multiplier) = (p.branch as i64, row as i64, behind(p));
            let of_node = |node: usize| {
                let grazing = GrazingRecord { node, ..grazing.clone() };
                GrazingRow { omega: p.omega, branch, point, grazing, multiplier }
            };
            grazing.nodes().map(of_node).collect::<Vec<_>>()
        })
        .collect();
    if rows.is_empty() {
        return Ok(());
    }
    let mut table = Rows::create(file, FAMILY_GRAZINGS, &|_| Form::plain(None, 64))?;
    rows.iter().for_each(|row| table.push(row));
    table.append()
}
