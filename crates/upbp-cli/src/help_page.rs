//! `docs/cli.md`: the help of all commands as one page, kept by a test.

use std::fmt::Write as _;
use std::path::Path;

use clap::builder::StyledStr;
use clap::{Arg, Command, CommandFactory as _};

use crate::Cli;

/// The page.
fn page() -> String {
    let mut program = Cli::command().term_width(0);
    program.build();
    let mut page = format!(
        "# The program `upbp`\n\n\
         <!-- Written from the options: `UPDATE=1 cargo test -p upbp-cli help_page`. -->\n\n\
         {}.\n\n\
         ```sh\ncargo install --locked --path crates/upbp-cli\n```\n\n\
         | command | |\n|---|---|\n",
        text(program.get_about())
    );
    let commands: Vec<_> = program.get_subcommands().filter(|command| command.get_name() != "help").collect();
    for command in &commands {
        let name = command.get_name();
        let _ = writeln!(page, "| [`upbp {name}`](#upbp-{name}) | {} |", cell(text(command.get_about())));
    }
    let _ = writeln!(
        page,
        "\n`upbp help COMMAND` prints what is below.\n\
         The file that `--settings` reads is described in [settings](settings.md), what a render prints and writes \
         in [report](report.md)."
    );
    page += &lists("##", program.get_after_help());
    let mut before = String::new();
    for command in commands {
        let options = options(command);
        page += &introduction(command);
        // `upbp check` has those of `upbp render`, which come first.
        if options != before {
            page += &options;
        }
        before = options;
    }
    page
}

/// The section of a command: its purpose and its call.
fn introduction(command: &Command) -> String {
    let about =
        text(command.get_long_about().or(command.get_about())).replace("\n\n", ".\n\n").replace(". ", ".\n");
    let usage = command.clone().render_usage().to_string();
    let usage = usage.trim_start_matches("Usage: ");
    format!("\n## `upbp {}`\n\n{about}\n\n```sh\n{usage}\n```\n", command.get_name())
}

/// The arguments and options of a command by their headings, with the lists that follow them.
fn options(command: &Command) -> String {
    let arguments: Vec<_> = command.get_arguments().filter(|argument| argument.get_id() != "help").collect();
    let heading = |argument: &Arg| match argument.get_help_heading() {
        Some(heading) => heading.to_owned(),
        None if argument.is_positional() => "Arguments".to_owned(),
        None => "Options".to_owned(),
    };
    let mut headings: Vec<String> = Vec::new();
    for argument in &arguments {
        if !headings.contains(&heading(argument)) {
            headings.push(heading(argument));
        }
    }
    let mut options = String::new();
    for name in headings {
        let _ = write!(options, "\n| {name} | |\n|---|---|\n");
        for argument in arguments.iter().filter(|argument| heading(argument) == name) {
            let _ = writeln!(options, "| {} | {} |", cell(spelling(argument)), cell(meaning(argument)));
        }
    }
    options + &lists("###", command.get_after_long_help())
}

/// The spelling of an argument.
fn spelling(argument: &Arg) -> String {
    let values: Vec<_> =
        argument.get_value_names().unwrap_or_default().iter().map(ToString::to_string).collect();
    let takes_values = argument.get_num_args().is_none_or(|range| range.takes_values());
    let value = if takes_values { format!(" {}", values.join(" ")) } else { String::new() };
    let short = argument.get_short().map(|short| format!("`-{short}`, ")).unwrap_or_default();
    match argument.get_long() {
        Some(long) => format!("{short}`--{long}{value}`"),
        None => format!("`{}`", value.trim_start()),
    }
}

/// The help of an argument.
fn meaning(argument: &Arg) -> String {
    let mut meaning = text(argument.get_long_help().or(argument.get_help()));
    let values = argument.get_possible_values();
    if !values.is_empty() && argument.get_num_args().is_none_or(|range| range.takes_values()) {
        let values: Vec<_> = values.iter().map(|value| format!("`{}`", value.get_name())).collect();
        let _ = write!(meaning, " ({})", values.join(", "));
    }
    let defaults = argument.get_default_values();
    if let [default] = defaults
        && argument.get_action().takes_values()
    {
        let _ = write!(meaning, " [default: {}]", default.to_string_lossy());
    }
    meaning
}

fn text(help: Option<&StyledStr>) -> String {
    help.map(ToString::to_string).unwrap_or_default()
}

/// A cell of a table.
fn cell(text: impl AsRef<str>) -> String {
    text.as_ref().replace("\n\n", ". ").replace('\n', " ").replace('|', "\\|")
}

/// The lists at the end of a help, each below its title.
fn lists(level: &str, help: Option<&StyledStr>) -> String {
    let help = text(help);
    let lists = help.split("\n\n").filter_map(|list| list.split_once(":\n"));
    lists.fold(String::new(), |page, (title, list)| {
        page + &format!("\n{level} {title}\n\n```text\n{list}\n```\n")
    })
}

#[test]
fn the_page_says_what_the_help_says() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/cli.md");
    let page = page();
    if std::env::var_os("UPDATE").is_some() {
        std::fs::write(&path, &page).expect("a writable file");
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    let line = found.lines().zip(page.lines()).position(|(found, expected)| found != expected);
    assert!(
        found == page,
        "docs/cli.md is not what the options say (line {}): `UPDATE=1 cargo test -p upbp-cli help_page` writes it",
        line.unwrap_or(found.lines().count().min(page.lines().count())) + 1
    );
}

#[test]
fn the_command_line_makes_sense() {
    Cli::command().debug_assert();
}
