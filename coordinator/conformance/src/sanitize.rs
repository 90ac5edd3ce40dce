//! `check-module --sanitize`: the sources of a module in C or C++ built with the sanitizers of the system's compiler, put
//! to the tests, and their findings by file and line.
//!
//! The program itself is not built with them: the runtime is loaded ahead of it (`LD_PRELOAD`), so only the module is
//! watched. The results of the tests themselves do not matter here.

use super::options::Options;
use super::supervisor::check;
use super::{Level, Outcome};
use std::path::{Path, PathBuf};
use std::process::Command;

/// A finding of a sanitizer.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Fault {
    /// Source file and line.
    pub place: String,
    /// E.g. `heap-buffer-overflow`, `signed integer overflow: …`.
    pub what: String,
    /// Function; empty where it is not given.
    pub function: String,
    /// The test that came across it.
    pub test: String,
}

/// Results of all sanitizers.
#[derive(Clone, Debug, Default)]
pub struct Sanitized {
    /// Findings, by place.
    pub faults: Vec<Fault>,
    /// Sanitizers that could not run, and why.
    pub skipped: Vec<String>,
    /// Kinds of faults that were looked for.
    pub ran: Vec<&'static str>,
}

/// A way to build and what it finds.
struct Sanitizer {
    switch: &'static str,
    finds: &'static str,
    runtime: &'static str,
    /// Only these tests; none: all of the level.
    tests: &'static [&'static str],
}

const ALL: [Sanitizer; 3] = [
    Sanitizer { switch: "address", finds: "errors of memory", runtime: "libasan.so", tests: &[] },
    Sanitizer { switch: "undefined", finds: "undefined behaviour", runtime: "libubsan.so", tests: &[] },
    Sanitizer { switch: "thread", finds: "data races", runtime: "libtsan.so", tests: &["four-threads"] },
];

/// Endings of sources.
const ENDINGS: [&str; 4] = ["c", "cc", "cpp", "cxx"];

/// The sources that a path means: a source itself, or all of the folder that it is or lies in.
///
/// # Errors
/// There is none.
pub fn sources_of(path: &Path) -> Result<Vec<PathBuf>, String> {
    let is_source = |p: &Path| p.extension().and_then(|e| e.to_str()).is_some_and(|e| ENDINGS.contains(&e));
    if path.is_file() && is_source(path) {
        return Ok(vec![path.to_owned()]);
    }
    let folder = if path.is_dir() { path } else { path.parent().unwrap_or(Path::new(".")) };
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let entries = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut found: Vec<PathBuf> = entries.flatten().map(|e| e.path()).filter(|p| is_source(p)).collect();
    found.sort();
    if found.is_empty() {
        let folder = folder.display();
        return Err(format!(
            "{folder} holds no source in C or C++; name them with --source, or the folder that holds them"
        ));
    }
    Ok(found)
}

/// Builds the sources in every way and runs the tests.
///
/// # Errors
/// The sources do not compile at all, or a test cannot be started.
pub fn sanitize(sources: &[PathBuf], options: &Options) -> Result<Sanitized, String> {
    let folder = tempfile::tempdir().map_err(|e| format!("no folder for the builds: {e}"))?;
    let mut out = Sanitized::default();
    for sanitizer in &ALL {
        let place = folder.path().join(sanitizer.runtime);
        std::fs::create_dir_all(&place).map_err(|e| format!("{}: {e}", place.display()))?;
        let runtime = match available(sanitizer, &place) {
            Ok(runtime) => runtime,
            Err(why) => {
                out.skipped.push(format!("{} are not looked for: {why}", sanitizer.finds));
                continue;
            }
        };
        let library = build(sources, sanitizer, &place)?;
        let logs = place.join("logs");
        std::fs::create_dir_all(&logs).map_err(|e| format!("{}: {e}", logs.display()))?;
        for test in watch(&library, sanitizer, &runtime, &logs, options)? {
            out.skipped
                .push(format!("`{test}` did not come to its end with -fsanitize={}", sanitizer.switch));
        }
        out.ran.push(sanitizer.finds);
        out.faults.extend(found(&logs, sources));
    }
    out.faults.sort();
    out.faults.dedup_by(|a, b| (&a.place, &a.what) == (&b.place, &b.what));
    Ok(out)
}

