//! The physics of the shared crate: distributions, energy, reciprocity, light sampling, scales.
//! Every test of equality has a twin with a planted fault that it must find. A build with debug
//! assertions draws fewer samples and leaves the twins to the release build, which finds them.
#![allow(unsafe_code, reason = "calls what reads without bounds checks; the scenes are whole")]

mod chart;
mod chi_square;
mod critical_angle;
mod environment;
mod furnace;
mod lights;
mod lookups;
mod materials;
mod mesh;
mod powers;
mod random;
mod reciprocity;
mod reintersection;
mod scales;
mod slabs;
mod statistics;
