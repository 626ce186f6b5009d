//! Selection of the texture pool's fields for a cloud's particles (model.md §9).

/// Number of fields of the pool.
pub const N_FIELDS: u32 = 8;

/// Greatest `texture_strength`: n is at most 8, and exp(4 · 8) is far below f32's greatest number.
pub const MAX_STRENGTH: f64 = 4.0;

/// Texture of a cloud's particles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Texture {
    /// Field of each box.
    pub choice: Choice,
    /// s: τ is multiplied by exp(s n − s² ⟨n²⟩/2).
    pub strength: f64,
}

/// Assignment of fields to boxes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice {
    /// Plain blobs.
    None,
    /// The same field for all boxes.
    Field(u32),
    /// Field i modulo [`N_FIELDS`] for box i; a particle list is one box.
    ByBox,
}

impl Choice {
    /// Names in scene files.
    pub const NAMES: [(&'static str, Choice); 10] = [
        ("none", Choice::None),
        ("by-box", Choice::ByBox),
        ("0", Choice::Field(0)),
        ("1", Choice::Field(1)),
        ("2", Choice::Field(2)),
        ("3", Choice::Field(3)),
        ("4", Choice::Field(4)),
        ("5", Choice::Field(5)),
        ("6", Choice::Field(6)),
        ("7", Choice::Field(7)),
    ];
}

impl Texture {
    /// Plain blobs.
    pub const NONE: Texture = Texture { choice: Choice::None, strength: 1.0 };

    /// Returns whether blobs are plain.
    pub fn is_none(&self) -> bool {
        self.choice == Choice::None
    }

    /// Returns the field of box `i_box` and s, which is 0 for plain blobs.
    pub fn of_box(&self, i_box: u32) -> (u32, f64) {
        match self.choice {
            Choice::None => (0, 0.0),
            Choice::Field(i_field) => (i_field, self.strength),
            Choice::ByBox => (i_box % N_FIELDS, self.strength),
        }
    }
}
