//! GLSL sources, and their compilation to SPIR-V at run time by shaderc, cached on disk by content.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use crate::error::{Error, Result};
use crate::io::input_file;

/// Largest text of a shader of `--shaders`, bytes. The longest built-in one has 14 KiB.
const LARGEST_TEXT: u64 = 256 << 10;
/// Most lines of such a text. The longest built-in one has 330.
const MOST_LINES: usize = 10_000;
/// Most brackets within each other in such a text: the compiler recurses into each of them.
const DEEPEST_NESTING: usize = 200;
/// Most includes of a shader, those of its includes counted; the built-in shaders have up to ten.
/// Without a bound an include of itself never ends.
const MOST_INCLUDES: u32 = 64;
/// Largest SPIR-V of a shader in the cache, bytes. The built-in ones have less than 1 MiB.
const LARGEST_BINARY: u64 = 64 << 20;

/// Shader texts by file name (`include/x.glsl` for includes).
#[derive(Debug, Clone)]
pub struct Sources(BTreeMap<String, String>);

impl Sources {
    /// Returns the texts built into the binary.
    pub fn embedded(texts: &[(&str, &str)]) -> Sources {
        Sources(texts.iter().map(|(name, text)| ((*name).to_owned(), (*text).to_owned())).collect())
    }

    /// Returns the text of a shader or of a file that shaders include.
    pub fn text(&self, name: &str) -> Option<&str> {
        self.0.get(name).map(String::as_str)
    }

    /// Returns the SHA-256 of all names and texts, in hex.
    pub fn digest(&self) -> String {
        hex(&Sha256::digest(format!("{:?}", self.0)))
    }

