//! Log lines of modules and of the library on standard error: warnings and errors, and all with `TERRAGLUE_LOG=info`.

use log::{Level, LevelFilter, Log, Metadata, Record};

struct Logger;

impl Log for Logger {
    fn enabled(&self, metadata: &Metadata) -> bool {
        metadata.target().starts_with("terraglue")
    }

    fn log(&self, record: &Record) {
        if self.enabled(record.metadata()) {
            // an error that a module or unit speaks of is not yet one of the program
            let said = ["terraglue::module", "terraglue::fmu"].contains(&record.target());
            let by = if said && record.level() == Level::Error { "logged " } else { "" };
            let level = match record.level() {
                Level::Warn => "warning".to_owned(),
                other => other.as_str().to_lowercase(),
            };
            eprintln!("{by}{level}: {}", super::shorten::text(&record.args().to_string()));
        }
    }

    fn flush(&self) {}
}

/// Shows log lines from now on.
pub fn install() {
    let asked = std::env::var("TERRAGLUE_LOG").ok().and_then(|level| level.parse().ok());
    if log::set_logger(&Logger).is_ok() {
        log::set_max_level(asked.unwrap_or(LevelFilter::Warn));
    }
}
