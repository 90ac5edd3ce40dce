//! Colour by sinkage: undisturbed ground is grey, sinkage runs through amber and red to violet with steadily
//! falling lightness, heave towards blue-green. Interpolated in Oklab (Ottosson, 2020), so equal differences of
//! sinkage look equally different.

/// Colour in Oklab: lightness, green–red, blue–yellow.
pub type Oklab = [f64; 3];

/// Undisturbed ground.
const REST: [u8; 3] = [0xbd, 0xb8, 0xae];
/// Sinkage 1/4, 1/2, 3/4 and all of the scale.
const SUNK: [[u8; 3]; 4] = [[0xd8, 0x9b, 0x4c], [0xc4, 0x57, 0x40], [0x8b, 0x29, 0x5c], [0x2b, 0x10, 0x52]];
/// Heave 1/2 and all of the scale.
const HEAVED: [[u8; 3]; 2] = [[0x6f, 0xa3, 0xa8], [0x1d, 0x6f, 0x86]];

/// Of a channel of sRGB, from 0 to 1.
fn linear(c: f64) -> f64 {
    if c <= 0.040_45 { c / 12.92 } else { libm::pow((c + 0.055) / 1.055, 2.4) }
}

/// From sRGB.
pub fn to_oklab(rgb: [u8; 3]) -> Oklab {
    let [r, g, b] = rgb.map(|c| linear(f64::from(c) / 255.0));
    let l = libm::cbrt(0.412_221_470_8 * r + 0.536_332_536_3 * g + 0.051_445_992_9 * b);
    let m = libm::cbrt(0.211_903_498_2 * r + 0.680_699_545_1 * g + 0.107_396_956_6 * b);
    let s = libm::cbrt(0.088_302_461_9 * r + 0.281_718_837_6 * g + 0.629_978_700_5 * b);
    [
        0.210_454_255_3 * l + 0.793_617_785_0 * m - 0.004_072_046_8 * s,
        1.977_998_495_1 * l - 2.428_592_205_0 * m + 0.450_593_709_9 * s,
        0.025_904_037_1 * l + 0.782_771_766_2 * m - 0.808_675_766_0 * s,
    ]
}

/// The colours of the map, and the way from Oklab to sRGB. Made once for a picture: a pixel costs no power and no root.
pub struct Palette {
    sunk: [Oklab; 5],
    heaved: [Oklab; 3],
    thresholds: [f64; 255],
}

impl Default for Palette {
    fn default() -> Self {
        let of = |k: usize, colours: &[[u8; 3]]| to_oklab(if k == 0 { REST } else { colours[k - 1] });
        Self {
            sunk: std::array::from_fn(|k| of(k, &SUNK)),
            heaved: std::array::from_fn(|k| of(k, &HEAVED)),
            // from here on a channel is rounded up to k + 1
            thresholds: std::array::from_fn(|k| linear((k as f64 + 0.5) / 255.0)),
        }
    }
}

impl Palette {
    fn encoded(&self, c: f64) -> u8 {
        self.thresholds.partition_point(|threshold| *threshold <= c) as u8
    }

    /// To sRGB, clamped to what screens show.
    pub fn to_rgb(&self, lab: Oklab) -> [u8; 3] {
        let [lightness, a, b] = lab;
        let cube = |x: f64| x * x * x;
        let l = cube(lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b);
        let m = cube(lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b);
        let s = cube(lightness - 0.089_484_177_5 * a - 1.291_485_548_0 * b);
        [
            self.encoded(4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s),
            self.encoded(-1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s),
            self.encoded(-0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701_0 * s),
        ]
    }

    /// Colour of a share of the scale: −1 most heave, 0 undisturbed, 1 deepest.
    pub fn colour(&self, share: f64) -> Oklab {
        let stops: &[Oklab] = if share < 0.0 { &self.heaved } else { &self.sunk };
        let place = share.abs().clamp(0.0, 1.0) * (stops.len() - 1) as f64;
        let k = (place as usize).min(stops.len() - 2);
        let f = place - k as f64;
        std::array::from_fn(|i| stops[k][i] + f * (stops[k + 1][i] - stops[k][i]))
    }

    /// The same as `#rrggbb`.
    pub fn hex(&self, share: f64) -> String {
        let [r, g, b] = self.to_rgb(self.colour(share));
        format!("#{r:02x}{g:02x}{b:02x}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_are_rounded_as_srgb_says() {
        let palette = Palette::default();
        let srgb =
            |c: f64| if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * libm::pow(c, 1.0 / 2.4) - 0.055 };
        for k in -100..=10_100 {
            let c = f64::from(k) / 10_000.0;
            assert_eq!(palette.encoded(c), (255.0 * srgb(c.clamp(0.0, 1.0))).round() as u8, "{c}");
        }
    }

    #[test]
    fn oklab_goes_there_and_back() {
        for rgb in [[0, 0, 0], [255, 255, 255], [12, 200, 77], [255, 0, 128]] {
            assert_eq!(Palette::default().to_rgb(to_oklab(rgb)), rgb);
        }
        assert!((to_oklab([255; 3])[0] - 1.0).abs() < 1e-6);
    }

    #[test]
    fn lightness_falls_steadily_with_sinkage() {
        let palette = Palette::default();
        let lightness: Vec<f64> = (0..=100).map(|k| palette.colour(f64::from(k) / 100.0)[0]).collect();
        assert!(lightness.windows(2).all(|w| w[1] < w[0]));
        assert_eq!(palette.hex(0.0), "#bdb8ae");
    }
}
