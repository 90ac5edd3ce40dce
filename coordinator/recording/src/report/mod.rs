//! `report.html`: one self-contained page about a run, made from its recording.
//!
//! Nothing is loaded from anywhere: style, scripts, curves and the picture of the ground are inside the file. Other pages about runs
//! are made of the same parts ([`page::Page`], [`figure::Figure`], [`energy_card`], …).

mod cards;
mod contact_owners;
mod exchange;
mod figures;
mod ground_map;
mod node_values;
mod outlines;
mod replay;
mod setup;
mod tree_match;

pub mod energy_card;
pub mod figure;
pub mod footprints;
pub mod html;
pub mod page;
pub mod picture;

use crate::layout::{REPORT, at};
use crate::reader::Recording;
use crate::summary::Summary;
use std::path::{Path, PathBuf};
use terraglue_diagnostics::error::{Error, Result};

/// Makes the report of a results folder from its recording and, where it is there, `summary.json`. The
/// recording may be cut off ([`crate::mend`] gives it its footer). Returns the path of the page.
///
/// # Errors
/// [`Error::File`]: the recording cannot be read, or the report not be written.
pub fn write(folder: &Path) -> Result<PathBuf> {
    let recording = Recording::open(folder)?;
    let summary = Summary::read(folder).ok();
    let path = folder.join(REPORT);
    let exchange = exchange::render(folder);
    std::fs::write(&path, page(&recording, summary.as_ref(), exchange.as_deref())?).map_err(at(&path))?;
    Ok(path)
}

/// The page as text, of the recording alone.
///
/// # Errors
/// [`Error::File`]: a part of the recording cannot be read.
pub fn render(recording: &Recording, summary: Option<&Summary>) -> Result<String> {
    page(recording, summary, None)
}

fn page(recording: &Recording, summary: Option<&Summary>, exchange: Option<&str>) -> Result<String> {
    let legs = footprints::legs(recording);
    let mut page = page::Page::new(&title(recording));
    page.header(&setup::headline(recording, summary));
    if let Some(data) = replay::data(recording).map_err(|e| unmade(recording, &e))? {
        page.section("The run", "run", replay::FRAME);
        page.data("replay", data);
    }
    page.section("At a glance", "figures", &cards::render(recording, summary));
    if let Some(summary) = summary {
        page.section("Where the energy went", "energies", &energy_card::render(&summary.energy.energies));
    }
    page.section("Simulated system", "setup", &setup::render(recording));
    if let Some(map) = ground_map::data(recording, &legs)? {
        page.section("The ground from above", "ground", ground_map::FRAME);
        page.data("map", map);
    }
    if let Some(html) = tree_match::section(recording) {
        page.section("Among the trees", "tree-map", &html);
    }
    for figure in tree_match::figure(recording).into_iter().chain(figures::all(recording, &legs)) {
        page.figure(figure);
    }
    let events: Vec<_> =
        summary.map_or(&recording.events, |s| &s.events).iter().map(|e| (e.t_s, e.what.as_str())).collect();
    page.events(&events);
    if let Some(html) = exchange {
        page.section("How values went round", "exchange", html);
    }
    Ok(page.finish())
}

fn unmade(recording: &Recording, why: &std::io::Error) -> Error {
    Error::Simulation { time_s: recording.end_s(), message: format!("replay: {why}") }
}

fn title(recording: &Recording) -> String {
    match recording.header.get("scenario") {
        "" => "Run".into(),
        name => name.into(),
    }
}
