//! Tests of the crates together, in one program: to link everything once takes less time than to do so for
//! each file.
//!
//! * [`known_answers`]: closed forms, tables of transport theory, images of an independent renderer.
//! * [`agreement`]: different ways to compute a picture give the same picture.
//! * [`plans`]: the choice of techniques.
//! * [`runs`]: renders that are repeated, split, resumed, stopped, or very long; their memory.
//! * [`hostile`]: hosts, numbers, files and scenes at the ends of what is possible, and beyond.
//! * [`documents`]: links, citations and examples of the documents.

mod agreement;
mod documents;
mod hostile;
mod known_answers;
mod plans;
mod runs;
