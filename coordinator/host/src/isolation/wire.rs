//! Calls and answers as bytes in a shared segment. All of them are checked: the memory of a worker may have been overwritten.

use terraglue_subsystem::{
    Action, BodyRef, BodyState, Causality, Effect, Energy, FeedThrough, FieldInfo, Figure, Geometry,
    JointKind, JointVariables, Law, Material, Node, Overlay, Port, Pose, Ray, RayHit, RayMask, Scene,
    SceneBody, SceneJoint, SceneShape, ShapeRef, StreamInfo, ValueType, Variable,
};

/// Bytes that grow up to the end of an area.
pub struct Writer<'a> {
    area: &'a mut [u8],
    at: usize,
    fits: bool,
}

impl<'a> Writer<'a> {
    pub fn new(area: &'a mut [u8]) -> Self {
        Self { area, at: 0, fits: true }
    }

    pub fn bytes(&mut self, bytes: &[u8]) {
        match self.area.get_mut(self.at..self.at + bytes.len()) {
            Some(place) => place.copy_from_slice(bytes),
            None => self.fits = false,
        }
        self.at += bytes.len();
    }

    pub fn put<T: Put + ?Sized>(&mut self, value: &T) {
        value.put_into(self);
    }

    /// Length, if all of it found room.
    pub fn length(&self) -> Option<usize> {
        self.fits.then_some(self.at)
    }
}

/// Bytes that are read from their start on.
pub struct Reader<'a> {
    bytes: &'a [u8],
}

impl<'a> Reader<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes }
    }

    pub fn bytes(&mut self, count: usize) -> Option<&'a [u8]> {
        let (head, rest) = self.bytes.split_at_checked(count)?;
        self.bytes = rest;
        Some(head)
    }

    pub fn take<T: Wire>(&mut self) -> Option<T> {
        T::take(self)
    }

    /// Numbers into an array of exactly that length.
    pub fn fill(&mut self, out: &mut [f64]) -> Option<()> {
        let count: u32 = self.take()?;
        let bytes = self.bytes(8 * out.len()).filter(|_| count as usize == out.len())?;
        out.iter_mut().zip(bytes.as_chunks::<8>().0).for_each(|(out, b)| *out = f64::from_le_bytes(*b));
        Some(())
    }
}

/// Values that can cross.
pub trait Wire: Sized {
    fn put(&self, w: &mut Writer);
    fn take(r: &mut Reader) -> Option<Self>;
}

macro_rules! numbers {
    ($($t:ty),*) => {$(
        impl Wire for $t {
            fn put(&self, w: &mut Writer) {
                w.bytes(&self.to_le_bytes());
            }
            fn take(r: &mut Reader) -> Option<Self> {
                Some(Self::from_le_bytes(r.bytes(size_of::<Self>())?.try_into().ok()?))
            }
        }
    )*};
}
numbers!(i8, i16, i32, i64, u8, u16, u32, u64, f32, f64);

impl Wire for bool {
    fn put(&self, w: &mut Writer) {
        u8::from(*self).put(w);
    }
    fn take(r: &mut Reader) -> Option<Self> {
        Some(r.take::<u8>()? != 0)
    }
}

/// Values that can be written, slices and texts among them.
pub trait Put {
    fn put_into(&self, w: &mut Writer);
}

impl<T: Wire> Put for T {
    fn put_into(&self, w: &mut Writer) {
        self.put(w);
    }
}

impl<T: Wire> Put for [T] {
    fn put_into(&self, w: &mut Writer) {
        (self.len() as u32).put(w);
        self.iter().for_each(|x| x.put(w));
    }
}

impl Put for str {
    fn put_into(&self, w: &mut Writer) {
        (self.len() as u32).put(w);
        w.bytes(self.as_bytes());
    }
}

impl Wire for String {
    fn put(&self, w: &mut Writer) {
        self.as_str().put_into(w);
    }
    fn take(r: &mut Reader) -> Option<Self> {
        let length: u32 = r.take()?;
        Some(String::from_utf8_lossy(r.bytes(length as usize)?).into_owned())
    }
}

impl<T: Wire> Wire for Vec<T> {
    fn put(&self, w: &mut Writer) {
        self.as_slice().put_into(w);
    }
    fn take(r: &mut Reader) -> Option<Self> {
        let count: u32 = r.take()?;
        // A lie about the count ends with the bytes, not with the memory.
        let mut all = Self::with_capacity((count as usize).min(4096));
        for _ in 0..count {
            all.push(r.take()?);
        }
        Some(all)
    }
}

impl<T: Wire + Copy + Default, const N: usize> Wire for [T; N] {
    fn put(&self, w: &mut Writer) {
        self.iter().for_each(|x| x.put(w));
    }
    fn take(r: &mut Reader) -> Option<Self> {
        let mut all = [T::default(); N];
        for x in &mut all {
            *x = r.take()?;
        }
        Some(all)
    }
}

