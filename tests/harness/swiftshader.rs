//! SwiftShader, a Vulkan driver of another code base than lavapipe.

use std::path::Path;
use std::process::Command;

/// Places of its manifest, which Chromium's packages bring.
const MANIFESTS: [&str; 4] = [
    "/usr/lib/chromium/vk_swiftshader_icd.json",
    "/usr/lib64/chromium-browser/vk_swiftshader_icd.json",
    "/usr/lib/chromium-browser/vk_swiftshader_icd.json",
    "/opt/google/chrome/vk_swiftshader_icd.json",
];

/// Has a command use SwiftShader alone.
pub fn choose(command: &mut Command) {
    let found = MANIFESTS.iter().find(|path| Path::new(path).exists());
    let found = found.expect("SwiftShader, which tools/bootstrap tests installs with Chromium");
    command.env("VK_DRIVER_FILES", found).env("VK_ICD_FILENAMES", found);
}
