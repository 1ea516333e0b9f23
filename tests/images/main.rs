//! Films and images that the library renders: equal on every backend, independent of how the work
//! is divided, and compared with other programs, known answers and bits on record.

mod book;
mod bumps;
mod coat_maps;
mod crop;
mod cycles;
mod determinism;
mod edits;
mod equivalence;
mod estimators;
mod every_scene;
mod film_bits;
mod flip;
mod foreign_scenes;
mod grown_film;
mod guides;
mod layers;
mod light_groups;
mod light_tree;
mod media;
mod mesh_attributes;
mod methods;
mod mitsuba;
mod motion;
mod oidn;
mod parallel;
mod portals;
mod refracted;
mod sampling;
mod scenes;
mod summation;
mod sun_sky;
mod temporal;
mod transport;
mod view_layers;
mod wide;
