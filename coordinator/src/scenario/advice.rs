//! What of a scenario has no effect although nothing is wrong with it: said in warnings, never an error.

use super::model::{Scenario, SubsystemSpec, Trigger};
use super::parameters::check_own_table;
use super::source::{InputError, Source};
use terraglue_subsystem::Schema;

/// Events after the end of the run.
pub fn late_events(scenario: &Scenario) -> Vec<String> {
    let end = scenario.time.duration_s;
    let late = scenario.events.iter().filter_map(|event| match event.trigger {
        Trigger::At(at) if at > end => Some((at, event)),
        _ => None,
    });
    late.map(|(at, event)| {
        let message = format!("an event at {at} s never happens: the run ends at {end} s");
        line_of(&scenario.source.error_at(event.span.clone(), message, None))
    })
    .collect()
}

/// Keys of a module that is not chosen, in its own table `[NAME.MODULE]`: what is wrong with them shows when it is.
pub fn unchosen(schema: &Schema, spec: &SubsystemSpec, source: &Source) -> Option<String> {
    let wrong = check_own_table(schema, spec, source).err()?;
    let module = &spec.module;
    Some(format!("{} (no effect now: `{}` has `module = \"{module}\"`)", line_of(&wrong), spec.name))
}

/// An error in one line: place and message.
fn line_of(error: &InputError) -> String {
    let (file, text) = (error.source_code.name(), error.source_code.inner());
    let start = error.span.map_or(0, |s| s.offset());
    let line = text.get(..start).map_or(1, |head| head.matches('\n').count() + 1);
    format!("{file}:{line}: {}", error.message)
}
