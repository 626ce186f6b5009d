//! Weather files made by hand: NetCDF classic in its three versions ("The NetCDF Classic Format
//! Specification"), and a small WRF file that tests modify.

#![allow(dead_code, reason = "each test binary uses its own part")]

use std::io::{self, Write};

pub enum Attr {
    Text(String),
    Int(i32),
    Float(f32),
}

pub enum Data {
    /// The same values at every step.
    Floats(Vec<f32>),
    /// Own values at every step.
    Rows(Vec<String>),
}

pub struct Var {
    pub name: String,
    /// Indices of dimensions; index 0 is Time, the record dimension.
    pub dims: Vec<usize>,
    pub attrs: Vec<(String, Attr)>,
    pub data: Data,
}

pub struct Made {
    /// 1, 2 or 5.
    pub version: u8,
    pub n_steps: u32,
    pub dims: Vec<(String, u64)>,
    pub attrs: Vec<(String, Attr)>,
    pub vars: Vec<Var>,
}

pub const NX: usize = 4;
pub const NY: usize = 3;
pub const NZ: usize = 5;

impl Made {
    /// Returns a complete WRF file of 4 × 3 columns and 5 levels of 500 m, with a cloud on the
    /// second and third level of three columns.
    pub fn wrf(version: u8, n_steps: u32) -> Self {
        Made::wrf_of(version, n_steps, [NX, NY, NZ])
    }

    pub fn wrf_of(version: u8, n_steps: u32, [nx, ny, nz]: [usize; 3]) -> Self {
        let names =
            ["Time", "DateStrLen", "west_east", "south_north", "bottom_top", "bottom_top_stag"];
        let lengths = [0, 19, nx, ny, nz, nz + 1];
        let plane = nx * ny;
        let of_level = |n: usize, f: &dyn Fn(f32) -> f32| {
            (0..n * plane).map(|i| f((i / plane) as f32)).collect()
        };
        let (cells, levels, columns) = (vec![0, 4, 3, 2], vec![0, 5, 3, 2], vec![0, 3, 2]);
        let pressure = |k: f32| 1e5 * (-(k + 0.5) * 500.0 / 8000.0).exp();
        let cloud = (0..nz * plane)
            .map(|i| if matches!(i / plane, 1 | 2) && i % plane < 3 { 2e-4 } else { 0.0 });
        let floats = |name: &str, dims: &[usize], units: &str, numbers: Vec<f32>| Var {
            name: name.to_owned(),
            dims: dims.to_vec(),
            attrs: vec![("units".to_owned(), Attr::Text(units.to_owned()))],
            data: Data::Floats(numbers),
        };
        let times = (0..n_steps)
            .map(|i| format!("2005-08-28_{:02}:{:02}:00", 12 + i / 60, i % 60))
            .collect();
        let vars = vec![
            Var {
                name: "Times".to_owned(),
                dims: vec![0, 1],
                attrs: vec![],
                data: Data::Rows(times),
            },
            floats("P", &cells, "Pa", vec![0.0; nz * plane]),
            floats("PB", &cells, "Pa", of_level(nz, &pressure)),
            floats("T", &cells, "K", of_level(nz, &|k| k * 2.0 - 5.0)),
            floats("PH", &levels, "m2 s-2", vec![0.0; (nz + 1) * plane]),
            floats("PHB", &levels, "m2 s-2", of_level(nz + 1, &|k| 9.81 * 500.0 * k)),
            floats("QVAPOR", &cells, "kg kg-1", of_level(nz, &|k| 0.01 / (1.0 + k))),
            floats("QCLOUD", &cells, "kg kg-1", cloud.collect()),
            floats("MAPFAC_M", &columns, "", vec![0.0; plane]),
            floats("HGT", &columns, "m", vec![0.0; plane]),
        ];
        let attrs = vec![
            ("TITLE".to_owned(), Attr::Text(" OUTPUT FROM WRF V4.2.2 MODEL".to_owned())),
            ("DX".to_owned(), Attr::Float(1000.0)),
            ("DY".to_owned(), Attr::Float(1000.0)),
            ("MAP_PROJ".to_owned(), Attr::Int(0)),
            ("MP_PHYSICS".to_owned(), Attr::Int(6)),
        ];
        let dims =
            names.iter().zip(lengths).map(|(name, n)| ((*name).to_owned(), n as u64)).collect();
        Made { version, n_steps, dims, attrs, vars }
    }

    /// Adds U and V of one wind, m/s eastward and northward.
    pub fn with_wind(mut self, [u, v]: [f32; 2]) -> Self {
        for (name, (axis, wind)) in [("U", (2, u)), ("V", (3, v))] {
            let staggered = self.dims.len();
            let (of, length) = &self.dims[axis];
            self.dims.push((format!("{of}_stag"), length + 1));
            let dims: Vec<usize> =
                [4, 3, 2].map(|d| if d == axis { staggered } else { d }).to_vec();
            let n = dims.iter().map(|d| self.dims[*d].1 as usize).product();
            self.vars.push(Var {
                name: name.to_owned(),
                dims: [vec![0], dims].concat(),
                attrs: vec![("units".to_owned(), Attr::Text("m s-1".to_owned()))],
                data: Data::Floats(vec![wind; n]),
            });
        }
        self
    }

    pub fn without(mut self, name: &str) -> Self {
        self.vars.retain(|v| v.name != name);
        self.attrs.retain(|(n, _)| n != name);
        self
    }

    pub fn var(&mut self, name: &str) -> &mut Var {
        self.vars.iter_mut().find(|v| v.name == name).expect("a variable of the file")
    }