/// The runtime of a sanitizer, if this compiler has it.
fn available(sanitizer: &Sanitizer, place: &Path) -> Result<PathBuf, String> {
    let asked = Command::new("cc").arg(format!("-print-file-name={}", sanitizer.runtime)).output();
    let asked = asked.map_err(|e| format!("there is no compiler `cc`: {e}"))?;
    let runtime = PathBuf::from(String::from_utf8_lossy(&asked.stdout).trim());
    let probe = place.join("probe.c");
    std::fs::write(&probe, "int probe;\n").map_err(|e| e.to_string())?;
    let built = Command::new("cc")
        .arg(format!("-fsanitize={}", sanitizer.switch))
        .args(["-fPIC", "-shared", "-o"])
        .arg(place.join("probe.so"))
        .arg(&probe)
        .output();
    if runtime.is_absolute() && runtime.is_file() && built.is_ok_and(|b| b.status.success()) {
        return Ok(runtime);
    }
    Err(format!(
        "the compiler `cc` lacks -fsanitize={} (gcc with its runtime library has it)",
        sanitizer.switch
    ))
}

/// Compiles all sources and links the library.
fn build(sources: &[PathBuf], sanitizer: &Sanitizer, place: &Path) -> Result<PathBuf, String> {
    let run = |command: &mut Command| -> Result<(), String> {
        let done =
            command.output().map_err(|e| format!("{:?} cannot be started: {e}", command.get_program()))?;
        match done.status.success() {
            true => Ok(()),
            false => Err(format!(
                "the sources do not compile:\n{}",
                String::from_utf8_lossy(&done.stderr).trim_end()
            )),
        }
    };
    let switch = format!("-fsanitize={}", sanitizer.switch);
    let mut objects = Vec::new();
    let mut linker = "cc";
    for (k, source) in sources.iter().enumerate() {
        let is_c = source.extension().is_some_and(|e| e == "c");
        // The class for C++ marks the one symbol that must be seen; C shows all of them.
        let (compiler, standard, shown, flags) = match is_c {
            true => ("cc", "-std=gnu11", "-fvisibility=default", "CFLAGS"),
            false => ("c++", "-std=gnu++17", "-fvisibility=hidden", "CXXFLAGS"),
        };
        if !is_c {
            linker = "c++";
        }
        let object = place.join(format!("{k}.o"));
        let source = std::path::absolute(source).unwrap_or_else(|_| source.clone());
        let flags = std::env::var(flags).unwrap_or_default();
        let mut compile = Command::new(compiler);
        compile.args([standard, "-g", "-O1", "-fno-omit-frame-pointer", shown, "-fPIC", &switch]);
        run(compile.args(flags.split_whitespace()).arg("-c").arg(&source).arg("-o").arg(&object))?;
        objects.push(object);
    }
    let stem = sources[0].file_stem().and_then(|s| s.to_str()).unwrap_or("module");
    let library = place.join(format!("lib{stem}_plugin.so"));
    run(Command::new(linker)
        .args(["-shared", &switch])
        .args(&objects)
        .arg("-o")
        .arg(&library)
        .args(["-lm", "-lpthread"]))?;
    Ok(library)
}

/// Runs the tests on a library with the runtime of its sanitizer ahead of the program; those that were cut short without a
/// word of the sanitizer.
fn watch(
    library: &Path,
    sanitizer: &Sanitizer,
    runtime: &Path,
    logs: &Path,
    options: &Options,
) -> Result<Vec<&'static str>, String> {
    let log = format!("log_path={}/{{test}}", logs.display());
    let shared = format!("{log}:print_stacktrace=1:detect_leaks=0:handle_segv=1");
    let environment = [
        ("LD_PRELOAD", runtime.display().to_string()),
        ("ASAN_OPTIONS", shared.clone()),
        ("UBSAN_OPTIONS", shared),
        ("TSAN_OPTIONS", format!("{log}:halt_on_error=0:exitcode=0")),
    ];
    let only = match options.only.as_slice() {
        [] => sanitizer.tests.iter().map(|t| (*t).to_owned()).collect(),
        some => some.to_vec(),
    };
    let options = Options {
        only,
        level: options.level.min(Level::Standard),
        limit_s: 4.0 * options.limit_s,
        environment: environment.map(|(k, v)| (k.to_owned(), v)).to_vec(),
        ..options.clone()
    };
    let report = check(library, &options)?;
    let cut = |o: &Outcome| matches!(o, Outcome::Crash { .. } | Outcome::Hang { .. });
    Ok(report.rows.iter().filter(|r| cut(&r.outcome) && !told(logs, r.test)).map(|r| r.test).collect())
}

