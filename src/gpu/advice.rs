//! Advice for machines on which no Vulkan device can be used: no loader, driver or permission.

use std::fs::OpenOptions;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// The driver to install.
#[cfg(windows)]
pub const PACKAGES: &str = "install your GPU maker's driver, which brings the Vulkan loader";
/// The loader, and the driver over Metal, to install.
#[cfg(target_os = "macos")]
pub const PACKAGES: &str = "install the Vulkan loader and MoltenVK: the Vulkan SDK of LunarG, or \
    `brew install vulkan-loader molten-vk`";
/// Packages of the loader, and of drivers for GPUs and for the CPU.
#[cfg(not(any(windows, target_os = "macos")))]
pub const PACKAGES: &str = "install the Vulkan loader and a driver: on Debian and Ubuntu \
    `apt install libvulkan1 mesa-vulkan-drivers` (llvmpipe needs no GPU), on Fedora \
    `dnf install vulkan-loader mesa-vulkan-drivers`, or your GPU maker's driver";

/// Variables that name the only drivers that the loader looks at.
const DRIVER_VARIABLES: [&str; 2] = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"];

/// Returns what to do where the loader finds no driver, or none that is good enough.
pub fn no_driver() -> String {
    let set = DRIVER_VARIABLES.into_iter().find(|name| std::env::var_os(name).is_some());
    match (set, closed_nodes(&device_nodes(), opens)) {
        (Some(name), _) => {
            format!("{name} is set and names the only drivers that count: unset it, or {PACKAGES}")
        }
        (None, Some(advice)) => advice,
        (None, None) => PACKAGES.to_owned(),
    }
}

/// Returns what to do if a GPU is there and this user may not open it.
pub fn no_permission() -> Option<String> {
    closed_nodes(&device_nodes(), opens)
}

/// Returns the files by which drivers reach GPUs.
fn device_nodes() -> Vec<PathBuf> {
    let is_node = |path: &PathBuf| {
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned());
        name.is_some_and(|name| name.starts_with("renderD") || name.starts_with("nvidia"))
    };
    ["/dev/dri", "/dev"]
        .into_iter()
        .filter_map(|folder| std::fs::read_dir(folder).ok())
        .flat_map(|entries| entries.flatten().map(|entry| entry.path()))
        .filter(|path| is_node(path) && !path.is_dir())
        .collect()
}

/// Opens a device node as a driver does.
fn opens(path: &Path) -> Result<(), ErrorKind> {
    OpenOptions::new().read(true).write(true).open(path).map(drop).map_err(|e| e.kind())
}

fn closed_nodes(
    nodes: &[PathBuf],
    opens: impl Fn(&Path) -> Result<(), ErrorKind>,
) -> Option<String> {
    let is_closed = |path: &&PathBuf| opens(path) == Err(ErrorKind::PermissionDenied);
    let path = nodes.iter().find(is_closed)?;
    Some(format!(
        "{} is there, and this user may not open it: add the user to the groups `render` and \
         `video` (`sudo usermod -aG render,video $USER`) and log in again",
        path.display()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_without_permission_is_named() {
        let nodes = ["/dev/dri/renderD128", "/dev/dri/renderD129"].map(PathBuf::from);
        let of = |second: Result<(), ErrorKind>| {
            closed_nodes(&nodes, |path| if path.ends_with("renderD129") { second } else { Ok(()) })
        };
        assert_eq!((of(Ok(())), of(Err(ErrorKind::NotFound))), (None, None));
        let advice = of(Err(ErrorKind::PermissionDenied)).expect("advice");
        assert!(advice.starts_with("/dev/dri/renderD129") && advice.contains("`render`"));
    }
}
