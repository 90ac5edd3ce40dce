//! The nearest valid name to a wrong one, for every message about a name.

/// The name of `names` nearest to `wrong` (Damerau–Levenshtein distance), however far it is.
pub fn closest<'a>(wrong: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    ranked(wrong, names).map(|(_, name)| name)
}

fn ranked<'a>(wrong: &str, names: impl IntoIterator<Item = &'a str>) -> Option<(usize, &'a str)> {
    let wrong = wrong.to_lowercase();
    let distance = |name: &str| strsim::damerau_levenshtein(&wrong, &name.to_lowercase());
    names.into_iter().map(|name| (distance(name), name)).min_by_key(|(distance, _)| *distance)
}

/// The name of `names` nearest to `wrong`, when it is near enough to be meant.
pub fn nearest<'a>(wrong: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let (distance, name) = ranked(wrong, names)?;
    let contained = wrong.len() >= 3 && (name.contains(wrong) || wrong.contains(name) && name.len() >= 3);
    (contained || distance <= 1 + wrong.len().max(name.len()) / 3).then_some(name)
}

/// A help line: the nearest name, then the valid ones as far as they fit on a line or two.
pub fn did_you_mean<'a>(wrong: &str, names: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let names: Vec<&str> = names.into_iter().collect();
    let near = nearest(wrong, names.iter().copied()).map(|n| format!("did you mean `{n}`?"));
    let listed: Vec<String> = names.iter().take(24).map(|n| format!("`{n}`")).collect();
    let all = match names.len() {
        0 => None,
        n if n > listed.len() => near.is_none().then(|| format!("valid, among {n}: {} …", listed.join(", "))),
        _ => Some(format!("valid: {}", listed.join(", "))),
    };
    match (near, all) {
        (Some(near), Some(all)) => Some(format!("{near} ({all})")),
        (near, all) => near.or(all),
    }
}
