//! Tables of variables that runs write.

use crate::process::Outcome;
use std::path::Path;

/// Names and values of the wanted columns of a table of variables, in their order; at least one.
pub fn columns(path: &Path, wanted: impl Fn(&str) -> bool) -> Outcome<Vec<(String, Vec<f64>)>> {
    let failed = |e: csv::Error| format!("{}: {e}", path.display());
    let mut reader = csv::Reader::from_path(path).map_err(failed)?;
    let headers = reader.headers().map_err(failed)?.iter().enumerate();
    let (places, mut all): (Vec<usize>, Vec<_>) =
        headers.filter(|(_, name)| wanted(name)).map(|(k, name)| (k, (name.to_owned(), Vec::new()))).unzip();
    if all.is_empty() {
        return Err(format!("{}: none of the wanted columns", path.display()));
    }
    for row in reader.records() {
        let row = row.map_err(failed)?;
        for (place, (name, values)) in places.iter().zip(&mut all) {
            let value = row.get(*place).and_then(|x| x.parse().ok()).filter(|x: &f64| x.is_finite());
            values.push(value.ok_or_else(|| format!("{}: `{name}` is no number", path.display()))?);
        }
    }
    Ok(all)
}
