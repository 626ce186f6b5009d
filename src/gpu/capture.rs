//! Captures of a frame through RenderDoc's in-application API, where its library is loaded.
//!
//! nimbus never loads the library itself: RenderDoc must be in the process before the first Vulkan
//! call, or it sees none of them.

use std::ffi::{CStr, c_char, c_void};
use std::ptr;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};

use ash::vk::{self, Handle};
use renderdoc_sys as renderdoc;

use crate::error::{Error, Result};

/// The result of a capture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Captured {
    /// Number of the frame.
    pub frame: u32,
    /// Whether RenderDoc has captured it.
    pub is_done: bool,
    /// The file with the capture, if RenderDoc names one.
    pub file: Option<String>,
}

impl Captured {
    /// Returns the result in words.
    pub fn text(&self) -> String {
        let Captured { frame, is_done, file } = self;
        match (is_done, file) {
            (true, Some(file)) => format!("RenderDoc captured frame {frame}: {file}"),
            (true, None) => format!("RenderDoc captured frame {frame}"),
            (false, _) => format!("RenderDoc could not capture frame {frame}"),
        }
    }
}

/// A frame to capture, and the functions of RenderDoc that do it.
pub(super) struct Capture {
    frame: u32,
    n_begun: AtomicU32,
    /// Whether frames that begin count.
    counts: AtomicBool,
    start: unsafe extern "C" fn(*mut c_void, *mut c_void),
    end: unsafe extern "C" fn(*mut c_void, *mut c_void) -> u32,
    n_captures: unsafe extern "C" fn() -> u32,
    capture: unsafe extern "C" fn(u32, *mut c_char, *mut u32, *mut u64) -> u32,
    done: Mutex<Option<Captured>>,
}

/// Returns the function of RenderDoc that hands out its interface; none where its library is not
/// loaded.
#[cfg(all(unix, not(target_os = "macos")))]
fn get_api() -> renderdoc::pRENDERDOC_GetAPI {
    use libloading::os::unix::{Library, RTLD_NOW};
    // glibc, musl and Bionic have this value.
    const RTLD_NOLOAD: i32 = 4;
    // SAFETY: a library that is loaded already runs no initialization again.
    let open = |name: &str| unsafe { Library::open(Some(name), RTLD_NOW | RTLD_NOLOAD) }.ok();
    // Android's layer has another name.
    let library = open("librenderdoc.so").or_else(|| open("libVkLayer_GLES_RenderDoc.so"))?;
    let name = b"RENDERDOC_GetAPI\0";
    // SAFETY: RenderDoc's header declares the symbol with this type.
    let found = unsafe { library.get::<renderdoc::pRENDERDOC_GetAPI>(name) }.ok()?;
    let found = *found;
    // The library stays for as long as the process does, and so does the function.
    std::mem::forget(library);
    found
}

/// Returns the function of RenderDoc that hands out its interface; none where its library is not
/// loaded.
#[cfg(windows)]
fn get_api() -> renderdoc::pRENDERDOC_GetAPI {
    use libloading::os::windows::Library;
    let library = Library::open_already_loaded("renderdoc.dll").ok()?;
    // SAFETY: RenderDoc's header declares the symbol with this type.
    let found = unsafe { library.get::<renderdoc::pRENDERDOC_GetAPI>(b"RENDERDOC_GetAPI\0") };
    let found = *found.ok()?;
    // The library stays for as long as the process does, and so does the function.
    std::mem::forget(library);
    found
}

/// Returns none: RenderDoc does not run on this system.
#[cfg(not(any(windows, all(unix, not(target_os = "macos")))))]
fn get_api() -> renderdoc::pRENDERDOC_GetAPI {
    None
}

