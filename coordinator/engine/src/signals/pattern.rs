//! Name patterns of connections: `gait.*.angle_target` → `robot.*.angle_target`.
//!
//! A `*` matches a whole dotted part or a piece of one, never a dot and never nothing. The matches of the stars of `from`
//! replace, in this order, the stars of `to`.

/// The name that `to` makes of `name`, when `name` matches `from`.
///
/// ```
/// use terraglue_engine::signals::pattern::rewrite;
/// let target = rewrite("gait.*.angle_target", "robot.*.angle_target", "gait.LF_j2.angle_target");
/// assert_eq!(target.as_deref(), Some("robot.LF_j2.angle_target"));
/// ```
pub fn rewrite(from: &str, to: &str, name: &str) -> Option<String> {
    let captured = captures(from, name)?;
    let mut captured = captured.into_iter();
    let mut target = String::with_capacity(to.len() + name.len());
    for c in to.chars() {
        match c {
            '*' => target.push_str(captured.next()?),
            other => target.push(other),
        }
    }
    Some(target)
}

/// Whether `name` matches `pattern`.
pub fn matches(pattern: &str, name: &str) -> bool {
    captures(pattern, name).is_some()
}

/// Text that each `*` of the pattern matches, shortest first from the left.
pub fn captures<'a>(pattern: &str, name: &'a str) -> Option<Vec<&'a str>> {
    let mut captured = Vec::new();
    let mut parts = name.split('.');
    for pattern_part in pattern.split('.') {
        match_part(pattern_part, parts.next()?, &mut captured).then_some(())?;
    }
    parts.next().is_none().then_some(captured)
}

fn match_part<'a>(pattern: &str, part: &'a str, captured: &mut Vec<&'a str>) -> bool {
    let Some((head, tail)) = pattern.split_once('*') else { return pattern == part };
    let Some(rest) = part.strip_prefix(head) else { return false };
    let depth = captured.len();
    for (end, c) in rest.char_indices() {
        let end = end + c.len_utf8();
        captured.push(&rest[..end]);
        if match_part(tail, &rest[end..], captured) {
            return true;
        }
        captured.truncate(depth);
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_takes_a_whole_part() {
        let target = rewrite("gait.*.angle_target", "robot.*.angle_target", "gait.LF_j2.angle_target");
        assert_eq!(target.as_deref(), Some("robot.LF_j2.angle_target"));
        assert_eq!(rewrite("gait.*.angle_target", "robot.*", "gait.LF_j2.velocity"), None);
    }

    #[test]
    fn a_star_takes_a_piece_of_a_part() {
        assert_eq!(rewrite("a.*_j2.x", "b.*_knee.x", "a.LF_j2.x").as_deref(), Some("b.LF_knee.x"));
        assert_eq!(captures("a.L*_j*", "a.LF_j10"), Some(vec!["F", "10"]));
        assert_eq!(
            captures("a.*b*c", "a.xbbc"),
            Some(vec!["x", "b"]),
            "goes back when the first try fails later"
        );
    }

    #[test]
    fn a_star_crosses_no_dot_and_matches_not_nothing() {
        assert!(!matches("robot.*", "robot.LF_j2.angle"));
        assert!(!matches("robot.*.*", "robot.body"));
        assert!(!matches("robot.body*", "robot.body"));
        assert!(matches("robot.*.*", "robot.body.z"));
    }

    #[test]
    fn without_stars_names_are_compared() {
        assert_eq!(rewrite("a.x", "b.y", "a.x").as_deref(), Some("b.y"));
        assert!(!matches("a.x", "a.xy") && !matches("a.x.y", "a.x") && matches("a.é", "a.é"));
    }

    #[test]
    fn a_target_with_more_stars_than_captures_is_no_name() {
        assert_eq!(rewrite("a.*", "b.*.*", "a.x"), None);
    }
}
