//! Weather files: what is read, what is refused, and the particles made from them.

#[path = "../harness/columns.rs"]
mod columns;
mod damaged;
mod diagnosed;
mod files;
mod input;
mod particles;
#[path = "../harness/program.rs"]
mod program;
#[path = "../harness/readers.rs"]
mod readers;
mod scene;
#[path = "../harness/weather_files.rs"]
mod weather_files;
