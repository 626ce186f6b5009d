//! A virtual display with its keyboard and mouse: Xvfb and xdotool, which `tools/bootstrap tests`
//! installs. A test fails where they are missing.

#![allow(dead_code, reason = "each test binary uses its own part")]

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Waits until `condition` holds. Fails after a minute without it.
pub fn wait_for(what: &str, mut condition: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !condition() {
        assert!(begin.elapsed() < Duration::from_secs(60), "no {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// An X server of its own.
pub struct Display {
    server: Child,
    name: String,
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

impl Display {
    /// Starts a server on a free display number.
    pub fn open() -> Display {
        let mut server = Command::new("Xvfb")
            // By default the server resets when its last client leaves. xdotool is a new client for
            // each command, and a client that connects during a reset is lost.
            .args([
                "-displayfd",
                "1",
                "-screen",
                "0",
                "1280x1024x24",
                "-nolisten",
                "tcp",
                "-noreset",
            ])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb: tools/bootstrap tests installs it");
        let mut number = String::new();
        let out = server.stdout.take().expect("its output");
        BufReader::new(out).read_line(&mut number).expect("a display's number");
        Display { server, name: format!(":{}", number.trim()) }
    }

    /// Ends the server at once, as a broken connection does.
    pub fn end(&self) {
        let pid = self.server.id().to_string();
        let ended = Command::new("kill").args(["-9", &pid]).status().expect("kill");
        assert!(ended.success());
    }

    /// Returns the variables of a program that is to open its windows here. An empty variable
    /// counts as none; a program would otherwise prefer the Wayland session of whoever runs the
    /// tests.
    pub fn variables(&self) -> [(&'static str, &str); 3] {
        [("DISPLAY", &self.name), ("WAYLAND_DISPLAY", ""), ("WAYLAND_SOCKET", "")]
    }

    /// Runs xdotool. Returns its output where it succeeds.
    pub fn xdotool(&self, args: &[&str]) -> Option<String> {
        let output = Command::new("xdotool").args(args).env("DISPLAY", &self.name).output();
        let output = output.expect("xdotool: tools/bootstrap tests installs it");
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    }

    /// Waits for the window of a process, and gives it the keyboard.
    pub fn window_of(&self, pid: u32) -> String {
        let mut window = None;
        wait_for("window", || {
            let found = self.xdotool(&["search", "--onlyvisible", "--pid", &pid.to_string()]);
            window = found.and_then(|all| all.lines().next().map(str::to_owned));
            window.is_some()
        });
        let window = window.expect("found");
        self.xdotool(&["windowfocus", "--sync", &window]).expect("the focus");
        window
    }

    /// Presses and releases a key.
    pub fn key(&self, name: &str) {
        self.xdotool(&["key", "--delay", "30", name]).expect("a key");
    }

    /// Types characters, one after the other.
    pub fn types(&self, text: &str) {
        self.xdotool(&["type", "--delay", "30", "--", text]).expect("text");
    }

    /// Returns the title of a window.
    pub fn title(&self, window: &str) -> String {
        self.xdotool(&["getwindowname", window]).unwrap_or_default()
    }

    /// Returns width, height and RGB bytes of a window's content.
    pub fn pixels(&self, window: &str) -> (u32, u32, Vec<u8>) {
        use x11rb::connection::Connection;
        use x11rb::protocol::xproto::{ConnectionExt, ImageFormat};
        let (connection, _) = x11rb::connect(Some(&self.name)).expect("the display");
        let id: u32 = window.parse().expect("a window's number");
        let shape = connection.get_geometry(id).expect("asked").reply().expect("a shape");
        let (width, height) = (shape.width, shape.height);
        let image = connection
            .get_image(ImageFormat::Z_PIXMAP, id, 0, 0, width, height, !0)
            .expect("asked");
        let data = image.reply().expect("the content").data;
        assert_eq!(
            connection.setup().image_byte_order,
            x11rb::protocol::xproto::ImageOrder::LSB_FIRST
        );
        let rgb = data.chunks_exact(4).flat_map(|p| [p[2], p[1], p[0]]).collect();
        (u32::from(width), u32::from(height), rgb)
    }

    /// Sets the size of a window, in pixels.
    pub fn resize(&self, window: &str, [width, height]: [u32; 2]) {
        self.xdotool(&["windowsize", window, &width.to_string(), &height.to_string()])
            .expect("a size");
    }

    /// Moves the pointer between two places of the window with a button held.
    pub fn drag(&self, window: &str, button: u32, from: [u32; 2], to: [u32; 2]) {
        let [x, y] = from.map(|v| v.to_string());
        let [to_x, to_y] = to.map(|v| v.to_string());
        let button = button.to_string();
        self.xdotool(&["mousemove", "--window", window, &x, &y, "mousedown", &button])
            .expect("down");
        self.xdotool(&["mousemove", "--window", window, &to_x, &to_y]).expect("moved");
        self.xdotool(&["mouseup", &button]).expect("up");
    }
}
