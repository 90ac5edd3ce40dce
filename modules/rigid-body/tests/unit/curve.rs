//! Curves of impulse against rate.

use super::*;

/// Finds (u, λ) with λ = (u − v)·m, the impulse that changes the rate of a mass m from v to u.
fn balance(curve: &Curve, m: f64, v: f64) -> (f64, f64) {
    let mut mode = curve.start(Mode::Free, v);
    for _ in 0..60 {
        let (u, lambda) = match curve.row(mode) {
            Some((c, b)) => {
                let lambda = (b - v) / (c + 1.0 / m);
                (v + lambda / m, lambda)
            }
            None => (v + curve.impulse(mode) / m, curve.impulse(mode)),
        };
        assert!(u.is_finite() && lambda.is_finite(), "{mode:?}: {u} {lambda}");
        let next = curve.next(mode, u, lambda);
        if next == mode {
            return (u, lambda);
        }
        mode = next;
    }
    panic!("no balance for {v}");
}

fn drive() -> Curve {
    let law = Curve::line(Line { at_zero: 1.0, slope: 10.0 }, Tag::Law);
    let bounded = law.at_most(Line { at_zero: 0.6, slope: 0.1 }, Tag::SupplyHigh);
    let bounded = bounded.at_least(Line { at_zero: -0.6, slope: 0.1 }, Tag::SupplyLow);
    let mut all = bounded.through_gear(|driving| if driving { 0.8 } else { 1.0 / 0.7 });
    all = all.at_most(Line::level(0.4), Tag::High).at_least(Line::level(-0.4), Tag::Low);
    all.add_step(0.0, 0.05, -0.05, Tag::Friction);
    all.add_line(Line { at_zero: 0.02, slope: 0.3 });
    all.add_step(-2.0, f64::INFINITY, 0.0, Tag::LowerLimit);
    all.add_step(3.0, 0.0, f64::NEG_INFINITY, Tag::UpperLimit);
    all
}

#[test]
fn a_curve_of_many_parts_falls_everywhere() {
    let curve = drive();
    let mut last = f64::INFINITY;
    for k in -400..600 {
        let u = 0.005 * f64::from(k);
        let (high, low) = curve.span(u);
        assert!(low <= high && high <= last + 1e-12, "{u}: {low} {high} {last}");
        last = low;
    }
}

#[test]
fn the_balance_with_a_mass_is_found_and_lies_on_the_curve() {
    let curve = drive();
    for m in [1e-3, 0.1, 3.0, 1e3] {
        for k in -60..60 {
            let v = 0.1 * f64::from(k) + 0.003;
            let (u, lambda) = balance(&curve, m, v);
            let (high, low) = curve.span(u);
            assert!(lambda <= high + 1e-9 && lambda >= low - 1e-9, "{m} {v}: {u} {lambda} {low} {high}");
            assert!((lambda - m * (u - v)).abs() < 1e-9 * m.max(1.0));
        }
    }
}

#[test]
fn a_gear_scales_by_the_direction_of_the_power() {
    let curve = Curve::line(Line { at_zero: 1.0, slope: 1.0 }, Tag::Law)
        .through_gear(|driving| if driving { 0.5 } else { 4.0 });
    assert_eq!(curve.value(0.5), 0.25);
    assert_eq!(curve.value(2.0), -4.0);
    assert_eq!(curve.value(-1.0), 8.0);
    assert_eq!(curve.span(0.0), (4.0, 0.5));
}

#[test]
fn a_rigid_motor_gives_what_it_needs_up_to_its_bound() {
    let curve = Curve::rigid(1.0, Tag::Law)
        .at_most(Line::level(0.5), Tag::High)
        .at_least(Line::level(-0.5), Tag::Low);
    let (u, lambda) = balance(&curve, 2.0, 0.9);
    assert!((u - 1.0).abs() < 1e-15 && (lambda - 0.2).abs() < 1e-12);
    assert_eq!(balance(&curve, 2.0, 0.0), (0.25, 0.5));
    assert_eq!(curve.value(7.0), -0.5);
}

#[test]
fn an_axis_beyond_a_stop_is_led_back_whatever_its_motor_does() {
    for (stop, side) in [(200.0, 1.0), (-200.0, -1.0)] {
        // a motor of 0.06 N m s at most, with a law that rises to it within a rate of 0.1 rad/s
        let law = Curve::line(Line { at_zero: 0.0, slope: 0.6 }, Tag::Law);
        let mut axis = law.at_most(Line::level(0.06), Tag::High).at_least(Line::level(-0.06), Tag::Low);
        let (left, right) = if side > 0.0 { (f64::INFINITY, 0.0) } else { (0.0, f64::NEG_INFINITY) };
        axis.add_step(stop, left, right, Tag::LowerLimit);
        for rate in [0.0, 0.05, -0.05, 5.0, -5.0, 300.0, -300.0] {
            let mode = axis.start(Mode::Free, rate);
            let (_, wanted) = axis.row(mode).unwrap_or_default();
            assert!(wanted.is_finite() && axis.impulse(mode).is_finite(), "{rate}: {mode:?}");
        }
        let (u, lambda) = balance(&axis, 2.0, 0.0);
        assert!((u - stop).abs() < 1e-12 && lambda.is_finite(), "{u} {lambda}");
    }
}
