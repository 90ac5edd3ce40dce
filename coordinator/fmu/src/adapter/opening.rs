//! Options with which an FMU is opened, and the warnings about it.

use crate::settings::Options;
use crate::trace;
use serde_json::{Map, Value};
use std::sync::Arc;
use terraglue_fmi::{Fmu, InstanceOptions, LogLine, ModelDescription};
use terraglue_subsystem::{Error, Host, LogLevel, Result};

/// Folder of FMUs that talk over a simulated bus.
const BUS: &str = "extra/org.fmi-standard.fmi-ls-bus";
/// Warning about an FMU of a bus.
const NO_BUS: &str = "it is made for a bus (FMI-LS-BUS), which is not simulated: a frame in a clocked binary variable is passed on like any value, \
                      one step late, and a countdown clock of one FMU ticks no clock of another within an event";

/// Options of an instance.
pub(super) fn of_instance(options: &Options, host: &Arc<dyn Host>) -> Result<InstanceOptions> {
    let sink = host.clone();
    let log = Box::new(move |line: &LogLine| sink.log(line.level, &line.text));
    let trace = options.trace.as_deref().map(|path| {
        trace::to_file(path).map_err(|e| Error::Refused(format!("`trace`: {}: {e}", path.display())))
    });
    let (event_mode, log_categories) = (options.event_mode, options.log_categories.clone());
    let plain = InstanceOptions::new(host.name(), log);
    Ok(InstanceOptions { event_mode, log_categories, trace: trace.transpose()?, ..plain })
}

/// Logs the defects of a description; where `strict` is wanted, the first one refuses the FMU.
pub(super) fn warn(fmu: &Fmu, strict: bool, host: &dyn Host) -> Result {
    if fmu.folder().join(BUS).is_dir() {
        host.log(LogLevel::Warning, NO_BUS);
    }
    let warnings = fmu.description().warnings();
    if let (true, Some(first)) = (strict, warnings.first()) {
        let reason = format!("its description has defects, which strict = true refuses: {first}");
        return Err(Error::Refused(reason));
    }
    warnings.iter().for_each(|warning| host.log(LogLevel::Warning, warning));
    Ok(())
}

/// Says where the description begins at another time than the run, which all its FMUs share.
pub(super) fn warn_of_start(
    description: &ModelDescription,
    parameters: &Map<String, Value>,
    host: &dyn Host,
) {
    let Some(start) = description.experiment.start.filter(|start| *start != 0.0) else { return };
    if !parameters.contains_key("start_time_s") {
        let text = format!(
            "its description begins at t = {start} s, where `fmu run` begins, and the run at 0: `start_time_s = {start:?}` in its table gives it that time"
        );
        host.log(LogLevel::Warning, &text);
    }
}

/// Warns of a step that goes beyond the end that the FMU was given: the standards forbid it, and the FMU may answer with anything.
#[cold]
pub(super) fn warn_of_end(stop_time_s: f64, host: &dyn Host) {
    let text = format!(
        "the run goes on beyond stop_time_s = {stop_time_s}, the end that the FMU was given (times of the FMU, s): make stop_time_s larger, or \
         leave it out"
    );
    host.log(LogLevel::Warning, &text);
}

/// The length of a step that the description of an FMU with steps of one length names, where steps of length h are no whole number
/// of them, s.
pub(crate) fn other_length(description: &ModelDescription, h: f64) -> Option<f64> {
    let capabilities = &description.capabilities;
    let named = capabilities.fixed_step.or(description.experiment.step).filter(|named| *named > 0.0);
    let named = named.filter(|_| !capabilities.variable_step && h > 0.0)?;
    (h < named || !is_whole(h, named)).then_some(named)
}

fn is_whole(long: f64, short: f64) -> bool {
    (long / short - (long / short).round()).abs() < 1e-6
}

/// Says where steps of one length only are not those that the description names.
#[cold]
pub(super) fn warn_of_length(description: &ModelDescription, h: f64, host: &dyn Host) {
    let Some(named) = other_length(description, h) else { return };
    let cure = match h < named && is_whole(named, h) {
        true => format!("`step_multiple = {}` makes its steps as long", (named / h).round()),
        false => format!("`time.step_s = {named}`, or a whole part of it and `step_multiple`, fits"),
    };
    let text = format!(
        "the FMU makes steps of one length, and its description says {named} s; it is stepped by {h} s: {cure}"
    );
    host.log(LogLevel::Warning, &text);
}
