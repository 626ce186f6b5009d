//! The f64 twin of every GPU pass, one room a pass, written from the mathematics (model.md), never from a shader.
