//! Progress of a reference picture while it is computed.

/// A stage of a reference picture that takes noticeable time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RenderStage {
    /// The second reflection, facet by facet.
    Lighting,
    /// The picture, row by row.
    Drawing,
    /// Whole samples, where a picture is the mean of several.
    Sampling,
}

/// A callback with a stage and its number of parts. It is called from any thread each time one more
/// part is done.
pub type OnProgress<'a> = &'a (dyn Fn(RenderStage, usize) + Sync);
