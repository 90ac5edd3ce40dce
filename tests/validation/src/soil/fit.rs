//! Real plates: the laws fitted to presses of two discs into Direct-90 sand, and predictions of one box by the other.

use crate::process::{Outcome, root};
use crate::{Context, Figure, Limit};
use terraglue::soil_fit::{Known, fit_law, read};
use terraglue_numerics::extremes::larger;
use terraglue_soil_identification::{FitLaw, Reading, fit};

const FILE: &str = "tests/reference/terramechanics/cmu_plate_pressure_sinkage_d60_d100.csv";
/// Below this sinkage the plates are not seated, m.
const FROM: f64 = 3e-3;
/// Direct-90 sand: density measured, cohesion as in the source of the data.
const SAND: Known = Known { c_pa: Some(1000.0), phi_rad: None, shear_m: None, density: Some(1330.0) };

const BEARING: FitLaw = FitLaw::Bearing { reference: terraglue::soil_fit::REFERENCE_DEPTH };

/// Why the two oldest laws have no limit.
const FALLS: &str = "; for comparison only: with factors that are not negative its pressure falls with the size of a plate where \
                     n > 1, and that of this sand rises";

/// All figures.
pub fn figures(_: &Context) -> Outcome<Vec<Figure>> {
    let tests = read(&root().join(FILE), FROM).map_err(|e| e.to_string())?;
    let mut all = Vec::new();
    for (law, limit, aside) in
        [("bearing", Limit::AtMost(10.0), ""), ("reece", Limit::None, FALLS), ("bekker", Limit::None, FALLS)]
    {
        let fitted = fit_law(law, &tests, SAND).map_err(|e| e.to_string())?;
        let what = format!(
            "rms of ln(p/p_measured), %, law `{law}` with one set for discs of 60 and 100 mm, {} readings{aside}",
            tests.readings.len()
        );
        all.push(Figure::new(format!("soil.fit.{law}"), 100.0 * fitted.fit.rms, limit, what));
    }
    all.extend(unseen_diameters(&tests.readings)?);
    all.push(unseen_presses(&tests.readings)?);
    Ok(all)
}

/// Fit to the discs of one diameter, error on the other ones. One size cannot separate cohesion and width, so the fit
/// takes the pressure in proportion to the width: the size effect of the law itself is compared with the unseen discs.
fn unseen_diameters(readings: &[Reading]) -> Outcome<Vec<Figure>> {
    let mut radii: Vec<f64> = readings.iter().map(|r| r.b).collect();
    radii.sort_by(f64::total_cmp);
    radii.dedup();
    let of = |radius: &f64| {
        let (unseen, seen): (Vec<Reading>, Vec<Reading>) = readings.iter().partition(|r| r.b == *radius);
        let numbers = fit(BEARING, &seen, true).map_err(|e| e.to_string())?.numbers;
        let mm = 2e3 * radius;
        let what = format!(
            "rms of ln(p/p_measured), %, of law `bearing` on all {} readings of the disc of {mm:.0} mm, fitted to the others",
            unseen.len()
        );
        let rms = 100.0 * numbers.rms(&BEARING, &unseen);
        Ok(Figure::new(format!("soil.fit.unseen_diameter.{mm:.0}mm"), rms, Limit::AtMost(15.0), what))
    };
    radii.iter().map(of).collect()
}

/// Fit to all presses but one, error on that one; the worst.
fn unseen_presses(readings: &[Reading]) -> Outcome<Figure> {
    let presses = readings.iter().map(|r| r.curve + 1).max().unwrap_or(0);
    let mut worst = 0.0_f64;
    for press in 0..presses {
        let (unseen, seen): (Vec<Reading>, Vec<Reading>) = readings.iter().partition(|r| r.curve == press);
        let numbers = fit(BEARING, &seen, true).map_err(|e| e.to_string())?.numbers;
        worst = larger(worst, numbers.rms(&BEARING, &unseen));
    }
    let what = format!(
        "largest rms of ln(p/p_measured), %, on a press left out of the fit, {presses} presses; for information: it is the \
             scatter between equal presses, this one is 18 % softer than its five like, and no law knows of it"
    );
    Ok(Figure::new("soil.fit.unseen_press", 100.0 * worst, Limit::None, what))
}