/// Whether a test has left a log.
fn told(logs: &Path, test: &str) -> bool {
    let mut entries = std::fs::read_dir(logs).into_iter().flatten().flatten();
    entries.any(|e| e.file_name().to_string_lossy().rsplit_once('.').is_some_and(|(name, _)| name == test))
}

/// Findings about these sources in the logs, which are named by the tests.
fn found(logs: &Path, sources: &[PathBuf]) -> Vec<Fault> {
    let mut all = Vec::new();
    for entry in std::fs::read_dir(logs).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let test = name.rsplit_once('.').map_or(name.as_str(), |(test, _)| test);
        let text = std::fs::read(entry.path()).unwrap_or_default();
        all.extend(
            faults(&String::from_utf8_lossy(&text), sources)
                .into_iter()
                .map(|f| Fault { test: test.into(), ..f }),
        );
    }
    all
}

/// Reads a log.
fn faults(text: &str, sources: &[PathBuf]) -> Vec<Fault> {
    let place_of = |word: &str| -> Option<String> {
        let mut parts = word.rsplit(':').collect::<Vec<_>>();
        parts.reverse();
        let file = Path::new(parts.first()?);
        let line = parts.get(1)?;
        let own = sources.iter().any(|s| s.file_name() == file.file_name());
        let folder = |s: &Path| s.parent().is_some_and(|p| file.starts_with(p));
        (own || sources.iter().any(|s| folder(s))).then(|| format!("{}:{line}", file.display()))
    };
    let mut all: Vec<Fault> = Vec::new();
    let mut open: Option<&str> = None;
    for line in text.lines().map(str::trim) {
        if let Some((place, what)) = line.split_once(": runtime error: ") {
            if let Some(place) = place_of(place) {
                all.push(Fault { place, what: what.into(), function: String::new(), test: String::new() });
            }
        } else if let Some(rest) = ["ERROR: AddressSanitizer: ", "WARNING: ThreadSanitizer: "]
            .iter()
            .find_map(|mark| line.split_once(mark).map(|(_, rest)| rest))
        {
            open = Some(rest.split(" on ").next().unwrap_or(rest).split(" (pid").next().unwrap_or(rest));
        } else if let (Some(what), Some(frame)) = (open, line.strip_prefix('#')) {
            let words: Vec<&str> = frame.split_whitespace().collect();
            let at = words.iter().position(|w| place_of(w).is_some());
            if let Some((at, place)) = at.and_then(|at| Some((at, place_of(words[at])?))) {
                let function = words[..at].last().copied().unwrap_or_default();
                all.push(Fault { place, what: what.into(), function: function.into(), test: String::new() });
                open = None;
            }
        } else if let (Some(frame), Some(last)) = (line.strip_prefix("#0 "), all.last_mut()) {
            // The stack below an undefined operation; its place was given already.
            if last.function.is_empty() {
                let named = frame.split_once(" in ").and_then(|(_, rest)| rest.split_whitespace().next());
                last.function = named.unwrap_or_default().into();
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logs_are_read_by_file_and_line() {
        let sources = [PathBuf::from("/m/soil.c")];
        let text = "=====\n==7==ERROR: AddressSanitizer: heap-buffer-overflow on address 0x1 at pc 0x2\n\
            WRITE of size 8 at 0x1 thread T0\n    #0 0x7fc1 in memset (libc.so+0x1)\n    #1 0x7fc1 in law /m/soil.c:96\n\
            #2 0x7fc1 in advance /m/soil.c:154\n\n/m/soil.c:12:5: runtime error: signed integer overflow: 2 + 2\n    #0 0x1 in depth /m/soil.c:12\n\
            WARNING: ThreadSanitizer: data race (pid=7)\n  Read of size 8 by thread T2:\n\
            #0 law /m/soil.c:33 (libx.so+0x1bd0)\n  Previous write by thread T1:\n    #0 law /m/soil.c:34 (libx.so+0x1)\n\
            /other/x.c:1:1: runtime error: nothing of ours\n";
        let found = faults(text, &sources);
        let told: Vec<_> =
            found.iter().map(|f| (f.place.as_str(), f.what.as_str(), f.function.as_str())).collect();
        let wanted = [
            ("/m/soil.c:96", "heap-buffer-overflow", "law"),
            ("/m/soil.c:12", "signed integer overflow: 2 + 2", "depth"),
            ("/m/soil.c:33", "data race", "law"),
        ];
        assert_eq!(told, wanted);
    }
}
