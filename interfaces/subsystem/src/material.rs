//! Materials of shapes, as far as sensors see them.

/// Class of a surface, a number that crosses every border. Numbers from [`MaterialClass::FREE`] on are the modules'
/// own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct MaterialClass(pub u32);

impl MaterialClass {
    /// Not specified.
    pub const UNKNOWN: Self = Self(0);
    /// Metal.
    pub const METAL: Self = Self(1);
    /// Rock.
    pub const ROCK: Self = Self(2);
    /// Loose ground.
    pub const SOIL: Self = Self(3);
    /// Wood, e.g. a stem.
    pub const WOOD: Self = Self(4);
    /// Leaves and needles.
    pub const FOLIAGE: Self = Self(5);
    /// Glass.
    pub const GLASS: Self = Self(6);
    /// Water.
    pub const WATER: Self = Self(7);
    /// The first number without a meaning of its own.
    pub const FREE: Self = Self(16);

    /// The classes with a name.
    pub const NAMES: [(Self, &'static str); 8] = [
        (Self::UNKNOWN, "unknown"),
        (Self::METAL, "metal"),
        (Self::ROCK, "rock"),
        (Self::SOIL, "soil"),
        (Self::WOOD, "wood"),
        (Self::FOLIAGE, "foliage"),
        (Self::GLASS, "glass"),
        (Self::WATER, "water"),
    ];

    /// Its name, where it has one.
    pub fn name(self) -> Option<&'static str> {
        Self::NAMES.iter().find(|(class, _)| *class == self).map(|(_, name)| *name)
    }
}

/// Optical properties of a surface.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Its class: a [`MaterialClass`].
    pub class: u32,
    /// Part of the light that comes back, 0 … 1.
    pub reflectance: f32,
    /// Part of the light that passes through, 0 … 1; with the reflectance at most 1.
    pub transmittance: f32,
}

impl Material {
    /// Nothing is known: half of the light comes back and none passes.
    pub const UNKNOWN: Self = Self::of(MaterialClass::UNKNOWN, 0.5);

    /// Of that class; no light passes.
    pub const fn of(class: MaterialClass, reflectance: f32) -> Self {
        Self { class: class.0, reflectance, transmittance: 0.0 }
    }

    /// Why the numbers make no sense; none where they do.
    pub fn wrong(&self) -> Option<&'static str> {
        let part = |x: f32| (0.0..=1.0).contains(&x);
        let sound = part(self.reflectance) && part(self.transmittance);
        // allowance for the f32 rounding of two decimal numbers that add up to one
        let sound = sound && self.reflectance + self.transmittance <= 1.0 + 1e-6;
        (!sound).then_some("reflectance and transmittance lie from 0 to 1 and add up to at most 1")
    }
}

impl Default for Material {
    fn default() -> Self {
        Self::UNKNOWN
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_light_add_up_to_one_at_most() {
        let leaf = |reflectance, transmittance| Material { class: 5, reflectance, transmittance };
        assert_eq!(leaf(0.3, 0.7).wrong(), None);
        for odd in [leaf(0.5, 0.6), leaf(-0.1, 0.0), leaf(f32::NAN, 0.0), leaf(0.0, f32::INFINITY)] {
            assert!(odd.wrong().is_some(), "{odd:?}");
        }
        assert_eq!((MaterialClass(5).name(), MaterialClass(99).name()), (Some("foliage"), None));
    }
}
