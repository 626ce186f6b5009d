//! The hash of a scene. It is computed when it is first asked for, because that of millions of
//! particles takes as long as reading them, and a scene that is only drawn needs none.

use std::sync::OnceLock;

use sha2::{Digest, Sha256};

use super::particle_digest;
use crate::model::particle_list::ParticleList;

/// The content of a file, as far as a scene draws it.
#[derive(Debug, Clone)]
pub enum Content {
    /// SHA-256 of it.
    Digest([u8; 32]),
    /// A list of particles, which is all that is drawn of the file.
    List(ParticleList),
}

impl From<[u8; 32]> for Content {
    fn from(digest: [u8; 32]) -> Content {
        Content::Digest(digest)
    }
}

/// The hash of a scene, and the data that it is made of.
#[derive(Debug, Clone)]
pub struct SceneHash {
    /// The resolved scene, and those of its phases.
    resolved: Vec<String>,
    /// Of every file, in order.
    contents: Vec<Content>,
    made: OnceLock<String>,
}

impl SceneHash {
    /// Returns the hash of a resolved scene, those of its phases, and what it draws of its files.
    pub fn new(resolved: Vec<String>, contents: Vec<Content>) -> SceneHash {
        SceneHash { resolved, contents, made: OnceLock::new() }
    }

    /// Returns the hash in hexadecimal digits.
    pub fn hex(&self) -> &str {
        self.made.get_or_init(|| {
            // Digests have a fixed length and follow the closing brace of the JSON, so that no two
            // scenes give the same bytes.
            let mut hash = Sha256::new();
            self.resolved.iter().for_each(|text| hash.update(text));
            self.contents.iter().for_each(|content| {
                hash.update(match content {
                    Content::Digest(digest) => *digest,
                    Content::List(list) => particle_digest::digest(list),
                });
            });
            format!("{:x}", hash.finalize())
        })
    }
}

impl PartialEq for SceneHash {
    fn eq(&self, other: &SceneHash) -> bool {
        self.hex() == other.hex()
    }
}
