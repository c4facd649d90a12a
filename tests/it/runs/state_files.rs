//! State files that are cut off, changed or of somebody else are refused, whatever is in them.

use std::ops::ControlFlow;
use std::sync::OnceLock;

use proptest::prelude::*;
use upbp_core::{LightPaths, Renderer, Settings, State, StateError, Stop, TechniqueSet};
use upbp_scene::ReadyScene;
use upbp_testing::readers::sealed;

/// The render that good states are of.
fn renderer(room: &ReadyScene) -> Renderer<'_> {
    let settings = Settings {
        techniques: TechniqueSet::STANDARD.into(),
        light_paths: LightPaths::Count(100),
        ..Settings::default()
    };
    let mut renderer = upbp_testing::comparing_renderer(room, settings);
    renderer.identify_scene("room", b"room");
    renderer
}

/// The bytes of a good state.
fn good() -> &'static [u8] {
    static BYTES: OnceLock<Vec<u8>> = OnceLock::new();
    BYTES.get_or_init(|| {
        let room = upbp_testing::room(5);
        let mut renderer = renderer(&room);
        for range in [0..2, 7..8] {
            renderer.set_range(range);
            renderer.render(&Stop::default(), |_| ControlFlow::Continue(()));
        }
        let mut bytes = Vec::new();
        renderer.state().write(&mut bytes).expect("a vector takes all");
        bytes
    })
}

#[test]
fn a_state_survives() {
    let state = State::read(good()).expect("a good state");
    assert_eq!(state.film().iteration_set().to_string(), "0..2, 7..8");
    let compared: Vec<_> = state.report().series.points().iter().map(|point| point.iterations).collect();
    assert_eq!(compared, [1, 2, 3]);
    let mut again = Vec::new();
    state.write(&mut again).expect("a vector takes all");
    assert!(again == good(), "reading and writing gives the same bytes");
}

#[test]
fn every_cut_is_seen() {
    for end in 0..good().len() {
        let error = State::read(&good()[..end]).expect_err("a cut file");
        let expected = if end < 12 {
            matches!(error, StateError::NotAState)
        } else {
            matches!(error, StateError::Damaged { .. })
        };
        assert!(expected, "{end}: {error}");
    }
    let longer = [good(), b"x"].concat();
    assert!(matches!(State::read(longer.as_slice()), Err(StateError::Damaged { .. })));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn every_changed_bit_is_seen(place in any::<prop::sample::Index>(), bit in 0..8_u8) {
        let mut bytes = good().to_vec();
        bytes[place.index(good().len())] ^= 1 << bit;
        prop_assert!(State::read(bytes.as_slice()).is_err());
    }

    #[test]
    fn anything_else_is_refused(
        bytes in proptest::collection::vec(any::<u8>(), 0..200),
        keep in 0..64_usize,
    ) {
        prop_assert!(State::read(bytes.as_slice()).is_err());
        // The same behind a good beginning.
        let mixed = [&good()[..keep], &bytes].concat();
        prop_assert!(State::read(mixed.as_slice()).is_err());
    }
}

/// The header of the good state.
fn header() -> &'static str {
    let length = u32::from_le_bytes(good()[12..16].try_into().expect("four bytes")) as usize;
    str::from_utf8(&good()[16..16 + length]).expect("text")
}

/// A file with a header of our own, its checksum right: what a program with bad intentions would write.
fn forged(header: &str) -> Vec<u8> {
    sealed(&[&good()[..16], header.as_bytes()].concat())
}

#[test]
fn sizes_in_a_header_cost_no_memory() {
    let header = header();
    assert_eq!(forged(header), good()[..16 + header.len() + 8], "the forger knows the format");

    let huge = header
        .replace("film:(5,5)", "film:(4294967295,4294967295)")
        .replace("crop:(x:0,y:0,width:5,height:5)", "crop:(x:0,y:0,width:4294967295,height:4294967295)");
    assert_ne!(huge, header);
    let error = State::read(forged(&huge).as_slice()).expect_err("no sums follow");
    assert!(error.to_string().contains("row 0 of 4294967295"), "{error}");
    // A block that says that it has four gigabytes, and does not.
    let mut bytes = forged(&huge);
    bytes.extend([0xff; 4]);
    bytes.extend([0; 1000]);
    assert!(State::read(bytes.as_slice()).expect_err("a cut file").to_string().contains("ends here"));

    for (from, to) in [
        ("crop:(x:0,y:0,width:5,height:5)", "crop:(x:1,y:0,width:5,height:5)"),
        ("crop:(x:0,y:0,width:5,height:5)", "crop:(x:4294967295,y:0,width:5,height:5)"),
        ("crop:(x:0,y:0,width:5,height:5)", "crop:(x:0,y:0,width:0,height:5)"),
        ("[(0,2),(7,8)]", "[(7,8),(0,2)]"),
        ("[(0,2),(7,8)]", "[(0,99999999999)]"),
        ("begun:{}", "begun:{7:1}"),
        ("begun:{}", "begun:{3:0}"),
        ("begun:{}", "begun:{3:256}"),
        ("begun:{}", "begun:{99999999999:1}"),
        ("seed:0", "seed:-1"),
        ("seed:0", "seeds:0"),
    ] {
        let changed = header.replace(from, to);
        assert_ne!(changed, header, "{from}");
        let error = State::read(forged(&changed).as_slice()).expect_err(to);
        assert!(error.to_string().contains("header"), "{to}: {error}");
    }
}

#[test]
fn a_state_of_other_samples_is_refused() {
    let room = upbp_testing::room(5);
    let mut renderer = renderer(&room);
    let own = renderer.state().identity().samples;
    let other = header().replace(&format!("samples:{own},"), &format!("samples:{},", own + 1));
    assert_ne!(other, header());
    let rows = &good()[16 + header().len()..];
    let state = State::read(sealed(&[&good()[..16], other.as_bytes(), rows].concat()).as_slice());
    let error = renderer.resume(state.expect("a whole state")).expect_err("other samples").to_string();
    let expected = format!("version of samples is {own} in one and {} in the other", own + 1);
    assert!(error.contains(&expected), "{error}");
    assert!(renderer.film().is_empty());
}

#[test]
fn counts_and_times_of_any_size_are_merged_reported_and_resumed() {
    let read = |iterations: &str| {
        let mut changed = header().replace("[(0,2),(7,8)]", iterations);
        for count in ["dropped", "cut_walks", "lost_walks", "boundary_conflicts"] {
            changed = changed.replace(&format!("{count}:0"), &format!("{count}:{}", u64::MAX));
        }
        changed = changed.replace("secs:0,", &format!("secs:{},", u64::MAX));
        let rows = &good()[16 + header().len()..];
        State::read(sealed(&[&good()[..16], changed.as_bytes(), rows].concat()).as_slice()).expect("a state")
    };
    let mut state = read("[(0,2),(7,8)]");
    state.merge(read("[(3,6)]")).expect("no iterations in common");
    let text = state.report().to_string();
    assert!(text.contains(&format!("{} walks were lost", u64::MAX)), "{text}");
    let room = upbp_testing::room(5);
    let mut renderer = renderer(&room);
    renderer.resume(state).expect("the same render");
    assert!(renderer.iterate());
    assert_eq!(renderer.film().iteration_set().to_string(), "0..6, 7..8");
}
