//! All tests.

use super::areas;
use super::definition::Test;

/// All tests in an order in which every test comes after those that it builds on.
pub fn catalogue() -> &'static [Test] {
    static ALL: std::sync::OnceLock<Vec<Test>> = std::sync::OnceLock::new();
    ALL.get_or_init(|| areas::ALL.iter().flat_map(|list| list.iter().copied()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_what_a_test_builds_on_comes_before_it() {
        let mut seen: Vec<&str> = Vec::new();
        for test in catalogue() {
            assert!(!seen.contains(&test.name), "{} twice", test.name);
            for before in test.after {
                assert!(
                    seen.contains(before),
                    "{} builds on {before}, which does not come before it",
                    test.name
                );
            }
            seen.push(test.name);
        }
    }
}
