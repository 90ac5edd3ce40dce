//! The points of a plan: which values each varied key has in each run.

use sobol_burley::sample;
use std::path::Path;
use terraglue_diagnostics::InputError;
use terraglue_numerics::random::{Random, mixed};
use terraglue_scenario::{SweepSpec, VariedKey, VariedValues};

/// Most points of a sweep.
const MOST: usize = 1_000_000;
/// Most keys that the direction numbers of the sequence of Sobol reach for.
const MOST_DIMENSIONS: usize = sobol_burley::NUM_DIMENSIONS as usize;
/// Most points of that sequence.
const MOST_OF_SOBOL: usize = 1 << 16;
/// The key of the seeds of the runs.
const SEED: &str = "world.seed";

/// Varied keys, and their values in every run.
#[derive(Clone, Debug, PartialEq)]
pub struct Points {
    /// Key paths, as of `--set`.
    pub keys: Vec<String>,
    /// A value for each key, as of `--set`, of every run in turn.
    pub rows: Vec<Vec<String>>,
}

/// All runs of a plan; runs of one point that differ in their seed follow each other.
///
/// # Errors
/// More than a million runs, more keys than the method can spread, or a table that cannot be read.
pub fn points(spec: &SweepSpec) -> Result<Points, Box<InputError>> {
    let names = || spec.vary.iter().map(|v| v.key.clone()).collect();
    let points = match (spec.method.as_str(), &spec.table) {
        (_, Some(table)) => read(table)?,
        ("latin-hypercube", _) => Points { keys: names(), rows: latin_hypercube(spec) },
        ("sobol", _) => Points { keys: names(), rows: sobol(spec)? },
        _ => Points { keys: names(), rows: grid(&spec.vary)? },
    };
    with_seeds(points, spec)
}

fn with_seeds(mut points: Points, spec: &SweepSpec) -> Result<Points, Box<InputError>> {
    if spec.seeds == 0 {
        return Ok(points);
    }
    if points.keys.iter().any(|key| key == SEED) {
        let help = "leave `seeds` or the column out".to_owned();
        return Err(InputError::plain(format!("`{SEED}` is that of `seeds`, and in the table"), Some(help)));
    }
    let runs = u64::try_from(points.rows.len()).unwrap_or(u64::MAX).saturating_mul(spec.seeds);
    must_be_few(usize::try_from(runs).unwrap_or(usize::MAX))?;
    points.keys.push(SEED.into());
    let seeded = |row: &Vec<String>| {
        let row = row.clone();
        (0..spec.seeds).map(move |k| row.iter().cloned().chain([(spec.seed + k).to_string()]).collect())
    };
    points.rows = points.rows.iter().flat_map(seeded).collect();
    Ok(points)
}

fn must_be_few(runs: usize) -> Result<(), Box<InputError>> {
    if runs <= MOST {
        return Ok(());
    }
    let help = "leave values out, or spread `points` over the ranges with `method = \"sobol\"`".to_owned();
    Err(InputError::plain(format!("the sweep has more than {MOST} runs"), Some(help)))
}

/// Every combination; the last key changes first.
fn grid(vary: &[VariedKey]) -> Result<Vec<Vec<String>>, Box<InputError>> {
    let mut rows = vec![Vec::new()];
    for key in vary {
        let values = match &key.values {
            VariedValues::List(values) => values.clone(),
            VariedValues::Range { count, .. } => {
                let n = count.unwrap_or(2);
                (0..n).map(|k| at(&key.values, k as f64 / (n - 1) as f64)).collect()
            }
        };
        must_be_few(rows.len().saturating_mul(values.len()))?;
        let with = |row: &Vec<String>, value: &String| row.iter().cloned().chain([value.clone()]).collect();
        rows = rows.iter().flat_map(|row| values.iter().map(move |value| with(row, value))).collect();
    }
    Ok(rows)
}

