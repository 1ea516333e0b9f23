//! The program as users run it, its documentation, and devices that are named, missing or lost.

mod backends;
mod background;
mod bad_input;
mod bad_media;
mod bad_models;
mod cameras;
mod checkpoint;
mod command_line;
mod compare_page;
mod docs;
mod fallback;
mod foreign_scenes;
mod image_files;
mod killed;
mod lost_context;
mod models;
mod motion;
mod oidn;
mod preview;
mod resources;
mod shell;
mod strict;
mod surroundings;
mod tone_maps;
mod tradeoff;
mod viewer;
