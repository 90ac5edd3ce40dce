//! Problems from files.
#![allow(clippy::unwrap_used, missing_docs, dead_code)]

/// One problem of `tests/reference/multibody/ncp`.
pub struct File {
    pub name: String,
    pub mu: Vec<f64>,
    pub q: Vec<f64>,
    pub w: Vec<f64>,
}

/// All of them by name.
pub fn files() -> Vec<File> {
    let folder = format!("{}/../../../tests/reference/multibody/ncp", env!("CARGO_MANIFEST_DIR"));
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    paths.retain(|p| p.extension().is_some_and(|e| e == "txt"));
    paths.sort();
    paths.iter().map(|p| read(p)).collect()
}

fn read(path: &std::path::Path) -> File {
    let text = std::fs::read_to_string(path).unwrap();
    let mut numbers = text.split_whitespace().map(|t| t.parse::<f64>().unwrap());
    let n = numbers.next().unwrap() as usize;
    let mut take = |count: usize| -> Vec<f64> { numbers.by_ref().take(count).collect() };
    let (mu, q, w) = (take(n), take(3 * n), take(9 * n * n));
    assert_eq!(w.len(), 9 * n * n);
    File { name: path.file_stem().unwrap().to_str().unwrap().to_owned(), mu, q, w }
}