    /// Replaces texts by those that `dir` holds, for `--shaders DIR`.
    ///
    /// # Errors
    /// `dir` is no folder, holds none of the shaders or a shader that nimbus does not have, or
    /// cannot be read.
    pub fn with_dir(mut self, dir: &Path) -> Result<Sources> {
        if !dir.is_dir() {
            return Err(Error::io(dir, "expected a folder of shaders"));
        }
        self.refuse_unknown(dir)?;
        let mut n_found = 0;
        for (name, text) in &mut self.0 {
            let path = dir.join(name);
            match input_file::read_string(&path, LARGEST_TEXT) {
                Ok(own) => *text = own,
                Err(e) if matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
                    continue;
                }
                Err(e) => return Err(Error::io(&path, e)),
            }
            check_text(text).map_err(|what| Error::io(&path, what))?;
            n_found += 1;
        }
        if n_found == 0 {
            let names: Vec<&str> = self.names().collect();
            let what = format!("holds none of nimbus's shaders ({})", names.join(", "));
            return Err(Error::io(dir, what));
        }
        Ok(self)
    }

    /// Refuses a folder with a file that looks like a shader and is none of nimbus's: it would be
    /// ignored, and the built-in one would be used in its place.
    fn refuse_unknown(&self, dir: &Path) -> Result<()> {
        for folder in ["", "include/"] {
            let Ok(entries) = std::fs::read_dir(dir.join(folder)) else { continue };
            let mut names: Vec<String> = entries
                .flatten()
                .filter(|entry| entry.path().is_file())
                .map(|entry| format!("{folder}{}", entry.file_name().to_string_lossy()))
                .filter(|name| !self.0.contains_key(name))
                .collect();
            names.sort();
            for name in names {
                let near = self.nearest(&name);
                if near.is_some() || is_shader(&name) {
                    let near = near.map_or(String::new(), |near| format!("; did you mean {near}?"));
                    let what = format!("nimbus has no such shader, and would ignore it{near}");
                    return Err(Error::io(&dir.join(name), what));
                }
            }
        }
        Ok(())
    }

    /// Returns the shader whose name is nearest to `name`, which is none: at most two edits away,
    /// or the same in another folder or with another extension.
    fn nearest(&self, name: &str) -> Option<&str> {
        let parts = |name: &str| {
            let file = name.rsplit('/').next().unwrap_or(name).to_lowercase();
            let stem = file.split('.').next().unwrap_or_default().to_owned();
            (file, stem)
        };
        let (file, stem) = parts(name);
        // Copies that editors keep beside a file.
        if file.starts_with(['.', '#']) || file.ends_with('~') || file.contains(".sw") {
            return None;
        }
        let distance = |known: &&str| {
            let (known, known_stem) = parts(known);
            let n = strsim::osa_distance(&file, &known);
            if known_stem == stem && is_shader(name) { n.min(1) } else { n }
        };
        self.names()
            .map(|known| (distance(&known), known))
            .filter(|(n, _)| *n <= 2)
            .min()
            .map(|(_, known)| known)
    }

    /// Adds a text, or replaces the one of that name.
    pub fn with_text(mut self, name: &str, text: &str) -> Sources {
        self.0.insert(name.to_owned(), text.to_owned());
        self
    }

    /// Returns the SHA-256 over all names and texts, in hexadecimal.
    pub fn hash(&self) -> String {
        let mut hasher = Sha256::new();
        for (name, text) in &self.0 {
            // Lengths mark where a text ends.
            hasher.update(format!("{name} {}\n{text}", text.len()));
        }
        format!("{:x}", hasher.finalize())
    }

    /// Returns the file names.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }

    /// Replaces each `from` in a text by `to`, for tests that prove that a wrong shader is noticed.
    /// White space does not count. Returns whether anything was replaced.
    pub fn replace(&mut self, name: &str, from: &str, to: &str) -> bool {
        let Some(text) = self.0.get_mut(name) else { return false };
        let solid = |text: &str| -> Vec<(usize, char)> {
            text.char_indices().filter(|(_, c)| !c.is_whitespace()).collect()
        };
        let (within, wanted) = (solid(text), solid(from));
        let (mut replaced, mut end, mut i) = (String::new(), 0, 0);
        while let Some(found) = within.get(i..i + wanted.len()) {
            let is_match = found.iter().zip(&wanted).all(|((_, a), (_, b))| a == b);
            if let (true, Some((first, _)), Some((last, c))) =
                (is_match, found.first(), found.last())
            {
                replaced += &text[end..*first];
                replaced += to;
                end = last + c.len_utf8();
            }
            i += if is_match { wanted.len().max(1) } else { 1 };
        }
        replaced += &text[end..];
        let is_changed = replaced != *text;
        *text = replaced;
        is_changed
    }
}

/// Whether a file's extension is that of a shader.
fn is_shader(name: &str) -> bool {
    const EXTENSIONS: [&str; 9] =
        ["comp", "vert", "frag", "glsl", "geom", "tesc", "tese", "mesh", "hlsl"];
    let extension = name.rsplit_once('.').map_or("", |(_, extension)| extension).to_lowercase();
    EXTENSIONS.contains(&extension.as_str())
}

/// Checks a text of `--shaders`: some texts end the compiler, and the process with it.
fn check_text(text: &str) -> std::result::Result<(), String> {
    if let Some(at) = text.find('\0') {
        let line = text[..at].matches('\n').count() + 1;
        return Err(format!("line {line}: not a text file: it holds a zero byte"));
    }
    let n_lines = text.lines().count();
    if n_lines > MOST_LINES {
        return Err(format!("{n_lines} lines, the limit is {MOST_LINES}"));
    }
    let (mut depth, mut deepest) = (0usize, 0);
    for c in text.bytes() {
        match c {
            b'(' | b'[' | b'{' => depth += 1,
            b')' | b']' | b'}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        deepest = deepest.max(depth);
    }
    if deepest > DEEPEST_NESTING {
        return Err(format!(
            "{deepest} brackets within each other, the limit is {DEEPEST_NESTING}"
        ));
    }
    Ok(())
}

/// How SPIR-V is optimised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Optimize {
    /// Fully, for running.
    Yes,
    /// Not at all, with all names, for reflection tests.
    No,
}