impl Capture {
    /// Prepares to capture the frame of number `frame`.
    ///
    /// # Errors
    /// RenderDoc is not loaded, or does not offer version 1.1.2 of its interface.
    pub fn new(frame: u32) -> Result<Capture> {
        let get_api = get_api().ok_or_else(|| {
            Error::usage(
                "--capture: RenderDoc is not loaded in this process; start nimbus under it, as \
                 renderdoccmd capture -w nimbus … does, or by Launch Application in its window",
            )
        })?;
        let mut found: *mut c_void = ptr::null_mut();
        // SAFETY: the function writes a pointer to its table of functions, or returns 0.
        let is_found = unsafe { get_api(renderdoc::eRENDERDOC_API_Version_1_1_2, &mut found) } == 1;
        let table = found.cast::<renderdoc::RENDERDOC_API_1_1_2>();
        // SAFETY: the table lives as long as the library, and version 1.1.2 has these functions.
        let table = unsafe { table.as_ref() }.filter(|_| is_found);
        let functions = table.and_then(|t| {
            Some((t.StartFrameCapture?, t.EndFrameCapture?, t.GetNumCaptures?, t.GetCapture?))
        });
        let (start, end, n_captures, capture) = functions.ok_or_else(|| {
            Error::usage(
                "--capture: the RenderDoc that is loaded lacks version 1.1.2 of its interface; \
                 expected RenderDoc 1.2 or later",
            )
        })?;
        let (n_begun, counts) = (AtomicU32::new(0), AtomicBool::new(true));
        let done = Mutex::default();
        Ok(Capture { frame, n_begun, counts, start, end, n_captures, capture, done })
    }

    /// Sets whether frames that begin count.
    pub fn count_frames(&self, counts: bool) {
        self.counts.store(counts, Ordering::Relaxed);
    }

    /// Counts a frame that begins, and starts the capture if it is the one. Returns whether it is.
    pub fn begin_frame(&self, instance: vk::Instance) -> bool {
        let is_captured = self.counts.load(Ordering::Relaxed)
            && self.n_begun.fetch_add(1, Ordering::Relaxed) == self.frame;
        if is_captured {
            // SAFETY: RenderDoc takes any instance of Vulkan, and no window stands for all.
            unsafe { (self.start)(device_pointer(instance), ptr::null_mut()) };
        }
        is_captured
    }

    /// Ends the capture.
    pub fn end_frame(&self, instance: vk::Instance) {
        // SAFETY: as above.
        let is_done = unsafe { (self.end)(device_pointer(instance), ptr::null_mut()) } == 1;
        let file = self.last_file().filter(|_| is_done);
        let captured = Captured { frame: self.frame, is_done, file };
        *self.done.lock().unwrap_or_else(PoisonError::into_inner) = Some(captured);
    }

    /// Returns the result; none before the frame has ended.
    pub fn result(&self) -> Option<Captured> {
        self.done.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Returns the file of the last capture.
    fn last_file(&self) -> Option<String> {
        // SAFETY: the function takes no argument.
        let i = unsafe { (self.n_captures)() }.checked_sub(1)?;
        let mut n_bytes = 0;
        // SAFETY: without room for the name, RenderDoc writes its length alone, and the 0 counts.
        let is_there = unsafe { (self.capture)(i, ptr::null_mut(), &mut n_bytes, ptr::null_mut()) };
        let mut name = vec![0u8; n_bytes as usize + 1];
        if is_there != 1 || n_bytes == 0 {
            return None;
        }
        // SAFETY: the name has room for the length that RenderDoc has given.
        unsafe {
            (self.capture)(i, name.as_mut_ptr().cast(), &mut n_bytes, ptr::null_mut());
        }
        let name = CStr::from_bytes_until_nul(&name).ok()?;
        Some(name.to_string_lossy().into_owned())
    }
}

/// Returns the pointer by which RenderDoc knows an instance: that to the loader's table, at the
/// beginning of the object.
fn device_pointer(instance: vk::Instance) -> *mut c_void {
    let object = instance.as_raw() as *const *mut c_void;
    // SAFETY: every dispatchable handle begins with that pointer.
    unsafe { object.as_ref() }.copied().unwrap_or(ptr::null_mut())
}
