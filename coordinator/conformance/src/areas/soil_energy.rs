//! The ledger of a soil: heat and stored energy are the work at its ports, whatever its contacts do, and heat stays heat.

use crate::definition::Test;
use crate::finding::{Stop, Verdict};
use crate::fixture::{Flat, Foot, SoilFixture};
use crate::scope::{Area, Level};
use crate::test_context::TestContext;
use terraglue_subsystem::{Energy, Kind};

const fn test(name: &'static str, promise: &'static str, run: fn(&TestContext) -> Verdict) -> Test {
    let (area, level, after) = (Area::Physics, Level::Quick, &["steps"]);
    Test { name, area, level, kinds: &[Kind::Soil], after, promise, run }
}

/// The tests of this area.
pub const TESTS: &[Test] = {
    &[
        test("energy-balance", "heat and stored energy are the work at the ports, on three grids", balance),
        test("heat-stays", "what has become heat does not come back, on three grids", heat_stays),
    ]
};

/// Distances of the nodes of the ground, m.
const GRIDS: [f64; 3] = [0.02, 0.01, 0.005];
/// Length of a step, s.
const H: f64 = 1e-3;
/// Error of the ledger that passes: a share of the work that was done to and fro, or rounding, J.
const SHARE: f64 = 0.01;
const ROUNDING_J: f64 = 1e-9;

/// So many steps with this velocity (m/s) and rate of turn (rad/s).
type Phase = (&'static str, usize, [f64; 3], [f64; 3]);

/// A body with what it does.
struct Way {
    foot: fn() -> Foot,
    phases: &'static [Phase],
}

const STILL: [f64; 3] = [0.0; 3];

const WAYS: [Way; 3] = [
    Way {
        foot: || Foot::plate(0.0, 0.0),
        phases: &[
            ("a plate pressed", 40, [0.0, 0.0, -0.2], STILL),
            ("a plate dragged", 60, [0.8, 0.6, 0.0], STILL),
            ("a plate twisted", 50, STILL, [0.0, 0.0, 8.0]),
            ("a plate lifted", 40, [0.0, 0.0, 0.3], STILL),
        ],
    },
    Way {
        foot: || Foot::sphere(0.0, 0.0),
        phases: &[
            ("a sphere pressed", 40, [0.0, 0.0, -0.2], STILL),
            ("a sphere dragged", 60, [0.6, -0.8, 0.0], STILL),
            ("a sphere pressed while dragged", 20, [-0.3, 0.0, -0.1], STILL),
            ("a sphere lifted", 50, [0.0, 0.0, 0.3], STILL),
        ],
    },
    Way {
        foot: || Foot::wheel(0.0, 0.0),
        phases: &[
            ("a wheel pressed", 40, [0.0, 0.0, -0.2], STILL),
            // Its axis is y: 0.2 m/s at 15° to its plane, with a slip of 0.2.
            ("a wheel rolled askew", 150, [0.193, 0.052, 0.0], [0.0, 4.03, 0.0]),
            ("a wheel braked", 40, [0.2, 0.0, 0.0], STILL),
            ("a wheel lifted", 50, [0.0, 0.0, 0.3], STILL),
        ],
    },
];

/// Work and energies up to a step.
struct Shown {
    /// The motion in this step, in words.
    given: String,
    /// Whether it is the first of a soil.
    first: bool,
    /// Work on the soil so far, by its own answers, J.
    work: f64,
    /// Its sum to and fro, J.
    path: f64,
    /// The ledger since the start.
    ledger: Energy,
}

/// Goes all ways on all grids and shows every step.
fn each_step(context: &TestContext, mut look: impl FnMut(Shown) -> Verdict) -> Verdict {
    let module = context.module()?;
    for spacing in GRIDS {
        let ground = Flat { spacing, ..Flat::LEVEL };
        for way in &WAYS {
            go(SoilFixture::on(context, &module, ground, &[(way.foot)()])?, way, spacing, &mut look)?;
        }
    }
    Ok(())
}

fn go(mut fixture: SoilFixture, way: &Way, spacing: f64, look: &mut impl FnMut(Shown) -> Verdict) -> Verdict {
    let start = fixture.soil.energy()?;
    if !start.is_known() {
        return Err(Stop::Skip("it keeps no energy ledger: reports show its energy as unknown".into()));
    }
    let (mut work, mut path, mut first) = (0.0, 0.0, true);
    for (what, steps, velocity, turn) in way.phases {
        fixture.turning = *turn;
        for _ in 0..*steps {
            fixture.go(&[*velocity], H)?;
            work += fixture.work();
            path += fixture.work().abs();
            let now = fixture.soil.energy()?;
            let ledger = Energy {
                potential: now.potential - start.potential,
                dissipated: now.dissipated - start.dissipated,
                port_work: now.port_work - start.port_work,
                ..now
            };
            let given = format!("{what}, nodes {} mm apart, t = {:.3} s", 1e3 * spacing, fixture.t);
            look(Shown { given, first, work, path, ledger })?;
            first = false;
        }
    }
    Ok(())
}

/// Whether a difference is tolerated; one that is no number is not.
fn within(difference: f64, tolerated: f64) -> bool {
    difference.abs() <= tolerated
}

fn balance(context: &TestContext) -> Verdict {
    each_step(context, |Shown { given, work, path, ledger, .. }| {
        let tolerated = (SHARE * path).max(ROUNDING_J);
        let held = ledger.dissipated + ledger.potential;
        let of = format!("by 1 % of the {path:.4e} J that went to and fro");
        if !within(held - ledger.port_work, tolerated) {
            let got = format!(
                "heat {:.4e} J and stored {:.4e} J, {:+.3e} J beside `port_work`",
                ledger.dissipated,
                ledger.potential,
                held - ledger.port_work
            );
            let expected = format!("`port_work` = {:.4e} J, {of}", ledger.port_work);
            return Err(Stop::fail("energy", given, got, expected));
        }
        if !within(ledger.port_work - work, tolerated) {
            let got = format!("`port_work` = {:.4e} J", ledger.port_work);
            let expected = format!("{work:.4e} J, its answers times the motions, {of}");
            return Err(Stop::fail("energy", given, got, expected));
        }
        Ok(())
    })
}

fn heat_stays(context: &TestContext) -> Verdict {
    let mut before = 0.0;
    each_step(context, |Shown { given, first, ledger, .. }| {
        let fell = if first { -ledger.dissipated } else { before - ledger.dissipated };
        before = ledger.dissipated;
        if fell > ROUNDING_J {
            let got = format!("`dissipated` fell by {fell:.4e} J in a step");
            return Err(Stop::fail("energy", given, got, "heat never falls"));
        }
        Ok(())
    })
}
