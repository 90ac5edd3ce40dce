//! Errors of scenes and grounds that cannot become part of a world.

/// A scene or a ground that cannot become part of a world.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A shape.
    #[error("shape `{shape}` of {subsystem}: {why}")]
    Shape {
        /// Name of the subsystem.
        subsystem: String,
        /// Name of the shape.
        shape: String,
        /// Description of the problem.
        why: &'static str,
    },
    /// States or flags that are not one for each body.
    #[error("{subsystem} has {bodies} bodies, but {given} {what} were given")]
    Count {
        /// Name of the subsystem.
        subsystem: String,
        /// Bodies of its scene.
        bodies: usize,
        /// How many were given.
        given: usize,
        /// Of what.
        what: &'static str,
    },
    /// A name that is taken, or a subsystem that is not there.
    #[error("{0}")]
    Name(String),
    /// A field that is no ground.
    #[error("the field `{field}` of {subsystem} has no lattice")]
    Lattice {
        /// Name of the subsystem.
        subsystem: String,
        /// Name of the field.
        field: String,
    },
}

/// Or what is wrong.
pub type Result<T = ()> = std::result::Result<T, Error>;
