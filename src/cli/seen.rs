//! What is told of a motion that a file keeps: forces, the largest pressure, what probes saw.

use serde_json::{Map, Value};

use signorini::contact::System;
use signorini::store::Writer;

use super::CliError;

/// Resultants of contact groups, supports and springs, the largest pressure, the largest of probes, by their keys in JSON.
pub fn seen(writer: &mut Writer, system: &System) -> Result<Map<String, Value>, CliError> {
    let value = |x: Result<Value, serde_json::Error>| x.unwrap_or_default();
    let mut all = Map::new();
    all.insert("forces".into(), value(serde_json::to_value(writer.forces()?)));
    // impulses of a step are no pressures
    let marches = system.impact().is_some_and(|law| law.march.is_some());
    let facing = system.facing().len();
    let pressure = if marches { None } else { writer.largest_pressure(facing)? };
    if let Some(pressure) = pressure {
        all.insert("largest_pressure".into(), value(serde_json::to_value(pressure)));
    }
    all.insert("probes".into(), value(serde_json::to_value(writer.probes()?)));
    Ok(all)
}
