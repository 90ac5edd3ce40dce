//! The plan of a sweep: a scenario with `[sweep]`, or a file of its own that names the scenario.

use super::load::{read_source, unreadable, with_section};
use super::model::{Scenario, SweepSpec};
use super::node::{Node, Place, Raw};
use super::section::must_exist;
use super::source::Source;
use super::sweep::read;
use std::path::{Path, PathBuf};
use terraglue_diagnostics::InputError;

type Checked<T> = Result<T, Box<InputError>>;

/// A sweep with the scenario that it is of.
#[derive(Clone, Debug)]
pub struct SweepPlan {
    /// File of the scenario.
    pub scenario: PathBuf,
    /// Its `[sweep]`.
    pub spec: SweepSpec,
    source: Source,
}

impl SweepPlan {
    /// Reads a scenario with `[sweep]`, or a plan of its own: `scenario = "file.toml"` and `[sweep]`. `sets` edit it first.
    ///
    /// # Errors
    /// Wrong input, with the place in the file or in the edit.
    pub fn load(path: &Path, sets: &[(String, String)]) -> Checked<Self> {
        let text = terraglue_subsystem::files::read_text(path).map_err(|e| unreadable(path, &e))?;
        let source = read_source(&text, &path.display().to_string(), sets, &[])?;
        let scenario = match source.root.get("scenario") {
            Some(node) => named(&source, node)?,
            None => path.to_owned(),
        };
        if source.root.get("sweep").is_none() {
            let help = "[sweep] with [sweep.vary], described in docs/sweep.md, says which keys differ from run to run";
            return Err(source.error(
                &Place::default(),
                "there is no table `[sweep]` here",
                Some(help.into()),
            ));
        }
        let spec = match scenario == path {
            true => Scenario::load(path, sets)?.sweep,
            false => Some(with_section(&source, "sweep", read)?),
        };
        let Some(spec) = spec else { return Err(InputError::plain("there is no table `[sweep]`", None)) };
        Ok(Self { scenario, spec, source })
    }

    /// An error at a varied key, with its place in the file.
    pub fn error(&self, key: &str, message: String, help: Option<String>) -> Box<InputError> {
        self.source.error_at_value(&["sweep", "vary", key], message, help)
    }
}

/// The scenario of a plan of its own, which holds nothing else but `[sweep]`.
fn named(source: &Source, node: &Node) -> Checked<PathBuf> {
    let Raw::Text(text) = &node.value else {
        return Err(source.error(&node.at, "`scenario` is the name of a file, in quotes", None));
    };
    must_exist(source, text).map_err(|c| source.error(&node.at, c.message, c.help))?;
    for (key, other) in source.root.entries() {
        if !["scenario", "sweep"].contains(&key.as_str()) {
            let help = "a plan has `scenario` and `[sweep]`; all else stands in the scenario";
            return Err(source.error(
                &other.key,
                format!("unknown key `{key}` in a plan"),
                Some(help.into()),
            ));
        }
    }
    Ok(source.folder().join(text))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::VariedValues;

    fn plan(text: &str) -> Checked<SweepSpec> {
        let source = read_source(text, "plan.toml", &[], &[])?;
        with_section(&source, "sweep", read)
    }

    #[test]
    fn values_are_written_as_for_an_edit() {
        let spec = plan(
            "[sweep.vary]\n\"a.b\" = [1, 2.5, true, \"x y\", \"3\", [\"p\", \"q\"]]\nc = { from = 1, to = 9, count = 3 }",
        );
        let spec = spec.expect("read");
        let VariedValues::List(values) = &spec.vary[0].values else { panic!("a list") };
        assert_eq!(values, &["1", "2.5", "true", "x y", "\"3\"", "[\"p\", \"q\"]"]);
        assert_eq!(
            spec.vary[1].values,
            VariedValues::Range { ends: [1.0, 9.0], is_whole: true, is_log: false, count: Some(3) }
        );
    }

    #[test]
    fn what_is_no_sweep_is_refused_with_the_way_out() {
        let cases = [
            ("[sweep]\n", "nothing differs"),
            ("[sweep]\nmethod = \"sobol\"\n", "nothing to spread"),
            ("[sweep]\nmethod = \"table\"\n", "needs a table"),
            ("[sweep]\npoints = 3\n[sweep.vary]\na = [1]\n", "is of latin-hypercube"),
            ("[sweep.vary]\na = 1\n", "takes a list"),
            ("[sweep.vary]\na.b = [1]\n", "has no key `b`"),
            ("[sweep.vary]\na = { from = 0.0, to = 1.0 }\n", "has no `count`"),
            ("[sweep.vary]\na = { from = 1.0, to = 1.0, count = 2 }\n", "has no range"),
            ("[sweep.vary]\na = { from = 0.0, to = 1.0, count = 2, log = true }\n", "has no range"),
            ("[sweep]\nseeds = 2\n[sweep.vary]\n\"world.seed\" = [1]\n", "`world.seed` is that of `seeds`"),
        ];
        for (text, words) in cases {
            let error = plan(text).expect_err(text);
            assert!(error.message.contains(words), "{text}: {}", error.message);
            assert!(error.help.is_some(), "{text}");
        }
    }
}