/// Compiles shaders, and caches their SPIR-V.
pub struct Compiler {
    raw: shaderc::Compiler,
    sources: Sources,
    cache: Option<PathBuf>,
}

/// Returns the folder `name` for files that can be made again: in `$NIMBUS_CACHE_DIR`, else
/// `$XDG_CACHE_HOME/nimbus`, else `~/.cache/nimbus`; on Windows `%LOCALAPPDATA%\nimbus`.
pub fn cache_folder(name: &str) -> Option<PathBuf> {
    let var = |name| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    let base = var("NIMBUS_CACHE_DIR")
        .or_else(|| var("XDG_CACHE_HOME").map(|d| d.join("nimbus")))
        .or_else(|| var("LOCALAPPDATA").filter(|_| cfg!(windows)).map(|d| d.join("nimbus")))
        .or_else(|| var("HOME").map(|d| d.join(".cache/nimbus")))?;
    Some(base.join(name))
}

impl Compiler {
    /// Makes a compiler of `sources`. `cache` is a folder for SPIR-V, made when first needed;
    /// without a cache every call compiles.
    ///
    /// # Errors
    /// shaderc does not start.
    pub fn new(sources: Sources, cache: Option<PathBuf>) -> Result<Compiler> {
        let raw = shaderc::Compiler::new()
            .map_err(|e| Error::Shader { name: "compiler".into(), what: e.to_string() })?;
        Ok(Compiler { raw, sources, cache })
    }

    /// Returns the folder `spirv` of the [`cache_folder`].
    pub fn default_cache() -> Option<PathBuf> {
        cache_folder("spirv")
    }

    /// Returns the SPIR-V of `file`, whose extension names the stage, with `macros` defined.
    ///
    /// # Errors
    /// The text does not compile; the error carries the compiler's file:line.
    pub fn compile(
        &self,
        file: &str,
        optimize: Optimize,
        macros: &[(&str, u32)],
    ) -> Result<Vec<u32>> {
        let fail = |what: String| Error::Shader { name: file.to_owned(), what };
        let Some(text) = self.sources.0.get(file) else {
            return Err(fail("no such shader".into()));
        };
        let kind = match file.rsplit('.').next() {
            Some("comp") => shaderc::ShaderKind::Compute,
            Some("vert") => shaderc::ShaderKind::Vertex,
            Some("frag") => shaderc::ShaderKind::Fragment,
            _ => return Err(fail("expected a file ending in .comp, .vert or .frag".into())),
        };
        let key = || self.key(file, text, optimize, macros);
        let cached = self.cache.as_ref().map(|dir| dir.join(format!("{}.spv", key())));
        if let Some(words) = cached.as_deref().and_then(read_cached) {
            return Ok(words);
        }
        // Declared before the options, which borrow it.
        let n_includes = Cell::new(0);
        let mut options = shaderc::CompileOptions::new().map_err(|e| fail(e.to_string()))?;
        options.set_target_env(shaderc::TargetEnv::Vulkan, shaderc::EnvVersion::Vulkan1_3 as u32);
        options.set_optimization_level(match optimize {
            Optimize::Yes => shaderc::OptimizationLevel::Performance,
            Optimize::No => shaderc::OptimizationLevel::Zero,
        });
        for (name, value) in macros {
            options.add_macro_definition(name, Some(&value.to_string()));
        }
        options.set_warnings_as_errors();
        options.set_include_callback(|name, _, _, _| {
            let full = format!("include/{name}");
            n_includes.set(n_includes.get() + 1);
            if n_includes.get() > MOST_INCLUDES {
                return Err(format!(
                    "more than {MOST_INCLUDES} includes: {full} includes itself, directly or \
                     through others"
                ));
            }
            let content = self.sources.0.get(&full).cloned().ok_or(format!("no include {full}"))?;
            Ok(shaderc::ResolvedInclude { resolved_name: full, content })
        });
        let compiled = self.raw.compile_into_spirv(text, kind, file, "main", Some(&options));
        let words = compiled.map_err(|e| fail(e.to_string()))?.as_binary().to_vec();
        if let Some(path) = cached {
            // A cache that cannot be written costs time and nothing else.
            let _ = write_cached(&path, &words);
        }
        Ok(words)
    }

