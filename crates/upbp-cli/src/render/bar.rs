//! The progress bar: fits any terminal of 40 columns and more, and stays where it is when a render is
//! stopped.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Template of a line: the message takes what the bar leaves of it and is cut at the end.
const LINE: &str = "{elapsed_precise} {bar:20} {percent:>3} %  {wide_msg}";

/// A progress bar on a terminal; elsewhere, lines now and then.
pub(crate) struct Bar {
    bar: ProgressBar,
    /// Iterations that the last line told of, where lines stand for the bar.
    lines: Option<AtomicU64>,
}

impl Bar {
    /// Makes a bar on the standard error; a quiet one shows nothing.
    pub(crate) fn on_stderr(quiet: bool) -> Self {
        let bar = if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let lines = !quiet && !std::io::stderr().is_terminal();
        let bar = Self { bar: Self::on(bar), lines: lines.then(AtomicU64::default) };
        // Iterations take seconds: the clock moves meanwhile.
        bar.bar.enable_steady_tick(Duration::from_millis(200));
        bar
    }

    fn on(target: ProgressDrawTarget) -> ProgressBar {
        // A length of 100, so that no percent is shown before it is done.
        let bar = ProgressBar::with_draw_target(Some(100), target);
        if let Ok(style) = ProgressStyle::with_template(LINE) {
            bar.set_style(style);
        }
        bar
    }

    /// Shows which step of the preparation begins.
    pub(crate) fn prepare(&self, step: &'static str) {
        self.bar.set_message(step);
    }

    /// Shows how many iterations and which fraction of the work are done.
    pub(crate) fn show(&self, iterations: u64, fraction: f64, message: String) {
        let percent = (100.0 * fraction) as u64;
        if let Some(told) = &self.lines
            && iterations.is_power_of_two()
            && told.swap(iterations, Ordering::Relaxed) != iterations
        {
            crate::exit::complain(&format!("{percent:3} %  {message}"));
        }
        self.bar.set_position(percent);
        self.bar.set_message(message);
    }

    /// Ends the bar: at 100 %, or where a render was stopped.
    pub(crate) fn end(self, is_done: bool) {
        if is_done {
            self.bar.finish();
        } else {
            self.bar.abandon();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io;
    use std::sync::{Arc, Mutex};

    use indicatif::TermLike;

    use super::*;

    /// A terminal of 80 columns that remembers what is written.
    #[derive(Clone, Debug, Default)]
    struct Terminal(Arc<Mutex<Vec<String>>>);

    impl TermLike for Terminal {
        fn width(&self) -> u16 {
            80
        }
        fn move_cursor_up(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn move_cursor_down(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn move_cursor_right(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn move_cursor_left(&self, _: usize) -> io::Result<()> {
            Ok(())
        }
        fn write_line(&self, text: &str) -> io::Result<()> {
            self.write_str(text)
        }
        fn write_str(&self, text: &str) -> io::Result<()> {
            self.0.lock().unwrap().push(text.to_owned());
            Ok(())
        }
        fn clear_line(&self) -> io::Result<()> {
            Ok(())
        }
        fn flush(&self) -> io::Result<()> {
            Ok(())
        }
    }

    /// The lines of a render that ends at 37.9 %.
    fn lines(message: &str, is_done: bool) -> Vec<String> {
        let terminal = Terminal::default();
        let target = ProgressDrawTarget::term_like(Box::new(terminal.clone()));
        let bar = Bar { bar: Bar::on(target), lines: None };
        bar.show(5, 0.379, message.to_owned());
        bar.end(is_done);
        let lines = terminal.0.lock().unwrap();
        lines.iter().filter(|line| !line.trim().is_empty()).cloned().collect()
    }

    #[test]
    fn a_line_fits_80_columns() {
        let usual = "iteration 123456, 100 s left, relMSE 1.2e-3";
        for (message, is_cut) in [(usual.to_owned(), false), (usual.repeat(3), true)] {
            let lines = lines(&message, true);
            assert!(!lines.is_empty() && lines.iter().all(|line| line.chars().count() <= 80), "{lines:?}");
            assert_eq!(!lines.iter().any(|line| line.contains(&message)), is_cut, "{lines:?}");
        }
    }

    #[test]
    fn only_what_is_done_is_at_100_percent() {
        let (stopped, done) = (lines("", false), lines("", true));
        assert!(stopped.last().is_some_and(|line| line.contains(" 37 %")), "{stopped:?}");
        assert!(stopped.iter().all(|line| !line.contains("100 %")), "{stopped:?}");
        assert!(done.last().is_some_and(|line| line.contains("100 %")), "{done:?}");
    }
}
