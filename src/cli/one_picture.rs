//! Files whose results are one picture and one table.

use std::path::Path;

use signorini::report::figure::Sheet;
use signorini::report::{bands, basins, comparison, diagram, phase_resonance, plane, tori};
use signorini::store::{
    Content, read_bands, read_basins, read_comparison, read_curves, read_diagram, read_resonance,
    read_tori,
};

use super::CliError;

/// The name of the picture of a kind of files, if it has only one.
pub(super) fn name(kind: Content) -> Option<&'static str> {
    match kind {
        Content::Comparison => Some("comparison"),
        Content::Basins => Some("basins"),
        Content::Diagram => Some("diagram"),
        Content::PhaseResonance => Some("phase-resonance"),
        Content::Bands => Some("bands"),
        Content::Tori => Some("tori"),
        Content::Curves => Some("curves"),
        Content::Run | Content::Orbit | Content::Family | Content::Study | Content::Arrays => None,
    }
}

/// The picture of a file of such a kind, with the title of its scene.
pub(super) fn picture(
    kind: Content,
    file: &Path,
) -> Result<Option<(String, Sheet<'static>)>, CliError> {
    Ok(Some(match kind {
        Content::Comparison => {
            let stored = read_comparison(file)?.comparison;
            let sheet = comparison::picture(&stored)?;
            (stored.title, sheet)
        }
        Content::Basins => {
            let stored = read_basins(file)?;
            let sheet = basins::picture(&stored)?;
            (stored.head.title, sheet)
        }
        Content::Diagram => {
            let stored = read_diagram(file)?;
            let sheet = diagram::picture(&stored)?;
            (stored.head.title, sheet)
        }
        Content::PhaseResonance => {
            let stored = read_resonance(file)?;
            let sheet = phase_resonance::picture(&stored)?;
            (stored.head.title, sheet)
        }
        Content::Bands => {
            let stored = read_bands(file)?;
            let sheet = bands::picture(&stored)?;
            (stored.head.title, sheet)
        }
        Content::Tori => {
            let stored = read_tori(file)?;
            let sheet = tori::picture(&stored)?;
            (stored.head.title, sheet)
        }
        Content::Curves => {
            let stored = read_curves(file)?;
            let sheet = plane::picture(std::slice::from_ref(&stored))?;
            (stored.head.title, sheet)
        }
        Content::Run | Content::Orbit | Content::Family | Content::Study | Content::Arrays => {
            return Ok(None);
        }
    }))
}

/// Its table as CSV.
pub(super) fn table(kind: Content, file: &Path) -> Result<Option<String>, CliError> {
    Ok(Some(match kind {
        Content::Comparison => comparison::csv(&read_comparison(file)?.comparison),
        Content::Basins => basins::csv(&read_basins(file)?),
        Content::Diagram => diagram::csv(&read_diagram(file)?),
        Content::PhaseResonance => phase_resonance::csv(&read_resonance(file)?),
        Content::Bands => bands::csv(&read_bands(file)?),
        Content::Tori => tori::csv(&read_tori(file)?),
        Content::Curves => plane::csv(&read_curves(file)?),
        Content::Run | Content::Orbit | Content::Family | Content::Study | Content::Arrays => {
            return Ok(None);
        }
    }))
}