    /// Hashes all that the SPIR-V depends on: the text, every include, the options, the compiler.
    fn key(&self, file: &str, text: &str, optimize: Optimize, macros: &[(&str, u32)]) -> String {
        let mut hash = Sha256::new();
        let (version, revision) = shaderc::get_spirv_version();
        let crate_version = "shaderc-rs 0.10";
        hash.update(format!(
            "{crate_version} {version} {revision} vulkan1.3 {optimize:?} \
            {macros:?} {file}\0{text}\0"
        ));
        for (name, include) in self.sources.0.iter().filter(|(n, _)| n.starts_with("include/")) {
            hash.update(format!("{name}\0{include}\0"));
        }
        hex(&hash.finalize())
    }
}

/// Returns bytes in lower-case hexadecimal.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// Reads a cached file: words after their SHA-256. Any other content counts as missing.
fn read_cached(path: &Path) -> Option<Vec<u32>> {
    let bytes = input_file::read(path, LARGEST_BINARY).ok()?;
    let (sum, words) = bytes.split_at_checked(32)?;
    if words.len() % 4 != 0 || Sha256::digest(words).as_slice() != sum {
        return None;
    }
    Some(bytemuck::pod_collect_to_vec(words))
}

/// Writes a cached file under another name and renames it, so that none is seen half written.
fn write_cached(path: &Path, words: &[u32]) -> std::io::Result<()> {
    let bytes: &[u8] = bytemuck::cast_slice(words);
    let owner = format!("{}-{:?}.tmp", std::process::id(), std::thread::current().id());
    let temporary = path.with_extension(owner);
    std::fs::create_dir_all(path.parent().unwrap_or(Path::new(".")))?;
    let written = std::fs::write(&temporary, [Sha256::digest(bytes).as_slice(), bytes].concat())
        .and_then(|()| std::fs::rename(&temporary, path));
    if written.is_err() {
        let _ = std::fs::remove_file(&temporary);
    }
    written
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misspelt_shader_is_refused_with_the_nearest_name() {
        let sources = || {
            Sources::embedded(&[("first.comp", "a"), ("sort.comp", "b"), ("include/key.glsl", "c")])
        };
        let told = |name: &str| {
            let dir = tempfile::tempdir().expect("a folder");
            std::fs::create_dir(dir.path().join("include")).expect("a folder");
            std::fs::write(dir.path().join("sort.comp"), "b").expect("a file");
            std::fs::write(dir.path().join(name), "a").expect("a file");
            sources().with_dir(dir.path()).map(drop).map_err(|e| e.to_string())
        };
        for (wrong, near) in [
            ("frist.comp", "first.comp"),
            ("first.com", "first.comp"),
            ("First.comp", "first.comp"),
            ("first.glsl", "first.comp"),
            ("key.glsl", "include/key.glsl"),
            ("include/kye.glsl", "include/key.glsl"),
            ("include/first.comp", "first.comp"),
        ] {
            let message = told(wrong).expect_err(wrong);
            assert!(message.contains(&format!("did you mean {near}?")), "{wrong}: {message}");
        }
        assert!(told("of-another-project.comp").expect_err("unknown").ends_with("ignore it"));
        for fine in ["first.comp", "README.md", ".first.comp.swp", "first.comp~", "notes.txt"] {
            assert_eq!(told(fine), Ok(()), "{fine}");
        }
    }

    #[test]
    fn replace_ignores_white_space() {
        let mut sources = Sources::embedded(&[("a.comp", "f(a,\n    b); f(a, b); g")]);
        assert!(sources.replace("a.comp", "f(a, b)", "h"));
        assert_eq!(sources.0["a.comp"], "h; h; g");
        assert!(!sources.replace("a.comp", "f(a, b)", "h"));
        assert!(!sources.replace("b.comp", "g", "h"));
    }
}
