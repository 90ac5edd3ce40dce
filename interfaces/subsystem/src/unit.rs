//! Units as exponents of the SI base units, so that connections can be checked and converted.

/// A unit: base-unit exponents, factor and offset to SI. value_si = value·factor + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// Exponents of kg, m, s, A, K, mol, cd, rad.
    pub exponents: [i8; 8],
    /// Factor to SI.
    pub factor: f64,
    /// Offset to SI.
    pub offset: f64,
}

/// A text that is not a unit.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("`{symbol}` is not a unit{hint}")]
pub struct UnknownUnit {
    /// The part that was not understood.
    pub symbol: String,
    hint: String,
}

const SYMBOLS: &[(&str, [i8; 8], f64)] = &[
    ("1", [0, 0, 0, 0, 0, 0, 0, 0], 1.0),
    ("kg", [1, 0, 0, 0, 0, 0, 0, 0], 1.0),
    ("g", [1, 0, 0, 0, 0, 0, 0, 0], 1e-3),
    ("m", [0, 1, 0, 0, 0, 0, 0, 0], 1.0),
    ("mm", [0, 1, 0, 0, 0, 0, 0, 0], 1e-3),
    ("cm", [0, 1, 0, 0, 0, 0, 0, 0], 1e-2),
    ("km", [0, 1, 0, 0, 0, 0, 0, 0], 1e3),
    ("s", [0, 0, 1, 0, 0, 0, 0, 0], 1.0),
    ("ms", [0, 0, 1, 0, 0, 0, 0, 0], 1e-3),
    ("min", [0, 0, 1, 0, 0, 0, 0, 0], 60.0),
    ("h", [0, 0, 1, 0, 0, 0, 0, 0], 3600.0),
    ("A", [0, 0, 0, 1, 0, 0, 0, 0], 1.0),
    ("K", [0, 0, 0, 0, 1, 0, 0, 0], 1.0),
    ("mol", [0, 0, 0, 0, 0, 1, 0, 0], 1.0),
    ("cd", [0, 0, 0, 0, 0, 0, 1, 0], 1.0),
    ("rad", [0, 0, 0, 0, 0, 0, 0, 1], 1.0),
    ("deg", [0, 0, 0, 0, 0, 0, 0, 1], std::f64::consts::PI / 180.0),
    ("N", [1, 1, -2, 0, 0, 0, 0, 0], 1.0),
    ("kN", [1, 1, -2, 0, 0, 0, 0, 0], 1e3),
    ("J", [1, 2, -2, 0, 0, 0, 0, 0], 1.0),
    ("W", [1, 2, -3, 0, 0, 0, 0, 0], 1.0),
    ("Pa", [1, -1, -2, 0, 0, 0, 0, 0], 1.0),
    ("kPa", [1, -1, -2, 0, 0, 0, 0, 0], 1e3),
    ("Hz", [0, 0, -1, 0, 0, 0, 0, 0], 1.0),
    ("V", [1, 2, -3, -1, 0, 0, 0, 0], 1.0),
    ("ohm", [1, 2, -3, -2, 0, 0, 0, 0], 1.0),
    ("C", [0, 0, 1, 1, 0, 0, 0, 0], 1.0),
    ("F", [-1, -2, 4, 2, 0, 0, 0, 0], 1.0),
    ("H", [1, 2, -2, -2, 0, 0, 0, 0], 1.0),
];

impl Unit {
    /// A pure number.
    pub const ONE: Self = Self { exponents: [0; 8], factor: 1.0, offset: 0.0 };

