//! The worker of a module in Python: the user's interpreter, which runs the files that this program brings.

use super::What;
use std::fs::File;
use std::io;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Files beside a worker, by name: the base class of modules, reading and writing, the loop, and the interpreter that
/// is copied.
pub(super) const FILES: [(&str, &str); 4] = [
    ("terraglue.py", SDK),
    ("terraglue_wire.py", include_str!("../../../../interfaces/plugin/python/terraglue_wire.py")),
    ("terraglue_worker.py", include_str!("../../../../interfaces/plugin/python/terraglue_worker.py")),
    (
        "terraglue_fork_server.py",
        include_str!("../../../../interfaces/plugin/python/terraglue_fork_server.py"),
    ),
];

/// Base class of modules in Python.
pub const SDK: &str = include_str!("../../../../interfaces/plugin/python/terraglue.py");

/// Puts the files of this program first on the path; the working folder is not on it.
pub(super) const TAKE_FILES: &str = "import sys; sys.path[:] = [sys.argv[1]] + [p for p in sys.path if p];";

/// File with the messages of the interpreter itself: faults, and where a module hangs.
const DIARY: &str = "stderr.txt";

/// Longest wait for where a module hangs.
const PATIENCE: Duration = Duration::from_secs(3);

/// The command that serves the segment; None: this is no module in Python.
pub fn command(what: &What, folder: &Path, segment: &str) -> io::Result<Option<Command>> {
    let (What::Python { python, .. } | What::Law { python, .. }) = what else { return Ok(None) };
    for (name, text) in FILES {
        std::fs::write(folder.join(name), text)?;
    }
    let mut command = Command::new(python);
    let run = format!("{TAKE_FILES} import terraglue_worker; terraglue_worker.serve(sys.argv[2])");
    // Compiled copies would be left beside the user's files.
    command.arg("-B").args(["-c", &run]).arg(folder).arg(segment);
    command.stdin(Stdio::piped()).stderr(File::create(folder.join(DIARY))?);
    Ok(Some(command))
}

/// Asks a worker that does not answer where it stands, and gives it time to write that down: up to `PATIENCE` in which
/// this process runs, so that a machine with much to do takes no answer away.
pub fn ask_where(child: u32, folder: &Path) {
    super::channel::ask(child);
    let (mut seen, mut looked) = (Duration::ZERO, Instant::now());
    while seen < PATIENCE && !is_whole(&diary(folder)) {
        std::thread::sleep(Duration::from_millis(10));
        let now = Instant::now();
        seen += (now - looked).min(super::BLINK);
        looked = now;
    }
}

/// Whether the list of calls, innermost first, has come to its end; the interpreter writes at most 100.
fn is_whole(diary: &str) -> bool {
    diary.lines().any(|line| line.ends_with(" in <module>") || line == "  ...")
}

fn diary(folder: &Path) -> String {
    String::from_utf8_lossy(&std::fs::read(folder.join(DIARY)).unwrap_or_default()).into_owned()
}

/// The end of the interpreter's own messages.
pub fn last_words(folder: &Path) -> String {
    let text = diary(folder);
    let own = |line: &&str| {
        FILES.iter().all(|(name, _)| !line.contains(name)) && !line.contains("File \"<string>\"")
    };
    let lines: Vec<&str> = text.lines().filter(|l| !l.trim().is_empty()).filter(own).collect();
    let from = lines.len().saturating_sub(12);
    lines[from..].iter().map(|l| format!("\n{l}")).collect()
}

/// Why an interpreter does not start, and the way out.
pub fn not_started(python: &Path, error: &io::Error) -> String {
    let way = "set `python` in the table of the subsystem to the interpreter that has your packages";
    format!("the interpreter {} does not start: {error}; {way}", python.display())
}
