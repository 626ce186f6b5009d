//! Which of the pool's fields a cloud's particles are drawn with (docs/model.md §9).

/// Fields of the pool.
pub const N_FIELDS: u32 = 8;

/// Greatest `texture_strength`: n is at most 8, and exp(4 · 8) is far from f32's end.
pub const MAX_STRENGTH: f64 = 4.0;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Texture {
    pub choice: Choice,
    /// s: τ is multiplied by exp(s n − s² ⟨n²⟩/2).
    pub strength: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice {
    /// Blobs are drawn plain.
    None,
    /// All boxes have this field.
    Field(u32),
    /// Box i has field i modulo [`N_FIELDS`]; a particle list is one box.
    ByBox,
}

impl Choice {
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
    pub const NONE: Texture = Texture { choice: Choice::None, strength: 1.0 };

    pub fn is_none(&self) -> bool {
        self.choice == Choice::None
    }

    /// Field of box `i_box`, and s: 0 where blobs are plain.
    pub fn of_box(&self, i_box: u32) -> (u32, f64) {
        match self.choice {
            Choice::None => (0, 0.0),
            Choice::Field(i_field) => (i_field, self.strength),
            Choice::ByBox => (i_box % N_FIELDS, self.strength),
        }
    }
}
