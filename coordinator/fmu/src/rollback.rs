//! Proves that an FMU comes back to the state that it saved, before a strategy relies on it.

use terraglue_fmi::{Advance, Error as FmiError, FmuInstance, FmuState};
use terraglue_subsystem::{Error, Result};

/// Largest relative difference of two equal steps from one state.
const SAME: f64 = 1e-12;

/// Makes a step twice from the state `before`, each with the inputs that `push` sets, compares `outputs` (names and numbers
/// in calls), and goes back. A step that the FMU does not make proves nothing.
///
/// # Errors
/// An output that differs, with its name and by how much.
pub fn prove(
    instance: &mut FmuInstance,
    before: &FmuState,
    outputs: &[(&str, u32)],
    step: Advance,
    mut push: impl FnMut(&mut FmuInstance) -> Result,
    fail: fn(FmiError) -> Error,
) -> Result {
    let references: Vec<u32> = outputs.iter().map(|(_, reference)| *reference).collect();
    let mut ends = [vec![f64::NAN; references.len()], vec![f64::NAN; references.len()]];
    for end in &mut ends {
        push(instance)?;
        let made = instance.do_step(step).is_ok_and(|done| !done.terminate);
        if made && !references.is_empty() {
            instance.get_f64(&references, end).map_err(fail)?;
        }
        instance.restore(before).map_err(fail)?;
        if !made {
            return Ok(());
        }
    }
    let [first, second] = ends;
    let off = |(a, b): (&f64, &f64)| (a - b).abs() / a.abs().max(1.0);
    let worst = first
        .iter()
        .zip(&second)
        .map(off)
        .enumerate()
        .fold((0, 0.0), |worst, (k, off)| if off > worst.1 || off.is_nan() { (k, off) } else { worst });
    if worst.1 <= SAME {
        return Ok(());
    }
    let (k, deviation) = worst;
    Err(Error::Failed(format!(
        "the FMU does not come back to the state that it saved: after the same step `{}` is {} and then {} (relative \
         deviation {deviation:.1e}); it cannot be glued, as a strategy repeats steps",
        outputs[k].0, first[k], second[k]
    )))
}