macro_rules! structure {
    ($t:ident { $($field:ident),* $(,)? }) => {
        impl Wire for $t {
            fn put(&self, w: &mut Writer) {
                $(self.$field.put(w);)*
            }
            fn take(r: &mut Reader) -> Option<Self> {
                Some(Self { $($field: r.take()?),* })
            }
        }
    };
}
structure!(Law { t_min, t_max, mu, compliance });
structure!(Port {
    key,
    kind,
    side,
    mask,
    first,
    body,
    shape,
    first_node,
    node_count,
    origin,
    frame,
    extent,
    law
});
structure!(Node { i, j, area, lower, slope });
structure!(Pose { position, orientation });
structure!(BodyState { world_from_body, linear_velocity, angular_velocity });
structure!(Energy { kinetic, potential, dissipated, port_work, actuator_work, electrical });
structure!(Action { name, help });
structure!(SceneBody { name, mass });
structure!(SceneShape { id, body, name, geometry, body_from_shape, collides, material });
structure!(Material { class, reflectance, transmittance });
structure!(JointVariables { position, velocity, torque, torque_limit, blocked });
structure!(SceneJoint {
    name,
    parent,
    child,
    parent_from_joint,
    axis,
    kind,
    limits,
    variables,
    break_action
});
structure!(Scene { bodies, shapes, joints });
structure!(FeedThrough { outputs, inputs });
structure!(StreamInfo { name, schema, encoding, rate_hz, most_bytes, help });
structure!(BodyRef { subsystem, body });
structure!(ShapeRef { subsystem, body, shape });
structure!(Ray { origin, direction, time, range });
structure!(RayHit { distance, normal, subsystem, body, shape, material });
structure!(RayMask { sees, classes, skip });
structure!(Overlay { layer, frame, colour, figure });
structure!(FieldInfo { name, unit, origin, spacing, size, tile_edge });
structure!(Variable { id, name, value_type, causality, effect, unit, help, min, max, dims, enumeration });

macro_rules! choice {
    ($t:ident: $($variant:ident),*) => {
        impl Wire for $t {
            fn put(&self, w: &mut Writer) {
                (*self as u32).put(w);
            }
            fn take(r: &mut Reader) -> Option<Self> {
                let number: u32 = r.take()?;
                [$(Self::$variant),*].into_iter().find(|v| *v as u32 == number)
            }
        }
    };
}
choice!(ValueType: F64, F32, I8, I16, I32, I64, U8, U16, U32, U64, Bool, String, Binary, Enumeration, Clock);
choice!(Causality: Parameter, Input, Output, Local);
choice!(Effect: Live, NeedsReset, ReadOnly);
choice!(JointKind: Revolute, Continuous, Prismatic, Spherical, Planar, Fixed, Closure, Cylindrical, Universal);

impl Wire for Geometry {
    fn put(&self, w: &mut Writer) {
        match self {
            Self::Sphere { radius } => (w.put(&0_u8), w.put(radius)).0,
            Self::Box { half_extents } => (w.put(&1_u8), w.put(half_extents)).0,
            Self::Capsule { half_length, radius } => (w.put(&2_u8), w.put(&[*half_length, *radius])).0,
            Self::Cylinder { half_length, radius } => (w.put(&3_u8), w.put(&[*half_length, *radius])).0,
            Self::ConvexMesh { points, triangles } => (w.put(&4_u8), w.put(points), w.put(triangles)).0,
            Self::ConeFrustum { half_length, radius_bottom, radius_top } => {
                (w.put(&5_u8), w.put(&[*half_length, *radius_bottom, *radius_top])).0
            }
            Self::Ellipsoid { semi_axes } => (w.put(&6_u8), w.put(semi_axes)).0,
            Self::Mesh { points, triangles } => (w.put(&7_u8), w.put(points), w.put(triangles)).0,
        }
    }
    fn take(r: &mut Reader) -> Option<Self> {
        Some(match r.take::<u8>()? {
            0 => Self::Sphere { radius: r.take()? },
            1 => Self::Box { half_extents: r.take()? },
            2 => Self::Capsule { half_length: r.take()?, radius: r.take()? },
            3 => Self::Cylinder { half_length: r.take()?, radius: r.take()? },
            4 => Self::ConvexMesh { points: r.take()?, triangles: r.take()? },
            5 => {
                Self::ConeFrustum { half_length: r.take()?, radius_bottom: r.take()?, radius_top: r.take()? }
            }
            6 => Self::Ellipsoid { semi_axes: r.take()? },
            7 => Self::Mesh { points: r.take()?, triangles: r.take()? },
            _ => return None,
        })
    }
}

impl Wire for Figure {
    fn put(&self, w: &mut Writer) {
        match self {
            Self::Lines { points, width } => (w.put(&0_u8), w.put(points), w.put(width)).0,
            Self::Points { points, size } => (w.put(&1_u8), w.put(points), w.put(size)).0,
            Self::Arrows { points, width } => (w.put(&2_u8), w.put(points), w.put(width)).0,
            Self::Ellipse { pose, semi_axes } => (w.put(&3_u8), w.put(pose), w.put(semi_axes)).0,
            Self::Text { at, height, text } => (w.put(&4_u8), w.put(at), w.put(height), w.put(text)).0,
        }
    }
    fn take(r: &mut Reader) -> Option<Self> {
        Some(match r.take::<u8>()? {
            0 => Self::Lines { points: r.take()?, width: r.take()? },
            1 => Self::Points { points: r.take()?, size: r.take()? },
            2 => Self::Arrows { points: r.take()?, width: r.take()? },
            3 => Self::Ellipse { pose: r.take()?, semi_axes: r.take()? },
            4 => Self::Text { at: r.take()?, height: r.take()?, text: r.take()? },
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_cut_or_lies_is_found_out() {
        let variable =
            Variable { dims: vec![2, 3], ..Variable::real(7, "a.b", "N m", Causality::Output, "some words") };
        let mut area = [0_u8; 200];
        let mut w = Writer::new(&mut area);
        w.put(&vec![variable.clone()]);
        let length = w.length().expect("room");
        assert_eq!(Reader::new(&area[..length]).take::<Vec<Variable>>(), Some(vec![variable]));
        for cut in 0..length {
            assert_eq!(Reader::new(&area[..cut]).take::<Vec<Variable>>(), None, "{cut}");
        }
        area[..4].copy_from_slice(&u32::MAX.to_le_bytes());
        assert_eq!(Reader::new(&area).take::<Vec<Variable>>(), None);
        assert_eq!(Writer::new(&mut [0; 3]).length(), Some(0));
    }
}
