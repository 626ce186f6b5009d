//! Draws the particles of a job of tools/peers with wgpu-3dgs-viewer, and prints what it took.

use std::error::Error;
use std::time::Instant;

use glam::{Mat4, Quat, U8Vec4, UVec2, Vec3, Vec4};
use serde_json::{Value, json};
use wgpu_3dgs_viewer::core::{
    Gaussian, GaussianDisplayMode, GaussianMaxStdDev, GaussianShDegree,
};
use wgpu_3dgs_viewer::{CameraTrait, Viewer};

/// Its fragments fall off with exp(-r²), where r is 2/(s√λ) times the distance in pixels, λ the
/// eigenvalue of the covariance and s this number. With √8 that is the Gaussian, cut at 4 sigma.
const MAX_STD_DEV: f32 = 2.828_427_1;

/// A row of `particles`: x, y, z, sigma, opacity, r, g, b.
const ROW: usize = 8;

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

struct Camera {
    eye: Vec3,
    target: Vec3,
    fov_y: f32,
}

impl CameraTrait for Camera {
    fn view(&self) -> Mat4 {
        Mat4::look_at_rh(self.eye, self.target, Vec3::Y)
    }

    fn projection(&self, aspect_ratio: f32) -> Mat4 {
        Mat4::perspective_rh(self.fov_y, aspect_ratio, 1.0, 30.0)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("expected a job")?;
    let job: Value = serde_json::from_str(&std::fs::read_to_string(path)?)?;
    let text = |key: &str| job[key].as_str().ok_or(format!("the job has no `{key}`"));
    let number = |key: &str| job[key].as_f64().ok_or(format!("the job has no `{key}`"));
    let size = UVec2::new(number("width")? as u32, number("height")? as u32);
    let target = vector(&job["target"]);
    let fov_y = (number("fov_y_deg")? as f32).to_radians();
    let eyes: Vec<Vec3> = job["eyes"].as_array().ok_or("no eyes")?.iter().map(vector).collect();
    let gaussians = particles(&std::fs::read(text("particles")?)?);

    let mut of = wgpu::InstanceDescriptor::new_without_display_handle();
    of.backends = wgpu::Backends::VULKAN;
    let instance = wgpu::Instance::new(of);
    let adapter =
        pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))?;
    let (device, queue) =
        pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            required_limits: adapter.limits(),
            ..Default::default()
        }))?;
    let picture = device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let view = picture.create_view(&wgpu::TextureViewDescriptor::default());
    let mut viewer: Viewer = Viewer::new(&device, FORMAT, &gaussians)?;
    viewer.update_gaussian_transform(
        &queue,
        1.0,
        GaussianDisplayMode::Splat,
        GaussianShDegree::new(0).ok_or("a degree")?,
        false,
        GaussianMaxStdDev::new(MAX_STD_DEV).ok_or("a standard deviation")?,
    );
    let mut frame = |eye: Vec3| -> Result<f64, Box<dyn Error>> {
        let begin = Instant::now();
        viewer.update_camera(&queue, &Camera { eye, target, fov_y }, size);
        let mut encoder = device.create_command_encoder(&Default::default());
        viewer.render(&mut encoder, &view);
        queue.submit([encoder.finish()]);
        device.poll(wgpu::PollType::wait_indefinitely())?;
        Ok(begin.elapsed().as_secs_f64() * 1e3)
    };
    let first_ms = frame(eyes[0])?;
    let file = format!("{}.png", text("picture")?);
    save(&file, &read(&device, &queue, &picture, size)?, size)?;
    for _ in 0..number("warm_up")? as usize {
        frame(eyes[0])?;
    }
    let frame_ms = eyes.iter().map(|eye| frame(*eye)).collect::<Result<Vec<f64>, _>>()?;
    let result = json!({
        "tool": "wgpu-3dgs-viewer", "version": "0.7.0", "law": "projected",
        "device": adapter.get_info().name, "first_ms": first_ms, "frame_ms": frame_ms,
        "picture": file, "clock_ns": clock_ns(), "memory_bytes": memory_bytes(),
    });
    println!("{result}");
    Ok(())
}

fn vector(of: &Value) -> Vec3 {
    Vec3::from([0, 1, 2].map(|k| of[k].as_f64().unwrap_or_default() as f32))
}

/// Returns the particles. The library has colours and opacities of 8 bits.
fn particles(bytes: &[u8]) -> Vec<Gaussian> {
    let numbers: Vec<f32> = bytes
        .chunks_exact(4)
        .map(|word| f32::from_le_bytes([word[0], word[1], word[2], word[3]]))
        .collect();
    let of = |row: &[f32]| {
        let color = 255.0 * Vec4::new(row[5], row[6], row[7], row[4]);
        let color = color.round().clamp(Vec4::ZERO, Vec4::splat(255.0)).to_array();
        Gaussian {
            rot: Quat::IDENTITY,
            pos: Vec3::new(row[0], row[1], row[2]),
            color: U8Vec4::from(color.map(|v| v as u8)),
            sh: [Vec3::ZERO; 15],
            scale: Vec3::splat(row[3]),
        }
    };
    numbers.chunks_exact(ROW).map(of).collect()
}

/// Returns the pixels of the picture, four bytes each.
fn read(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    picture: &wgpu::Texture,
    size: UVec2,
) -> Result<Vec<u8>, Box<dyn Error>> {
    let row = (4 * size.x).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(row) * u64::from(size.y),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    encoder.copy_texture_to_buffer(
        picture.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(row),
                rows_per_image: None,
            },
        },
        picture.size(),
    );
    queue.submit([encoder.finish()]);
    buffer.slice(..).map_async(wgpu::MapMode::Read, |mapped| {
        if let Err(error) = mapped {
            eprintln!("{error}");
        }
    });
    device.poll(wgpu::PollType::wait_indefinitely())?;
    let bytes = buffer.slice(..).get_mapped_range();
    let rows = bytes.chunks_exact(row as usize).map(|of| &of[..4 * size.x as usize]);
    Ok(rows.flatten().copied().collect())
}

/// Writes the red, green and blue of the pixels.
fn save(path: &str, pixels: &[u8], size: UVec2) -> Result<(), Box<dyn Error>> {
    let mut encoder = png::Encoder::new(std::fs::File::create(path)?, size.x, size.y);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let rgb: Vec<u8> = pixels.chunks_exact(4).flat_map(|p| p[..3].to_vec()).collect();
    encoder.write_header()?.write_image_data(&rgb)?;
    Ok(())
}

/// Returns the smallest step of the clock among some readings.
fn clock_ns() -> f64 {
    let step = || {
        let begin = Instant::now();
        loop {
            let ns = begin.elapsed().as_nanos();
            if ns > 0 {
                return ns;
            }
        }
    };
    (0..1000).map(|_| step()).min().unwrap_or_default() as f64
}

/// Returns the most memory that the process has had.
fn memory_bytes() -> u64 {
    // SAFETY: all zeros are a value of this record of integers.
    let mut usage: libc::rusage = unsafe { std::mem::zeroed() };
    // SAFETY: the pointer is to a record of this function.
    let ok = unsafe { libc::getrusage(libc::RUSAGE_SELF, &raw mut usage) } == 0;
    if ok { usage.ru_maxrss as u64 * 1024 } else { 0 }
}
