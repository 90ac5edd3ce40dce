//! Small pieces of HTML: escaped text, numbers with units.

/// Shorter ways and smaller angles are rounding, m or rad.
const NOISE: f64 = 1e-6;

/// Text that may stand anywhere in HTML.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c => out.push(c),
        }
    }
    out
}

/// A number with `digits` significant digits; powers of ten as such, a true minus sign.
pub fn number(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if !value.is_finite() {
        return "–".into();
    }
    let scientific = format!("{:.*e}", digits.saturating_sub(1), value);
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let text = if (-4..6).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{mantissa}\u{2009}×\u{2009}10{}", superscript(exponent))
    };
    text.replace('-', "−")
}

fn superscript(n: i32) -> String {
    n.to_string()
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            c => c.to_digit(10).and_then(|d| char::from_u32(0x2070 + d)).unwrap_or(c),
        })
        .collect()
}

/// A way or an angle, m or rad, or 0 where it is rounding.
pub fn without_rounding(value: f64) -> f64 {
    if value.abs() < NOISE { 0.0 } else { value }
}

/// A number in the SI prefix that suits it: (text, unit).
pub fn with_prefix(value: f64, unit: &str, digits: usize) -> (String, String) {
    const PREFIXES: [(&str, f64); 8] = [
        ("M", 1e6),
        ("k", 1e3),
        ("", 1.0),
        ("m", 1e-3),
        ("µ", 1e-6),
        ("n", 1e-9),
        ("p", 1e-12),
        ("f", 1e-15),
    ];
    if value == 0.0 || !value.is_finite() {
        return (number(value, digits), unit.into());
    }
    let fits = PREFIXES.iter().find(|(_, factor)| value.abs() >= *factor * 0.99995);
    match fits {
        Some((prefix, factor)) => (number(value / factor, digits), format!("{prefix}{unit}")),
        None => (number(value, digits), unit.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        assert_eq!(number(-1.23456, 3), "−1.23");
        assert_eq!(number(1.5e-12, 2), "1.5\u{2009}×\u{2009}10⁻¹²");
        assert_eq!(number(12345.6, 3), "12346");
        assert_eq!(with_prefix(0.0123, "m", 3), ("12.3".into(), "mm".into()));
        assert_eq!(with_prefix(1530.0, "J", 3), ("1.53".into(), "kJ".into()));
        assert_eq!(escape("<a & \"b\">"), "&lt;a &amp; &quot;b&quot;&gt;");
    }
}
