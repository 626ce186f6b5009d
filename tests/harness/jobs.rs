//! Commands that replace results, and all that they need to run.

/// A command that replaces results.
pub struct Job {
    /// Commands whose results the command reads.
    pub before: &'static [&'static [&'static str]],
    /// The arguments that both runs of the command have.
    pub command: &'static [&'static str],
    /// The further arguments of the run that makes the old results.
    pub old: &'static [&'static str],
    /// Commands that change the input of the new results.
    pub between: &'static [&'static [&'static str]],
    /// The further arguments of the run that replaces the old results.
    pub new: &'static [&'static str],
    /// The arguments that continue the old results, if the command can.
    pub resume: &'static [&'static str],
    /// The file or folder that has the results.
    pub out: &'static str,
    /// The record of new results that are whole; none for a file or for frames.
    pub record: Option<&'static str>,
    /// Files that are written after everything was measured.
    pub last: &'static [&'static str],
}

const BENCH: &[&str] = &[
    "bench",
    "scene.toml",
    "-q",
    "--repeat=1",
    "--frames=2",
    "--warmup=1",
    "--threading=serial",
    "--no-saved",
    "--out=out",
];
const ERROR: &[&str] = &[
    "error",
    "scene.toml",
    "-q",
    "--rounds=1",
    "--frames=1",
    "--pixels=64",
    "--against=thin",
    "--out=out",
];
const LEDGER: &[&str] =
    &["ledger", "scene.toml", "-q", "--rounds=2", "--frames=1", "--pixels=16", "--out=out"];
const NONE: Job = Job {
    before: &[],
    command: &[],
    old: &[],
    between: &[],
    new: &[],
    resume: &[],
    out: "out",
    record: None,
    last: &[],
};

pub const JOBS: [Job; 6] = [
    Job {
        command: BENCH,
        new: &["--force", "--plot", "--set=draw.cutoff=2.5"],
        record: Some("run.json"),
        last: &["frames.csv", "run.json", "case-0.png", "frames.svg"],
        ..NONE
    },
    Job {
        command: ERROR,
        old: &["--knob=draw.cutoff=2"],
        new: &["--force", "--knob=draw.cutoff=2.5,4"],
        resume: &["--resume", "--knob=draw.cutoff=4"],
        record: Some("study.json"),
        last: &["front.svg"],
        ..NONE
    },
    Job {
        command: LEDGER,
        new: &["--force", "--set=draw.cutoff=2.5"],
        record: Some("ledger.json"),
        last: &["ledger.json", "ledger.svg"],
        ..NONE
    },
    Job {
        command: &["render", "scene.toml", "-q", "-o", "out.png"],
        new: &["--force", "--set=draw.cutoff=2.5"],
        out: "out.png",
        ..NONE
    },
    Job {
        before: &[BENCH],
        command: &["report", "out", "-q", "-o", "page.html"],
        between: &[&[
            "bench",
            "scene.toml",
            "-q",
            "--repeat=1",
            "--frames=3",
            "--warmup=1",
            "--out=out",
            "--force",
        ]],
        new: &["--force"],
        out: "page.html",
        ..NONE
    },
    Job {
        before: &[
            &["farm", "plan", "scene.toml", "--frames=0..3", "-o", "plan"],
            &["farm", "local", "--plan=plan", "-q"],
        ],
        command: &["farm", "merge", "-o", "out"],
        old: &["--plan=plan"],
        between: &[
            &[
                "farm",
                "plan",
                "scene.toml",
                "--frames=1..3",
                "--set=draw.cutoff=2.5",
                "-o",
                "plan2",
            ],
            &["farm", "local", "--plan=plan2", "-q"],
        ],
        new: &["--plan=plan2", "--force"],
        ..NONE
    },
];

impl Job {
    /// Returns the arguments that replace the old results.
    pub fn args(&self) -> Vec<&'static str> {
        [self.command, self.new].concat()
    }
}
