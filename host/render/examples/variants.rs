//! Times a loop over variants of a scene: an edit of a material, an update of the renderer, a
//! render and its image, for each.
//!
//! ```text
//! cargo run --release -p trisect --example variants -- COUNT [THREADS]
//! ```
//!
//! Prints the seconds of the loop, those of its renders, the processor time of the loop in seconds
//! (Linux; 0 elsewhere), and a mean over all images.
//! `host/python/overhead.py` runs the same loop from Python and compares both.
#![allow(clippy::unwrap_used, reason = "a tool for the terminal")]

use std::error::Error;
use std::time::Instant;
use trisect::device::cpu::Cpu;
use trisect::render::{Renderer, Settings};
use trisect::scene::{AnimatedScene, FieldEdit, LoadOptions};

const SIZE: (u32, u32) = (64, 36);
const SAMPLES: u32 = 16;

/// Number of variants before those that are timed.
const WARM_UP: u32 = 50;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let count: u32 = arguments.next().ok_or("usage: variants COUNT [THREADS]")?.parse()?;
    let threads = arguments.next().map(|threads| threads.parse()).transpose()?;
    let mut animated = AnimatedScene::hello_world(&LoadOptions::default())?;
    let mut renderer = Renderer::new(Cpu::open(threads)?, &animated.set_edits(Vec::new(), 0.0)?)?;
    let all = count.checked_add(WARM_UP).ok_or("COUNT is too large")?;
    let (mut sum, mut rendering, mut used) = (0.0, 0.0, 0.0);
    let mut start = Instant::now();
    for step in 0..all {
        if step == WARM_UP {
            (sum, rendering, used, start) = (0.0, 0.0, processor_seconds(), Instant::now());
        }
        let albedo = f64::from(step) / f64::from(all);
        let edit: FieldEdit = format!("materials.clay.albedo=({albedo}, 0.25, 0.2)").parse()?;
        let scene = animated.set_edits(vec![edit], 0.0)?;
        renderer.update_scene(&scene, None)?;
        let settings = Settings { samples: SAMPLES, ..Settings::of(&scene).size(SIZE.0, SIZE.1) };
        let begun = Instant::now();
        let frame = renderer.render(&settings)?;
        rendering += begun.elapsed().as_secs_f64();
        sum += f64::from(frame.image().pixels[0][0]);
    }
    let seconds = start.elapsed().as_secs_f64();
    let processor = processor_seconds() - used;
    println!("{seconds} {rendering} {processor} {}", sum / f64::from(count));
    Ok(())
}

/// Returns the processor time of all threads of the process, in seconds; 0 where the system does
/// not state it.
fn processor_seconds() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let statistics = tasks.filter_map(|task| std::fs::read_to_string(task.path().join("schedstat")).ok());
    let nanoseconds = statistics.filter_map(|text| text.split(' ').next()?.parse::<u64>().ok());
    nanoseconds.sum::<u64>() as f64 / 1e9
}
