//! The documents: links lead somewhere; sections, tests and names that they cite exist; the scene and the
//! host of the README work, and so do the files of settings; pages name every field of settings and reports.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use upbp_core::scene::Scene;
use upbp_core::{Renderer, Settings, Start, Stop};
use upbp_scene::ReadyScene;

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

/// The spans between pairs of backticks.
fn code_spans(line: &str) -> impl Iterator<Item = &str> {
    line.split('`').skip(1).step_by(2)
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

/// The second column of the table of invariants names files, folders and functions, in backticks.
#[test]
fn tests_of_the_invariants_exist() {
    let text = fs::read_to_string(root().join("CONTRIBUTING.md")).unwrap();
    let (_, table) = text.split_once("## Invariants").unwrap();
    let sources: Vec<String> = files(".rs").iter().map(|file| fs::read_to_string(file).unwrap()).collect();
    let paths: Vec<PathBuf> = files(".rs");
    let exists = |name: &str| {
        let is_path = paths.iter().any(|path| {
            path.ends_with(name)
                || path.ancestors().any(|folder| folder.ends_with(name.trim_end_matches('/')))
        });
        is_path || sources.iter().any(|source| source.contains(&format!("fn {name}(")))
    };
    let mut missing = Vec::new();
    let mut names = 0;
    for line in table.lines().take_while(|line| !line.starts_with("## ")) {
        let Some(test) = line.strip_prefix('|').and_then(|row| row.split('|').nth(1)) else { continue };
        for name in code_spans(test) {
            names += 1;
            if !exists(name) {
                missing.push(name.to_owned());
            }
        }
    }
    assert!(names > 30, "{names} names");
    assert!(missing.is_empty(), "{missing:#?}");
}

/// Names of types and functions, in backticks: what is written `like_this`, `LikeThis` or with a path.
#[test]
fn names_in_documents_exist() {
    let sources: Vec<String> = files(".rs").iter().map(|file| fs::read_to_string(file).unwrap()).collect();
    let words: BTreeSet<&str> = sources
        .iter()
        .flat_map(|source| source.split(|c: char| !c.is_ascii_alphanumeric() && c != '_'))
        .collect();
    let mut missing = Vec::new();
    let mut names = 0;
    for document in ["docs/design.md", "docs/theory.md", "docs/reliability.md"] {
        let text = fs::read_to_string(root().join(document)).unwrap();
        for span in prose(&text).flat_map(code_spans) {
            let is_name = span.chars().all(|c| c.is_ascii_alphanumeric() || "_:".contains(c))
                && span.chars().any(|c| c.is_ascii_lowercase());
            // Shorter words may be symbols of a formula.
            let is_name = is_name
                && (span.contains("::")
                    || span.len() > 3
                        && !span.contains('_')
                        && span.starts_with(|c: char| c.is_ascii_uppercase())
                    || span.len() > 13 && span.contains('_'));
            if !is_name {
                continue;
            }
            names += 1;
            let is_known = span.split("::").all(|word| words.contains(word));
            if !is_known {
                missing.push(format!("{document}: {span}"));
            }
        }
    }
    assert!(names > 40, "{names} names");
    assert!(missing.is_empty(), "{missing:#?}");
}

/// The files of settings that `docs/settings.md` shows, read as `--settings` reads them.
#[test]
fn the_page_of_settings_names_every_field() {
    let page = fs::read_to_string(root().join("docs/settings.md")).unwrap();
    let fields = |settings: &Settings| serde_json::to_value(settings).unwrap().as_object().unwrap().clone();
    let default = fields(&Settings::default());
    let mut complete = Vec::new();
    for block in page.split("```ron\n").skip(1) {
        let text = block.split_once("```").unwrap().0;
        let settings = Settings::from_ron(text).unwrap_or_else(|error| panic!("{error} of\n{text}"));
        let found = fields(&settings);
        settings.validate().unwrap();
        if default.keys().all(|name| text.contains(&format!("\n    {name}: "))) {
            complete.push(found);
        }
    }
    let [defaults, others]: [_; 2] =
        complete.try_into().expect("a file of defaults, and one of other values");
    assert_eq!(defaults, default);
    for (name, value) in &default {
        assert!(page.contains(&format!("\n| `{name}` | ")), "{name} has no row");
        assert_ne!(&others[name], value, "{name}");
    }
    for technique in default["radii"].as_object().unwrap().keys() {
        assert!(page.contains(&format!("{technique}: R")), "{technique}");
    }
}

#[test]
fn the_page_of_reports_names_every_field() {
    let page = fs::read_to_string(root().join("docs/report.md")).unwrap();
    let scene = "(version: 1, film: (width: 2, height: 2), materials: {\"grey\": Lambert(0.5)},
        camera: Perspective(origin: (0, 0, 3), target: (0, 0, 0), fov_degrees: 40), lights: [Constant(1)],
        shapes: [(geometry: Sphere(centre: (0, 0, 0), radius: 1), material: \"grey\")])";
    let scene = ReadyScene::from_ron_str(scene, root()).unwrap();
    let renderer = scene.renderer(Settings::default().validate().unwrap()).unwrap();
    let report = serde_json::to_value(renderer.report()).unwrap();
    let names = |value: &serde_json::Value| value.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
    let fields = [&report, &report["support"], &report["seconds"], &report["counters"]];
    for name in fields.into_iter().flat_map(names) {
        assert!(
            page.contains(&format!("`{name}`")) || page.contains(&format!("`counters.{name}`")),
            "{name}"
        );
    }
}

/// The first block of code in a language.
fn block<'a>(text: &'a str, language: &str) -> &'a str {
    let (_, rest) = text.split_once(&format!("```{language}\n")).unwrap();
    rest.split_once("```").unwrap().0
}

#[test]
fn the_scene_of_the_readme_renders() {
    let readme = fs::read_to_string(root().join("README.md")).unwrap();
    let text = block(&readme, "ron");
    let small = text.replace("width: 640, height: 480", "width: 16, height: 12");
    assert_ne!(small, text);
    let scene = ReadyScene::from_ron_str(&small, ".").unwrap();
    let mut renderer = scene.renderer(Settings::default().validate().unwrap()).unwrap();
    assert!(renderer.iterate());
}

#[test]
fn the_host_of_the_readme_is_compiled_below() {
    let readme = fs::read_to_string(root().join("README.md")).unwrap();
    let compiled = include_str!("documents.rs");
    for line in block(&readme, "rust,ignore").lines() {
        assert!(compiled.contains(line.trim()), "{line}");
    }
}

/// The lines that the README shows.
#[expect(dead_code, reason = "compiled, not run: a host is needed")]
fn host<S: Scene>(my_scene: &S, my_window: &Window) -> Result<(), Box<dyn std::error::Error>> {
    let stop = Stop { seconds: Some(60.0), ..Stop::default() };
    let settings = Settings::default().validate()?;
    let mut renderer = Renderer::start(my_scene, settings, Start { stop, ..Start::default() })?;
    renderer.render(&stop, |progress| {
        my_window.show(&progress.film.image());
        ControlFlow::Continue(())
    });
    // With what was done of the last iteration.
    my_window.show(&renderer.film().image());
    Ok(())
}

/// Whatever a host shows pictures with.
struct Window {
    size: [u32; 2],
}

impl Window {
    fn show(&self, image: &upbp_core::Image) {
        assert_eq!([image.width, image.height], self.size);
    }
}
