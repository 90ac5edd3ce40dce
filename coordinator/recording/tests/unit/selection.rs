//! Which variables a scenario wants recorded.

use super::*;

#[test]
fn digits_are_held() {
    for digits in 3..=17 {
        let precision = Precision::digits(digits);
        for value in [1.0, -2.5e-7, std::f64::consts::PI, 9.999_999_999_999e9, f64::MAX, f64::MIN_POSITIVE] {
            let error = ((precision.of(value) - value) / value).abs();
            assert!(error <= 0.5 * libm::pow(10.0, -(digits as f64) + 1.0), "{digits}: {value} {error}");
            assert!(digits < 16 || error == 0.0);
        }
    }
    assert_eq!(Precision::digits(11).of(0.1 + 0.2), Precision::digits(11).of(0.3));
    assert!(Precision::digits(5).of(f64::INFINITY).is_infinite() && Precision::digits(5).of(-0.0) == 0.0);
}

#[test]
fn a_pattern_names_a_variable_or_a_group() {
    assert!(names("robot", "robot.LF_j2.angle") && names("robot.*_j2", "robot.LF_j2.angle"));
    assert!(names("*.*.angle", "robot.LF_j2.angle") && names("a.feet.position", "a.feet.position[2,1]"));
    assert!(!names("rob", "robot.x") && !names("robot.LF", "robot.LF_j2.angle"));
}
