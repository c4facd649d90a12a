//! Scenes from files: what is refused, what ships, and what the checkers say.

mod checkers;
mod enclosures;
mod errors;
mod mesh_files;
mod no_effect;
mod placement;
mod pointers;
mod rooms;
mod shipped_scenes;
mod skies;
mod unseen;
mod vessels;
