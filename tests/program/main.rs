//! The program as users run it, its documentation, and devices that are named, missing or lost.

mod backends;
mod background;
mod bad_input;
mod bad_media;
mod bad_models;
mod checkpoint;
mod command_line;
mod docs;
mod fallback;
mod foreign_scenes;
mod killed;
mod lost_context;
mod models;
mod motion;
mod oidn;
mod resources;
mod shell;
mod surroundings;
mod tone_maps;
mod tradeoff;
mod viewer;
