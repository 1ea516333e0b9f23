//! Physics of the shared crate: distributions, energy, reciprocity, light sampling, scales.
//!
//! Each test of equality has a negative control, a planted fault that it must find. A build with
//! debug assertions draws fewer samples, and leaves some negative controls to the release build.
#![allow(unsafe_code, reason = "calls functions that read without bounds checks, on complete scenes")]

mod chart;
mod chi_square;
mod critical_angle;
mod environment;
mod furnace;
mod lights;
mod lobe_choice;
mod lookups;
mod materials;
mod media;
mod mesh;
mod portals;
mod powers;
mod random;
mod reciprocity;
mod reintersection;
mod scales;
mod slabs;
mod statistics;
