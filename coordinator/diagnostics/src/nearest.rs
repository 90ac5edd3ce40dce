//! The nearest valid name to a wrong one, for every message about a name.

/// The name of `names` nearest to `wrong` (Damerau–Levenshtein distance), when it is near enough to be meant.
pub fn nearest<'a>(wrong: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let (distance, name) = names
        .into_iter()
        .map(|name| (strsim::damerau_levenshtein(&wrong.to_lowercase(), &name.to_lowercase()), name))
        .min_by_key(|(distance, _)| *distance)?;
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