    pub fn with_floats(mut self, name: &str, change: impl Fn(&mut Vec<f32>)) -> Self {
        match &mut self.var(name).data {
            Data::Floats(numbers) => change(numbers),
            Data::Rows(_) => panic!("{name} is text"),
        }
        self
    }

    pub fn with_units(mut self, name: &str, units: &str) -> Self {
        self.var(name).attrs = vec![("units".to_owned(), Attr::Text(units.to_owned()))];
        self
    }

    pub fn with_attr(mut self, name: &str, value: Attr) -> Self {
        self.attrs.retain(|(n, _)| n != name);
        self.attrs.push((name.to_owned(), value));
        self
    }

    pub fn with_times(mut self, times: &[&str]) -> Self {
        self.var("Times").data = Data::Rows(times.iter().map(|t| (*t).to_owned()).collect());
        self
    }

    /// Returns the number of bytes of a step.
    pub fn bytes_of_step(&self) -> usize {
        self.vars.iter().filter(|v| v.has_steps()).map(|v| v.record(0).len()).sum()
    }

    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        self.write(&mut bytes).expect("memory takes it");
        bytes
    }

    /// Header; variables without steps; then the others, step by step.
    pub fn write(&self, to: &mut impl Write) -> io::Result<()> {
        // The header's length does not depend on its offsets.
        let mut offset = self.header(&vec![0; self.vars.len()]).len() as u64;
        let mut begins = vec![0; self.vars.len()];
        for with_steps in [false, true] {
            for (begin, var) in
                begins.iter_mut().zip(&self.vars).filter(|(_, v)| v.has_steps() == with_steps)
            {
                *begin = offset;
                offset += var.record(0).len() as u64;
            }
        }
        to.write_all(&self.header(&begins))?;
        for var in self.vars.iter().filter(|v| !v.has_steps()) {
            to.write_all(&var.record(0))?;
        }
        for i_step in 0..self.n_steps as usize {
            for var in self.vars.iter().filter(|v| v.has_steps()) {
                to.write_all(&var.record(i_step))?;
            }
        }
        Ok(())
    }

    fn header(&self, begins: &[u64]) -> Vec<u8> {
        let mut out = Header { version: self.version, bytes: vec![b'C', b'D', b'F', self.version] };
        out.count(u64::from(self.n_steps));
        out.list(10, self.dims.len());
        for (name, length) in &self.dims {
            out.name(name);
            out.count(*length);
        }
        out.attrs(&self.attrs);
        out.list(11, self.vars.len());
        for (var, begin) in self.vars.iter().zip(begins) {
            out.name(&var.name);
            out.count(var.dims.len() as u64);
            var.dims.iter().for_each(|d| out.count(*d as u64));
            out.attrs(&var.attrs);
            out.word(if matches!(var.data, Data::Floats(_)) { 5 } else { 2 });
            out.count(var.record(0).len() as u64);
            if self.version == 1 {
                out.word(*begin as u32)
            } else {
                out.bytes.extend(begin.to_be_bytes())
            }
        }
        out.bytes
    }
}

impl Var {
    fn has_steps(&self) -> bool {
        self.dims.first() == Some(&0)
    }

    fn record(&self, i_step: usize) -> Vec<u8> {
        let mut bytes: Vec<u8> = match &self.data {
            Data::Floats(numbers) => numbers.iter().flat_map(|n| n.to_be_bytes()).collect(),
            Data::Rows(rows) => rows.get(i_step).map_or(vec![0; 19], |row| row.as_bytes().to_vec()),
        };
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        bytes
    }
}

struct Header {
    version: u8,
    bytes: Vec<u8>,
}

impl Header {
    fn word(&mut self, n: u32) {
        self.bytes.extend(n.to_be_bytes());
    }

    fn count(&mut self, n: u64) {
        if self.version == 5 { self.bytes.extend(n.to_be_bytes()) } else { self.word(n as u32) }
    }

    fn list(&mut self, tag: u32, n: usize) {
        self.word(if n == 0 { 0 } else { tag });
        self.count(n as u64);
    }

    fn padded(&mut self, bytes: &[u8]) {
        self.bytes.extend(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
    }

    fn name(&mut self, name: &str) {
        self.count(name.len() as u64);
        self.padded(name.as_bytes());
    }

    fn attrs(&mut self, attrs: &[(String, Attr)]) {
        self.list(12, attrs.len());
        for (name, value) in attrs {
            self.name(name);
            match value {
                Attr::Text(text) => {
                    self.word(2);
                    self.count(text.len() as u64);
                    self.padded(text.as_bytes());
                }
                Attr::Int(n) => {
                    self.word(4);
                    self.count(1);
                    self.bytes.extend(n.to_be_bytes());
                }
                Attr::Float(n) => {
                    self.word(5);
                    self.count(1);
                    self.bytes.extend(n.to_be_bytes());
                }
            }
        }
    }
}

/// Returns the message when a file is opened and every step of it read.
pub fn message_of(bytes: &[u8]) -> String {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("bad.nc");
    std::fs::write(&path, bytes).expect("written");
    let error = match nimbus::io::weather::wrf::open(&path) {
        Err(error) => error,
        Ok(file) => (0..file.n_steps)
            .find_map(|i| file.step(i).err().or_else(|| file.terrain(i).err()))
            .expect("an error"),
    };
    assert_eq!(error.exit_code(), 2, "{error}");
    let message = error.to_string();
    let place = format!("{}: ", path.display());
    message.strip_prefix(&place).unwrap_or_else(|| panic!("no place: {message}")).to_owned()
}
