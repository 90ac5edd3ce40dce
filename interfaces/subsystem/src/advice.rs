//! Advice on parameters that are accepted and yet unlikely to be meant, by kind of module.

/// A warning about a parameter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Advice {
    /// Key of the parameter.
    pub key: &'static str,
    /// The warning, with the way out.
    pub message: String,
}
