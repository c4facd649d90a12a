//! A part of the stress matrix, a few cases of each group. All of it: `cargo run --release --example stress`.

use upbp_testing::stress::{Case, all, in_parallel};

/// Judges every n-th case of a group.
fn part(group: &str, every: usize) {
    let cases: Vec<Case> = all().into_iter().filter(|case| case.group == group).step_by(every).collect();
    assert!(cases.len() >= 10, "{group}: {} cases", cases.len());
    let results = in_parallel(cases.len(), 2, |index| cases[index].judge());
    let failures: Vec<String> = cases
        .iter()
        .zip(results)
        .filter_map(|(case, result)| result.err().map(|wrong| format!("{case}: {wrong}")))
        .collect();
    assert!(failures.is_empty(), "{group}: {} failed\n{}", failures.len(), failures.join("\n"));
}

// The strides have no factor in common with the axes.
#[test]
fn media() {
    part("media", 97);
}

#[test]
fn furnaces() {
    part("furnace", 11);
}

#[test]
fn transforms() {
    part("transform", 23);
}

#[test]
fn splits() {
    part("split", 13);
}

#[test]
fn layouts() {
    part("layout", 61);
}

#[test]
fn views() {
    part("view", 89);
}

#[test]
fn kernels() {
    part("kernel", 37);
}

#[test]
fn lengths() {
    part("length", 5);
}

#[test]
fn boundaries() {
    part("boundary", 7);
}

#[test]
fn slabs() {
    part("slab", 13);
}

#[test]
fn cameras_on_photons() {
    part("photon", 31);
}
