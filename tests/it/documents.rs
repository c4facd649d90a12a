//! The documents: links lead somewhere, and cited sections of the theory exist.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Folders that hold neither documents nor sources.
const SKIPPED: [&str; 4] = [".git", "target", "corpus", "artifacts"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Files of the repository whose names end with `ending`, links left out.
fn files(ending: &str) -> Vec<PathBuf> {
    fn collect(folder: &Path, ending: &str, found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).unwrap() {
            let entry = entry.unwrap();
            let name = entry.file_name().into_string().unwrap();
            let kind = entry.file_type().unwrap();
            if kind.is_dir() && !SKIPPED.contains(&name.as_str()) {
                collect(&entry.path(), ending, found);
            } else if kind.is_file() && name.ends_with(ending) {
                found.push(entry.path());
            }
        }
    }
    let mut found = Vec::new();
    collect(root(), ending, &mut found);
    found.sort();
    assert!(!found.is_empty());
    found
}

/// Lines of a document outside of code blocks.
fn prose(text: &str) -> impl Iterator<Item = &str> {
    let mut code = false;
    text.lines().filter(move |line| {
        let fence = line.trim_start().starts_with("```");
        code ^= fence;
        !code && !fence
    })
}

/// The anchors of a document: its headings as forges spell them.
fn anchors(text: &str) -> BTreeSet<String> {
    prose(text)
        .filter(|line| line.starts_with('#'))
        .map(|line| {
            let title = line.trim_start_matches('#').trim().to_lowercase();
            title
                .chars()
                .filter(|c| c.is_alphanumeric() || " -_".contains(*c))
                .map(|c| if c == ' ' { '-' } else { c })
                .collect()
        })
        .collect()
}

/// The targets of links and images, `code` left out.
fn targets(line: &str) -> Vec<&str> {
    let mut found = Vec::new();
    for (at, _) in line.match_indices("](") {
        let is_code = line[..at].matches('`').count() % 2 == 1;
        if let (false, Some(end)) = (is_code, line[at..].find(')')) {
            found.push(&line[at + 2..at + end]);
        }
    }
    found
}

#[test]
fn links_lead_to_files_and_headings() {
    let texts: BTreeMap<PathBuf, String> = files(".md")
        .into_iter()
        .map(|file| (file.canonicalize().unwrap(), fs::read_to_string(file).unwrap()))
        .collect();
    let mut broken = Vec::new();
    let mut links = 0;
    for (file, text) in &texts {
        for target in prose(text).flat_map(targets) {
            if target.contains("://") {
                continue;
            }
            links += 1;
            let (path, anchor) = target.split_once('#').unwrap_or((target, ""));
            let place = match path {
                "" => Ok(file.clone()),
                path => file.parent().unwrap().join(path).canonicalize(),
            };
            let leads = place.is_ok_and(|place| {
                anchor.is_empty() || texts.get(&place).is_some_and(|text| anchors(text).contains(anchor))
            });
            if !leads {
                broken.push(format!("{}: {target}", file.display()));
            }
        }
    }
    assert!(links > 50, "{links} links");
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn cited_sections_of_the_theory_exist() {
    let theory = fs::read_to_string(root().join("docs/theory.md")).unwrap();
    let sections: BTreeSet<&str> = prose(&theory)
        .filter(|line| line.starts_with("##"))
        .filter_map(|line| line.trim_start_matches('#').split_whitespace().next())
        .map(|number| number.trim_end_matches('.'))
        .collect();
    let mut missing = Vec::new();
    let mut citations = 0;
    for file in files(".rs") {
        for (index, line) in fs::read_to_string(&file).unwrap().lines().enumerate() {
            let is_comment = line.trim_start().starts_with("//");
            let Some((_, rest)) = line.split_once("section ").filter(|_| is_comment) else { continue };
            let number = rest.split(|c: char| !c.is_ascii_digit() && c != '.').next().unwrap();
            let number = number.trim_end_matches('.');
            if number.is_empty() {
                continue;
            }
            citations += 1;
            if !sections.contains(number) {
                missing.push(format!("{}:{}: section {number}", file.display(), index + 1));
            }
        }
    }
    assert!(citations > 30, "{citations} citations");
    assert!(missing.is_empty(), "{missing:#?}");
}