/// Each of n equal parts of each range has one point (McKay, Beckman and Conover, 1979).
fn latin_hypercube(spec: &SweepSpec) -> Vec<Vec<String>> {
    let n = spec.points;
    let column = |(k, key): (usize, &VariedKey)| -> Vec<String> {
        let mut random = Random::new(mixed(spec.seed) ^ k as u64);
        let mut parts: Vec<usize> = (0..n).collect();
        for i in (1..n).rev() {
            parts.swap(i, random.below(i + 1));
        }
        parts.iter().map(|part| at(&key.values, (*part as f64 + random.uniform()) / n as f64)).collect()
    };
    let columns: Vec<Vec<String>> = spec.vary.iter().enumerate().map(column).collect();
    (0..n).map(|i| columns.iter().map(|column| column[i].clone()).collect()).collect()
}

/// The sequence of Sobol (1967), scrambled after Owen (1995).
fn sobol(spec: &SweepSpec) -> Result<Vec<Vec<String>>, Box<InputError>> {
    if spec.vary.len() > MOST_DIMENSIONS || spec.points > MOST_OF_SOBOL {
        let message =
            format!("the method sobol spreads {MOST_OF_SOBOL} points over {MOST_DIMENSIONS} keys at most");
        return Err(InputError::plain(message, Some("write `method = \"latin-hypercube\"`".into())));
    }
    let seed = (mixed(spec.seed) >> 32) as u32;
    let row = |i: usize| {
        let value =
            |(k, key): (usize, &VariedKey)| at(&key.values, f64::from(sample(i as u32, k as u32, seed)));
        spec.vary.iter().enumerate().map(value).collect()
    };
    Ok((0..spec.points).map(row).collect())
}

/// The value at a share 0 … 1 of a list or a range.
fn at(values: &VariedValues, share: f64) -> String {
    match values {
        VariedValues::List(values) => {
            let k = (share * values.len() as f64) as usize;
            values[k.min(values.len() - 1)].clone()
        }
        VariedValues::Range { ends: [from, to], is_whole: true, count: None, is_log: false } => {
            // each whole number has an equal share
            (from + (share * (to - from + 1.0)).floor().min(to - from)).to_string()
        }
        VariedValues::Range { ends: [from, to], is_whole, is_log, .. } => {
            let value = match is_log {
                true => (from.ln() + share * (to.ln() - from.ln())).exp().clamp(*from, *to),
                false => from + share * (to - from),
            };
            let rounded: f64 = format!("{value:.12e}").parse().unwrap_or(value);
            if *is_whole { rounded.round().to_string() } else { format!("{rounded:?}") }
        }
    }
}

