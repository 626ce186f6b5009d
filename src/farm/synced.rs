//! Files that outlast a power cut (`io::atomic`).

pub use crate::io::atomic::{
    append_synced as append, make_folder, sync as folder, write_new_synced as write_new,
    write_synced as write,
};
