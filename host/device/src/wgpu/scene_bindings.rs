//! Bindings of a launch's arrays. Those of a scene share a few buffers, because WebGPU guarantees
//! eight storage buffers.

use super::NAME;
use super::memory::{Part, ROW};
use crate::command::{handles, misuse};
use crate::{BackendError, Dispatch};
use trisect_kernels::{COUNTER, EntryPoint, SCENE_BINDINGS};
use trisect_shared::scene::FirstRows;
use wgpu::Buffer;

/// Returns the number of buffers that an entry point only reads.
pub(super) fn reads(of: EntryPoint) -> usize {
    if of.reads_scene() { SCENE_BINDINGS.len() } else { of.reads }
}

/// Returns the number of buffers that an entry point writes.
pub(super) fn writes(of: EntryPoint) -> usize {
    if has_counter(of) { of.writes } else { of.writes.saturating_sub(1) }
}

/// Returns whether an entry point binds all arrays that it writes: a render kernel without a queue
/// leaves out the counter.
fn has_counter(of: EntryPoint) -> bool {
    of.queue || !of.reads_scene()
}

/// Returns the bytes of an entry point's launch parameters as its module reads them.
pub(super) fn params_bytes(of: EntryPoint) -> usize {
    of.params + if of.reads_scene() { size_of::<FirstRows>() } else { 0 }
}

/// Returns the buffers of a launch, in the order of their bindings.
pub(super) fn buffers<'a>(launch: &Dispatch<'a>) -> Result<Vec<&'a Buffer>, BackendError> {
    let of = launch.entry_point;
    let parts = handles::<Part>(launch, NAME)?;
    let (scene, others) = match of.reads_scene() {
        true => parts.split_at(of.reads.min(parts.len())),
        false => (&[][..], &parts[..]),
    };
    let mut buffers = Vec::new();
    if of.reads_scene() {
        for binding in SCENE_BINDINGS {
            let mut own = binding.iter().filter_map(|&index| scene.get(index));
            let first = own.next().filter(|first| first.first == 0);
            let first = first.ok_or_else(|| misuse(NAME, "an array of the scene begins no buffer"))?;
            if own.any(|other| other.buffer != first.buffer) {
                return Err(misuse(NAME, "arrays of the scene do not share a buffer"));
            }
            buffers.push(&first.buffer);
        }
    }
    for part in others.iter().take(of.arrays().saturating_sub(scene.len())) {
        if part.first != 0 {
            return Err(misuse(NAME, "an array is a part of a buffer"));
        }
        buffers.push(&part.buffer);
    }
    let counter = SCENE_BINDINGS.len() + COUNTER;
    if of.reads_scene() && counter < buffers.len() {
        let counter = buffers.remove(counter);
        buffers.extend(has_counter(of).then_some(counter));
    }
    Ok(buffers)
}

/// Returns the places of a scene's arrays in their buffers.
pub(super) fn first_rows(launch: &Dispatch<'_>) -> Result<FirstRows, BackendError> {
    let parts = handles::<Part>(launch, NAME)?;
    let row = |index: usize| -> Result<u32, BackendError> {
        let first = parts.get(index).map_or(0, |part| part.first / ROW);
        u32::try_from(first).map_err(|_| misuse(NAME, "an array of the scene begins beyond 64 GiB"))
    };
    let (spheres, vertices) = (row(0)?, row(5)?);
    let (lights, textures, environment) = (row(6)?, row(7)?, row(9)?);
    Ok(FirstRows { vertices, spheres, lights, textures, environment, pad0: 0, pad1: 0, pad2: 0 })
}
