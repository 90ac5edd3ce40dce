//! `terraglue check-module`: puts a module to the test.

use super::Exit;
use super::arguments::CheckModuleArguments;
use super::output::outln;
use std::path::Path;
use terraglue_conformance::{
    Options, Outcome, RemoteRun, TestContext, Told, catalogue, check, module_file, remember, run_here,
    run_remote, sanitize, sources_of,
};
use terraglue_diagnostics::Result;
use terraglue_scenario::InputError;

/// Runs the tests and prints what came out.
pub fn check_module(arguments: &CheckModuleArguments) -> Result<Exit> {
    let wrong = |text: String| InputError::plain(text, None);
    if arguments.list {
        for t in catalogue() {
            outln!("{:<24} {:<10} {:<9} {}", t.name, t.area.title(), t.level.word(), t.promise);
        }
        return Ok(Exit::Done);
    }
    let Some(path) = &arguments.path else { return Err(wrong("name the file of a module".into()).into()) };
    if arguments.sanitize {
        return sanitized(arguments, path);
    }
    let module = module_file(path).map_err(wrong)?;
    if arguments.in_process {
        return in_process(arguments, &module);
    }
    for file in [&arguments.json, &arguments.junit].into_iter().flatten() {
        let opened = terraglue_subsystem::files::can_create(file)
            .and_then(|()| std::fs::OpenOptions::new().append(true).create(true).open(file));
        opened.map_err(|e| wrong(format!("{} cannot be written: {e}", file.display())))?;
    }
    let report = check(&module, &options(arguments)?).map_err(wrong)?;
    if arguments.only.is_empty() {
        remember(&module, &report);
    }
    for (file, text) in [(&arguments.json, report.json()), (&arguments.junit, report.junit())] {
        if let Some(file) = file {
            write(file, &text)?;
        }
    }
    outln!("{}", report.text().trim_end());
    Ok(if report.is_good() { Exit::Done } else { Exit::Failed })
}

fn options(arguments: &CheckModuleArguments) -> Result<Options> {
    let wrong = |e| InputError::plain(format!("the program does not find itself: {e}"), None);
    let options = Options::new(std::env::current_exe().map_err(wrong)?);
    Ok(Options {
        level: arguments.level,
        seed: arguments.seed,
        only: arguments.only.clone(),
        sets: arguments.sets.clone(),
        limit_s: arguments.time_limit,
        jobs: arguments.jobs.map_or(options.jobs, usize::from),
        ..options
    })
}

/// Prints the findings of the sanitizers in the sources.
fn sanitized(arguments: &CheckModuleArguments, path: &Path) -> Result<Exit> {
    let wrong = |text: String| InputError::plain(text, None);
    let sources = match arguments.sources.as_slice() {
        [] => sources_of(path).map_err(wrong)?,
        named => named.to_vec(),
    };
    let told = sanitize(&sources, &options(arguments)?).map_err(wrong)?;
    for fault in &told.faults {
        let function =
            if fault.function.is_empty() { String::new() } else { format!(" in {}", fault.function) };
        outln!("{}: {}{function} (test {})", fault.place, fault.what, fault.test);
    }
    told.skipped.iter().for_each(|why| outln!("skip: {why}"));
    let looked = if told.ran.is_empty() { "nothing".into() } else { told.ran.join(", ") };
    outln!("{} found; looked for: {looked}", told.faults.len());
    Ok(if told.faults.is_empty() { Exit::Done } else { Exit::Failed })
}

/// One test, or a remote run of one, in this process.
fn in_process(arguments: &CheckModuleArguments, module: &Path) -> Result<Exit> {
    let wrong = |text: String| InputError::plain(text, None);
    let mut context = TestContext::new(module.to_owned(), arguments.level, arguments.seed, &arguments.sets)
        .map_err(wrong)?;
    context.program = std::env::current_exe().ok();
    if let Some(word) = &arguments.remote_run {
        let remote_run = RemoteRun::parse(word, arguments.state.as_deref());
        let remote_run =
            remote_run.ok_or_else(|| wrong(format!("`{word}` is no remote run: write FROM,TO,VARIANT")))?;
        let bits =
            run_remote(&context, &remote_run).map_err(|stop| wrong(Outcome::of(Err(stop)).detail()))?;
        if let Some(file) = &arguments.result {
            write(file, &serde_json::to_string(&bits).unwrap_or_default())?;
        }
        return Ok(Exit::Done);
    }
    let mut good = true;
    let names = match arguments.only.as_slice() {
        [] => catalogue().iter().filter(|t| t.level <= arguments.level).map(|t| t.name.to_owned()).collect(),
        some => some.to_vec(),
    };
    for name in names {
        let outcome = run_here(&name, &context).map_err(wrong)?;
        good &= !outcome.is_broken();
        match &arguments.result {
            None => outln!("{name}: {} {}", outcome.word(), outcome.detail()),
            Some(file) => {
                let kind = (name == catalogue()[0].name).then(|| context.kind()).flatten();
                let wrong_set = kind.and_then(|_| context.wrong_set());
                let told = Told { outcome, kind, wrong_set };
                write(file, &serde_json::to_string(&told).unwrap_or_default())?;
            }
        }
    }
    Ok(if good { Exit::Done } else { Exit::Failed })
}

fn write(file: &Path, text: &str) -> Result {
    terraglue_subsystem::files::can_create(file)
        .and_then(|()| std::fs::write(file, text))
        .map_err(|source| terraglue_diagnostics::Error::File { path: file.display().to_string(), source })
}
