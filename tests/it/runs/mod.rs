//! Renders that are repeated, split, resumed, stopped, or very long; their memory.

mod determinism;
mod limits;
mod long_run;
mod memory;
mod own_process;
mod state_files;
mod stop_rules;