    /// Reads `N m`, `kg m^2`, `rad/s`, `m/s^2`, `N m s/rad`, `A/(N m)`. Everything after a `/` divides, up to the end,
    /// with or without parentheses. `× 0.3048` and `+ 273.15` at the end are a factor and an offset to SI.
    ///
    /// # Errors
    /// [`UnknownUnit`] with the symbol that is not known.
    pub fn parse(text: &str) -> Result<Self, UnknownUnit> {
        if let Some((symbols, rest)) = text.split_once('×') {
            let (factor, offset) = rest.split_once(" + ").unwrap_or((rest, "0"));
            let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite());
            let unit = Self::parse(symbols)?;
            let both = number(factor).filter(|f| *f != 0.0).zip(number(offset));
            let (factor, offset) = both.ok_or_else(|| unknown(rest))?;
            return Ok(Self { factor: unit.factor * factor, offset, ..unit });
        }
        if text.trim() == "degC" {
            return Ok(Self { offset: 273.15, ..Self::parse("K")? });
        }
        let mut unit = Self::ONE;
        for (part, side) in text.split('/').enumerate() {
            for symbol in side.split([' ', '*', '.', '(', ')']).filter(|s| !s.is_empty()) {
                unit.multiply(symbol, if part == 0 { 1 } else { -1 })?;
            }
        }
        Ok(unit)
    }

    fn multiply(&mut self, symbol: &str, sign: i8) -> Result<(), UnknownUnit> {
        let (name, power) = match symbol.split_once('^') {
            Some((name, power)) => (name, power.parse::<i8>().map_err(|_| unknown(symbol))?),
            None => (symbol, 1),
        };
        let (_, exponents, factor) =
            SYMBOLS.iter().find(|(s, ..)| *s == name).ok_or_else(|| unknown(symbol))?;
        for (sum, e) in self.exponents.iter_mut().zip(exponents) {
            *sum = sum.saturating_add(e.saturating_mul(power).saturating_mul(sign));
        }
        self.factor *= factor.powi(i32::from(power) * i32::from(sign));
        Ok(())
    }

    /// Whether values can be converted between the two.
    pub fn same_dimension(&self, other: &Self) -> bool {
        self.exponents == other.exponents
    }

    /// (a, b) so that value_in_target = a·value_in_self + b.
    pub fn conversion_to(&self, target: &Self) -> Option<(f64, f64)> {
        self.same_dimension(target)
            .then(|| (self.factor / target.factor, (self.offset - target.offset) / target.factor))
    }
}

impl std::fmt::Display for Unit {
    /// In SI symbols, so that [`Unit::parse`] reads the same unit again.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        const BASE: [&str; 8] = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];
        let powers = self.exponents.iter().zip(BASE).filter(|(e, _)| **e != 0);
        let powers: Vec<String> =
            powers.map(|(e, name)| if *e == 1 { name.to_owned() } else { format!("{name}^{e}") }).collect();
        f.write_str(&if powers.is_empty() { "1".to_owned() } else { powers.join(" ") })?;
        if self.factor != 1.0 || self.offset != 0.0 {
            write!(f, " × {:?} + {:?}", self.factor, self.offset)?;
        }
        Ok(())
    }
}

fn unknown(symbol: &str) -> UnknownUnit {
    let near = SYMBOLS.iter().map(|(s, ..)| *s).min_by_key(|s| strsim::damerau_levenshtein(s, symbol));
    let hint = near.map(|s| format!("; did you mean `{s}`?")).unwrap_or_default();
    UnknownUnit { symbol: symbol.into(), hint }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_and_quotients_are_read() {
        let n_m = Unit::parse("N m").expect("known");
        let joule = Unit::parse("J").expect("known");
        assert!(n_m.same_dimension(&joule));
        assert_eq!(Unit::parse("kg m^2/s^2").expect("known").exponents, joule.exponents);
    }

    #[test]
    fn what_is_written_is_read_again() {
        for text in
            ["1", "N m", "deg", "degC", "kg m^2/s^3", "m × 0.3048", "K × 0.5555555555555556 + 255.372"]
        {
            let unit = Unit::parse(text).expect("known");
            assert_eq!(Unit::parse(&unit.to_string()), Ok(unit), "{text}");
        }
        let (a, b) = Unit::parse("K × 0.5 + 250.0")
            .expect("good")
            .conversion_to(&Unit::parse("K").expect("K"))
            .expect("same");
        assert_eq!((a, b), (0.5, 250.0));
        assert!(Unit::parse("m × zero").is_err() && Unit::parse("m × 0").is_err());
    }

    #[test]
    fn degrees_become_radians_and_metres_do_not() {
        let rad = Unit::parse("rad").expect("known");
        let (a, b) = Unit::parse("deg").expect("known").conversion_to(&rad).expect("same");
        assert!((a * 180.0 - std::f64::consts::PI).abs() < 1e-15 && b == 0.0);
        assert_eq!(Unit::parse("m").expect("known").conversion_to(&rad), None);
        assert!(Unit::parse("furlong").expect_err("unknown").to_string().contains("did you mean"));
    }
}
