//! Choices with which a scene is read, in addition to what its file states.

use super::field_edit::FieldEdit;
use super::import::{Includes, ModelOptions};
use super::surroundings::Surroundings;

/// Choices with which a scene is read, in addition to what its file states.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// Files that the scene may name.
    pub includes: Includes,
    /// Choices among what models hold, unless the scene file makes them.
    pub model: ModelOptions,
    /// Environment, sun and ground. They replace the sky and the ground of a scene file, and those
    /// that a model gets.
    pub surroundings: Surroundings,
    /// Changes of a scene file's fields, in this order.
    pub edits: Vec<FieldEdit>,
}
