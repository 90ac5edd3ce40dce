//! Modules broken on purpose: each mistake is found by the test that is meant for it, and the same module without the
//! mistake passes everything.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use terraglue_conformance::{Options, Report, check};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/modules/broken")
}

/// A line of defects.tsv.
struct Defect {
    source: String,
    test: String,
    switches: Vec<String>,
    what: String,
}

fn defects() -> Vec<Defect> {
    let text = std::fs::read_to_string(folder().join("defects.tsv")).expect("the list of defects");
    let row = |line: &str| {
        let cells: Vec<&str> = line.split('\t').collect();
        let [source, test, switches, what] = cells[..] else { panic!("four cells: {line}") };
        let switches = switches.split(',').map(str::to_owned).collect();
        Defect { source: source.into(), test: test.into(), switches, what: what.into() }
    };
    text.lines().skip(1).map(row).collect()
}

/// Compiles a module with these switches into a folder of its own.
fn compiled(into: &Path, source: &str, switches: &[String]) -> PathBuf {
    let place = into.join(format!("{source}-{}", switches.join("-")));
    std::fs::create_dir_all(&place).expect("folder");
    let library = place.join(format!("libbroken_{source}_plugin.so"));
    let include = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../interfaces/plugin/include");
    let mut cc = Command::new("cc");
    cc.args(["-std=gnu11", "-O1", "-w", "-fPIC", "-shared", "-I"]).arg(include);
    for switch in switches {
        cc.arg(if switch == "WITH_FIELD" { "-DWITH_FIELD=1".into() } else { format!("-DBROKEN_{switch}=1") });
    }
    cc.arg(folder().join(format!("{source}.c"))).arg("-o").arg(&library).args(["-lm", "-lpthread"]);
    let done = cc.output().expect("the system's C compiler `cc`");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    library
}

fn checked(library: &Path, only: &[&str]) -> Report {
    let mut options = Options::new(env!("CARGO_BIN_EXE_terraglue").into());
    options.only = only.iter().map(|n| (*n).to_owned()).collect();
    options.jobs = 1;
    options.limit_s = if only == ["steps"] { 2.0 } else { 30.0 };
    check(library, &options).expect("checked")
}

#[test]
fn every_broken_module_is_caught_by_the_test_meant_for_it() {
    let (all, into) = (defects(), tempfile::tempdir().expect("folder"));
    assert!(all.len() >= 40, "{} defects", all.len());
    let (next, missed) = (Mutex::new(all.iter()), Mutex::new(Vec::new()));
    let work = || {
        loop {
            let Some(defect) = next.lock().expect("list").next() else { return };
            let library = compiled(into.path(), &defect.source, &defect.switches);
            let report = checked(&library, &[&defect.test]);
            if !report.broken().contains(&defect.test.as_str()) {
                let told: Vec<String> = report
                    .rows
                    .iter()
                    .map(|r| format!("{}: {} {}", r.test, r.outcome.word(), r.outcome.detail()))
                    .collect();
                let (source, test, switches, what) =
                    (&defect.source, &defect.test, defect.switches.join(","), &defect.what);
                missed
                    .lock()
                    .expect("list")
                    .push(format!("{source} {switches} ({what}) by {test}: {told:?}"));
            }
        }
    };
    std::thread::scope(|scope| (0..2).for_each(|_| drop(scope.spawn(work))));
    let missed = missed.into_inner().expect("list");
    assert!(missed.is_empty(), "{} of {} not caught:\n{}", missed.len(), all.len(), missed.join("\n"));
}

#[test]
fn a_library_that_flushes_denormal_numbers_is_one_finding() {
    let into = tempfile::tempdir().expect("folder");
    let switches = ["AT_LOAD", "FLUSHES", "NAN_ANSWER"].map(str::to_owned);
    let report =
        checked(&compiled(into.path(), "soil", &switches), &["host-loading", "steps", "host-floating-point"]);
    assert_eq!(report.broken(), ["host-loading"], "{}", report.text());
}

#[test]
fn their_twins_without_the_mistake_pass() {
    let into = tempfile::tempdir().expect("folder");
    let mut sources: Vec<String> = defects().into_iter().map(|d| d.source).collect();
    sources.dedup();
    for source in sources {
        let variants: &[&[String]] = match source.as_str() {
            "soil" => &[&[], &["WITH_FIELD".to_owned()]],
            "law" => &[&[], &["KEEPS".to_owned()]],
            _ => &[&[]],
        };
        for switches in variants {
            let only: &[&str] = if switches.is_empty() || source == "law" {
                &[]
            } else {
                &["steps", "no-ground-from-nothing", "ground-follows-foot"]
            };
            let report = checked(&compiled(into.path(), &source, switches), only);
            assert!(report.is_good(), "{}", report.text());
        }
    }
}

#[test]
fn every_test_stands_in_the_documents_and_every_defect_names_one() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/plugins/check-module.md");
    let page = std::fs::read_to_string(page).expect("the page of the checker");
    let all = terraglue_conformance::catalogue();
    for test in all {
        let row = format!("| `{}` | {} | {} |", test.name, test.level.word(), test.promise);
        assert!(page.contains(&row), "docs/plugins/check-module.md misses the line\n{row}");
    }
    for defect in defects() {
        assert!(all.iter().any(|t| t.name == defect.test), "there is no test {}", defect.test);
    }
}
