//! Batteries under load.

use super::*;

fn battery() -> Supply {
    let mut open_circuit = [0.0; POINTS];
    open_circuit[..3].copy_from_slice(&[20.0, 24.0, 28.0]);
    let full = Supply { open_circuit, points: 3, resistance: 0.5, capacity: 3600.0, ..Supply::ideal(28.0) };
    Supply { charge: 1.0, ..full }
}

#[test]
fn voltage_sags_by_the_closed_form_and_charge_is_counted() {
    let mut b = battery();
    let draw = Draw { power: 100.0, ..Draw::default() };
    let u0 = b.open_circuit_v();
    b.advance(&draw, 1e-3);
    let current = (u0 - (u0 * u0 - 4.0 * 0.5 * 100.0_f64).sqrt()) / (2.0 * 0.5);
    assert!((b.current - current).abs() < 1e-12 && (b.voltage - (u0 - 0.5 * current)).abs() < 1e-12);
    assert!((1.0 - b.charge - current * 1e-3 / 3600.0).abs() < 1e-15);
    // Energy of the chemistry is the delivered one plus the loss in the resistance.
    assert!((u0 * current * 1e-3 - b.delivered - b.lost).abs() < 1e-12);
}

#[test]
fn starved_motors_settle_at_the_divider_however_weak_the_battery_is() {
    let mut b = Supply { resistance: 5.0, ..battery() };
    // A stalled motor of 0.5 Ω takes U/0.5.
    for _ in 0..3 {
        let power = b.limit * b.limit / 0.5;
        b.advance(&Draw { power, starved: power, conductance: 2.0 }, 1e-3);
    }
    assert!((b.limit / (28.0 * 0.5 / 5.5) - 1.0).abs() < 1e-4, "{}", b.limit);
}

#[test]
fn what_it_cannot_give_is_said() {
    let mut b = battery();
    b.advance(&Draw { power: 1000.0, ..Draw::default() }, 1.0);
    assert!((b.missing - (1000.0 - 28.0 * 28.0 / 2.0)).abs() < 1e-9 && b.voltage == 14.0);
    b.charge = 0.0;
    assert_eq!(b.open_circuit_v(), 0.0);
}
