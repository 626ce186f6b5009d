//! Compute pipelines that a device has made, for kernels that are made again.
//!
//! An edited scene, or one of many scenes, makes most of its kernels as the scene before did.
//! Drivers take from a millisecond to a second for one.

use std::any::Any;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use sha2::{Digest, Sha256};

use crate::error::Result;

/// A push constant: name, offset, bytes.
type Field = (&'static str, usize, usize);

/// Number of pipelines from which those are dropped that no kernel uses: shaders that are edited
/// again and again make new ones.
const MANY: usize = 1024;

/// Two kernels of the same key have the same pipeline.
#[derive(PartialEq, Eq, Hash)]
pub(super) struct Key {
    name: String,
    code: [u8; 32],
    push: Vec<Field>,
    constants: Vec<(u32, u32)>,
    is_one_subgroup: bool,
}

impl Key {
    /// Returns the key of a kernel of SPIR-V `words`, by its push constants, specialization
    /// constants, and whether its workgroup must be one subgroup.
    pub fn new(
        name: &str,
        words: &[u32],
        push: &[Field],
        constants: &[(u32, u32)],
        is_one_subgroup: bool,
    ) -> Key {
        Key {
            name: name.to_owned(),
            code: Sha256::digest(bytemuck::cast_slice::<u32, u8>(words)).into(),
            push: push.to_vec(),
            constants: constants.to_vec(),
            is_one_subgroup,
        }
    }
}

/// The pipelines of a device, of any type: theirs holds on to the device.
#[derive(Default)]
pub(super) struct KeptPipelines(Mutex<HashMap<Key, Arc<dyn Any + Send + Sync>>>);

impl KeptPipelines {
    /// Returns the pipeline of `key`, which `make` makes if there is none yet.
    ///
    /// # Errors
    /// `make` fails.
    pub fn get<T: Any + Send + Sync>(
        &self,
        key: Key,
        make: impl FnOnce() -> Result<T>,
    ) -> Result<Arc<T>> {
        let lock = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let kept = lock().get(&key).cloned();
        if let Some(Ok(made)) = kept.map(Arc::downcast) {
            return Ok(made);
        }
        let made = Arc::new(make()?);
        let mut all = lock();
        if all.len() >= MANY {
            all.retain(|_, made| Arc::strong_count(made) > 1);
        }
        all.insert(key, made.clone());
        Ok(made)
    }

    /// Returns their number.
    pub fn len(&self) -> usize {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).len()
    }

    /// Drops all that no kernel uses, and lets go of the others.
    pub fn clear(&self) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }
}
