//! Fingerprints of the files that a scenario refers to: they distinguish recordings of the same text.

use serde_json::Value;
use std::path::Path;
use terraglue_diagnostics::fingerprint;
use terraglue_scenario::{Scenario, TerrainKind};

/// One line `key fingerprint` for each file that the scenario names (robots, laws, elevation) and for the numbers that
/// each subsystem takes from the soil table. Files that these refer to, such as the meshes of a robot, are not included.
pub fn fingerprints(scenario: &Scenario) -> String {
    let mut lines = Vec::new();
    for spec in &scenario.subsystems {
        for (key, value) in &spec.parameters {
            files(&scenario.folder, &format!("{}.{key}", spec.name), value, &mut lines);
        }
        let regions: Vec<_> = spec.regions.iter().map(|r| (r.label, &r.numbers)).collect();
        if !spec.offered.is_empty() || !regions.is_empty() {
            let numbers = format!("{:?} {regions:?}", spec.offered);
            lines.push(line(&format!("{}.parameters", spec.name), numbers.as_bytes()));
        }
    }
    if let Some(
        TerrainKind::EsriAscii { file, .. }
        | TerrainKind::Png { file, .. }
        | TerrainKind::Geotiff { file, .. },
    ) = scenario.terrain.as_ref().map(|t| &t.kind)
    {
        lines.extend(
            terraglue_subsystem::files::read(&scenario.folder.join(file))
                .ok()
                .map(|bytes| line("terrain.file", &bytes)),
        );
    }
    lines.join("\n")
}

fn line(key: &str, bytes: &[u8]) -> String {
    format!("{key} {:016x}", fingerprint(bytes))
}

fn files(folder: &Path, key: &str, value: &Value, lines: &mut Vec<String>) {
    match value {
        Value::String(text) if !text.is_empty() => {
            let path = folder.join(text);
            let bytes = path.is_file().then(|| terraglue_subsystem::files::read(&path).ok()).flatten();
            lines.extend(bytes.map(|bytes| line(key, &bytes)));
        }
        Value::Array(items) => items.iter().for_each(|item| files(folder, key, item, lines)),
        Value::Object(table) => {
            table.iter().for_each(|(name, value)| files(folder, &format!("{key}.{name}"), value, lines));
        }
        _ => {}
    }
}