/// A table whose titles are key paths.
fn read(path: &Path) -> Result<Points, Box<InputError>> {
    let wrong = |what: String| {
        let help = "its first row has key paths as of --set, each further row a value for each".to_owned();
        InputError::plain(format!("`{}` is no table of points: {what}", path.display()), Some(help))
    };
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_path(path)
        .map_err(|e| wrong(e.to_string()))?;
    let keys: Vec<String> =
        reader.headers().map_err(|e| wrong(e.to_string()))?.iter().map(Into::into).collect();
    if let Some(key) = keys.iter().enumerate().find(|(k, key)| key.is_empty() || keys[..*k].contains(key)) {
        return Err(wrong(format!("title {} (`{}`) is empty or there twice", key.0 + 1, key.1)));
    }
    let mut rows = Vec::new();
    for row in reader.records() {
        let row = row.map_err(|e| wrong(e.to_string()))?;
        if let Some(column) = row.iter().position(str::is_empty) {
            let line = row.position().map_or(0, csv::Position::line);
            return Err(wrong(format!("line {line} has no value of `{}`", keys[column])));
        }
        rows.push(row.iter().map(Into::into).collect());
        must_be_few(rows.len())?;
    }
    if rows.is_empty() {
        return Err(wrong("it has no rows".into()));
    }
    Ok(Points { keys, rows })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec(method: &str, points: usize, vary: &[(&str, VariedValues)]) -> SweepSpec {
        let key =
            |(key, values): &(&str, VariedValues)| VariedKey { key: (*key).into(), values: values.clone() };
        SweepSpec {
            method: method.into(),
            points,
            seeds: 0,
            seed: 3,
            table: None,
            collect: Vec::new(),
            vary: vary.iter().map(key).collect(),
        }
    }

    fn list(values: &[&str]) -> VariedValues {
        VariedValues::List(values.iter().map(|v| (*v).into()).collect())
    }

    fn range(from: f64, to: f64, count: Option<usize>) -> VariedValues {
        VariedValues::Range { ends: [from, to], is_whole: false, is_log: false, count }
    }

    #[test]
    fn a_grid_has_every_combination_once_and_each_seed() {
        let mut spec = spec("grid", 0, &[("a", list(&["x", "y"])), ("b", range(0.0, 0.3, Some(4)))]);
        spec.seeds = 2;
        let all = points(&spec).expect("points");
        assert_eq!(all.keys, ["a", "b", "world.seed"]);
        assert_eq!(all.rows.len(), 16);
        assert_eq!(all.rows[0], ["x", "0.0", "3"]);
        assert_eq!(all.rows[3], ["x", "0.1", "4"]);
        assert_eq!(all.rows[15], ["y", "0.3", "4"]);
        let mut unlike = all.rows.clone();
        unlike.sort();
        unlike.dedup();
        assert_eq!(unlike.len(), 16);
    }

    #[test]
    fn a_latin_hypercube_has_one_point_in_each_part_of_each_range() {
        let spec =
            spec("latin-hypercube", 50, &[("a", range(0.0, 50.0, None)), ("b", range(-1.0, 1.0, None))]);
        let all = points(&spec).expect("points");
        for (k, scale) in [(0, 1.0), (1, 25.0)] {
            let low = if k == 0 { 0.0 } else { -1.0 };
            let part =
                |row: &Vec<String>| ((row[k].parse::<f64>().expect("a number") - low) * scale) as usize;
            let mut parts: Vec<usize> = all.rows.iter().map(part).collect();
            parts.sort_unstable();
            assert_eq!(parts, (0..50).collect::<Vec<_>>());
        }
        assert_eq!(points(&spec).expect("again"), all);
    }

    #[test]
    fn points_of_sobol_fill_every_cell_of_a_chessboard() {
        let spec = spec("sobol", 64, &[("a", range(0.0, 8.0, None)), ("b", range(0.0, 8.0, None))]);
        let mut cells = [0; 64];
        for row in points(&spec).expect("points").rows {
            let [x, y] = [0, 1].map(|k| row[k].parse::<f64>().expect("a number") as usize);
            cells[8 * x + y] += 1;
        }
        assert_eq!(cells, [1; 64]);
    }

    #[test]
    fn whole_numbers_stay_whole_and_logarithms_are_spread() {
        let whole = VariedValues::Range { ends: [1.0, 4.0], is_whole: true, is_log: false, count: None };
        let values: Vec<String> = (0..8).map(|k| at(&whole, (f64::from(k) + 0.5) / 8.0)).collect();
        assert_eq!(values, ["1", "1", "2", "2", "3", "3", "4", "4"]);
        let log = VariedValues::Range { ends: [1.0, 1e4], is_whole: false, is_log: true, count: Some(5) };
        let values: Vec<String> = (0..5).map(|k| at(&log, f64::from(k) / 4.0)).collect();
        assert_eq!(values, ["1.0", "10.0", "100.0", "1000.0", "10000.0"]);
    }

    #[test]
    fn tables_are_read_and_wrong_ones_refused_with_their_line() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("points.csv");
        let table = |text: &str| {
            std::fs::write(&path, text).expect("written");
            read(&path)
        };
        let good = table("soil.module, terrain.angle_rad\n# a remark\nsoil-bekker, 0.1\n").expect("read");
        assert_eq!(good.keys, ["soil.module", "terrain.angle_rad"]);
        assert_eq!(good.rows, [["soil-bekker", "0.1"]]);
        for (text, words) in [
            ("a,b\n1\n", "line"),
            ("a,a\n1,2\n", "twice"),
            ("a\n", "no rows"),
            ("a,b\n1,\n", "no value of `b`"),
        ] {
            let error = table(text).expect_err(text);
            assert!(error.message.contains(words), "{text}: {}", error.message);
        }
    }

    #[test]
    fn a_sweep_without_end_is_refused() {
        let vary = range(0.0, 1.0, Some(10_000));
        let spec = spec("grid", 0, &[("a", vary.clone()), ("b", vary)]);
        assert!(points(&spec).expect_err("refused").message.contains("more than"));
    }
}
