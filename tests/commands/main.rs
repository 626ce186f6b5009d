//! The commands of the program, as users run them.

#[path = "../harness/browser.rs"]
mod browser;
mod cli;
mod cli_basis;
mod cli_weather;
mod compare;
mod compare_pictures;
mod defaults;
#[path = "../harness/display.rs"]
mod display;
#[path = "../harness/driver_files.rs"]
mod driver_files;
mod edit;
mod edit_killed;
mod error_probe;
mod error_studies;
mod export;
#[path = "../harness/fixtures.rs"]
mod fixtures;
#[path = "../harness/generated.rs"]
mod generated;
mod guard;
mod history;
mod interrupted;
mod interrupted_anywhere;
#[path = "../harness/jobs.rs"]
mod jobs;
mod kept_paths;
mod lowered_limits;
mod plots;
mod ply;
#[path = "../harness/program.rs"]
mod program;
mod records;
mod render_frames;
mod render_reference;
mod report;
#[path = "../harness/results.rs"]
mod results;
mod results_kept;
mod roof;
mod second_driver;
mod shown;
#[path = "../harness/signals.rs"]
mod signals;
mod slices;
mod state;
mod stress_drivers;
#[path = "../harness/studies.rs"]
mod studies;
mod studies_input;
#[path = "../harness/svg.rs"]
mod svg;
#[path = "../harness/swiftshader.rs"]
mod swiftshader;
#[path = "../harness/tiny.rs"]
mod tiny;
mod tradeoff;
#[path = "../harness/weather_files.rs"]
mod weather_files;
