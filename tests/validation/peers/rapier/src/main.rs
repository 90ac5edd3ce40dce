//! Rapier on the cases of `cargo xtask validate rigid-body`: one line per figure, `name<TAB>value<TAB>what`.
//!
//! Usage: peer-rapier REFERENCE_FOLDER HEXAPOD.urdf. Steps of 1 ms, double precision, joints as impulse joints (maximal
//! coordinates, as ours), Rapier's own settings otherwise.

mod robot;
mod small;
mod walk;

use std::path::Path;
use std::process::ExitCode;

/// Success, or why not.
pub type Outcome<T = ()> = Result<T, String>;

/// Prints a figure.
pub fn figure(name: &str, value: f64, what: &str) {
    println!("{name}\t{value:e}\t{what}");
}

/// CPU time of this thread so far, s.
pub fn cpu_s() -> f64 {
    let t = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
}

fn measure(folder: &Path, hexapod: &Path) -> Outcome {
    let numbers = rapier3d_f64::VERSION.split('.').map(|n| n.parse::<f64>().unwrap_or(0.0));
    figure("version", numbers.fold(0.0, |all, n| 1000.0 * all + n), rapier3d_f64::VERSION);
    let gait = folder.join("gait_tripod.csv");
    walk::walk(hexapod, &gait, "soft", false)?;
    walk::walk(hexapod, &gait, "stiff", true)?;
    small::contacts();
    small::spin();
    let alternating = |k: usize| if k % 2 == 1 { 0.2 } else { 0.0 };
    let hanging = |k: usize| if k == 0 { -1.0707963267948966 } else { 0.0 };
    small::chain(folder, "chain8", alternating, [-1.640621154, -0.580129864, -0.919078146])?;
    small::chain(folder, "chain8_m1000", hanging, [-0.566796969, 0.0, -1.918003510])
}

fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1);
    let (Some(folder), Some(hexapod)) = (arguments.next(), arguments.next()) else {
        eprintln!("usage: peer-rapier REFERENCE_FOLDER HEXAPOD.urdf");
        return ExitCode::FAILURE;
    };
    match measure(folder.as_ref(), hexapod.as_ref()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::FAILURE
        }
    }
}
