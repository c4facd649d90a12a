//! Hosts, numbers, files and scenes at the ends of what is possible, and beyond.

mod extreme_numbers;
mod faulty_host;
mod host;
mod lookups;
mod parsers;
mod stress;
