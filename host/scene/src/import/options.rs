//! Choices among what a model file holds: the time of its animation, the variant of its materials.

/// Choices among what a model file holds. Only glTF files hold any.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModelOptions {
    /// Time in seconds at which nodes and shapes are drawn. `None` draws an animation that is named
    /// at its time 0, and otherwise the file's own pose.
    pub time: Option<f64>,
    /// Name of the animation. `None` is the file's first.
    pub animation: Option<String>,
    /// Name of the variant of the materials (KHR_materials_variants). `None` draws the materials
    /// that the primitives name.
    pub variant: Option<String>,
}

impl ModelOptions {
    /// Returns these choices, and for those that were not made the ones of `others`.
    #[must_use]
    pub fn or(&self, others: &Self) -> Self {
        let moves = self.time.is_some() || self.animation.is_some();
        let motion = if moves { self } else { others };
        Self {
            time: motion.time,
            animation: motion.animation.clone(),
            variant: self.variant.clone().or_else(|| others.variant.clone()),
        }
    }
}
