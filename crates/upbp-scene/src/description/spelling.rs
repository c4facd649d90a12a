//! Hints in messages about wrong text: the right spelling of the kind that was meant.

use ron::error::{Error, SpannedError};

/// Every kind, by the field that holds it, as the crate's README shows it.
const KINDS: [(&str, &[&str]); 6] = [
    ("camera", &["Perspective(origin: (0, 1, 4), target: (0, 1, 0), fov_degrees: 40)"]),
    ("media", &["Homogeneous(sigma_a: 0.02, sigma_s: (8, 7, 6))"]),
    (
        "phase",
        &[
            "Isotropic",
            "Rayleigh",
            "HenyeyGreenstein(0.6)",
            "TwoLobes(g: (0.9, -0.3), share: 0.8)",
            "Draine(g: 0.6, alpha: 20)",
            "Droplets(10)",
            "Table([(0, 20), (30, 1), (180, 2)])",
            "TableFile(file: \"fog.txt\")",
            "Blend([(3, Rayleigh), (1, HenyeyGreenstein(0.9))])",
            "PerChannel(r: Rayleigh, g: Rayleigh, b: Isotropic)",
        ],
    ),
    (
        "materials",
        &[
            "Lambert(0.7)",
            "Phong(diffuse: 0.4, specular: 0.3, exponent: 50)",
            "Mirror(0.9)",
            "Conductor(alpha: 0.1, eta: (0.2, 0.4, 1.4), k: (3.9, 2.5, 1.9))",
            "Metal(alpha: 0.1, reflectance: (1, 0.8, 0.4))",
            "Dielectric(1.5)",
            "RoughDielectric(alpha: 0.1, ior: 1.5)",
            "Null",
        ],
    ),
    (
        "geometry",
        &[
            "Sphere(centre: (0, 1, 0), radius: 0.5)",
            "Box(min: (-1, 0, -1), max: (1, 2, 1))",
            "Quad(origin: (-1, 0, -1), edge_u: (0, 0, 2), edge_v: (2, 0, 0))",
            "Mesh(file: \"bunny.obj\", scale: 0.5)",
        ],
    ),
    (
        "lights",
        &[
            "Point(position: (0, 3, 0), intensity: 5)",
            "Spot(position: (0, 3, 0), target: (0, 0, 0), intensity: 5, cutoff_degrees: 20)",
            "Directional(direction: (0, -1, 0), irradiance: 1)",
            "Sun(direction: (-1, -3, 1), irradiance: 3)",
            "Constant(1)",
            "Image(file: \"sky.exr\")",
        ],
    ),
];

/// The first word of an example.
fn name(example: &str) -> &str {
    example.split('(').next().unwrap_or(example)
}

fn example(of: &str) -> Option<&'static str> {
    KINDS.iter().flat_map(|(_, examples)| *examples).copied().find(|example| name(example) == of)
}

/// The message about an error of the parser, with the right spelling.
pub(super) fn message(text: &str, error: &SpannedError) -> String {
    let start = error.span.start;
    let line: usize = text.split_inclusive('\n').take(start.line.saturating_sub(1)).map(str::len).sum();
    let column: usize = text[line..].chars().take(start.col.saturating_sub(1)).map(char::len_utf8).sum();
    let end = line + column;
    let (what, name_expected) = match &error.code {
        // The name that the parser's language has for a number.
        Error::InvalidValueForType { expected, found } if expected == "f32" => {
            return format!("Expected a number but found {found} instead");
        }
        Error::MissingStructField { field, outer } => {
            let of = outer.as_ref().map_or_else(String::new, |outer| format!(" of `{outer}`"));
            return format!("Missing field `{field}`{of}");
        }
        // These say what was expected.
        Error::Message(_)
        | Error::InvalidValueForType { .. }
        | Error::ExpectedDifferentLength { .. }
        | Error::NoSuchEnumVariant { .. }
        | Error::NoSuchStructField { .. }
        | Error::DuplicateStructField { .. } => return error.code.to_string(),
        Error::InvalidIdentifier(_) | Error::SuggestRawIdentifier(_) | Error::ExpectedIdentifier => {
            ("Expected a name".to_owned(), true)
        }
        Error::ExpectedString => ("Expected text in quotes".to_owned(), false),
        Error::ExpectedFloat => ("Expected a number".to_owned(), false),
        Error::ExpectedInteger => ("Expected a whole number".to_owned(), false),
        Error::IntegerOutOfBounds => return "The whole number is too large or negative".to_owned(),
        // The parser takes the digits before the point for the number.
        Error::ExpectedComma if text[end..].starts_with('.') => return "Expected a whole number".to_owned(),
        code => (code.to_string(), false),
    };
    what + &hint(text, end, name_expected)
}

fn hint(text: &str, end: usize, name_expected: bool) -> String {
    let (open, last) = open(&text[..end]);
    // A kind without its parentheses, or with parentheses that it does not have.
    if let Some(example) = example(last)
        && (example != last || text[end..].starts_with('('))
    {
        return format!(", as in `{example}`");
    }
    // The value of a field that holds a kind, or an item of a field that holds several.
    let holder = match open.as_slice() {
        [.., inner] if !inner.field.is_empty() => inner.field,
        [.., outer, inner] if inner.name.is_empty() => outer.field,
        _ => "",
    };
    if let Some((_, examples)) = KINDS.iter().find(|(field, _)| name_expected && *field == holder) {
        let names: Vec<_> = examples.iter().map(|example| format!("`{}`", name(example))).collect();
        return format!(", one of {}", names.join(", "));
    }
    let innermost = open.iter().rev().find_map(|open| example(open.name));
    innermost.map_or_else(String::new, |example| format!(", as in `{example}`"))
}

/// A bracket that is open at a place of a text.
struct Open<'t> {
    /// The word before it.
    name: &'t str,
    /// The field whose value is at hand.
    field: &'t str,
}

/// The brackets that are open at the end of a text, and its last word. Nothing for a text that nests deeper
/// than the parser follows: it was not understood.
fn open(text: &str) -> (Vec<Open<'_>>, &str) {
    const DEPTHS: usize = 256;
    let (mut open, mut word): (Vec<Open<'_>>, _) = (Vec::new(), "");
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let is_word = |c: char| c.is_alphanumeric() || c == '_';
        let length = match first {
            '"' => {
                let mut escaped = true;
                rest.find(|c| {
                    let ends = c == '"' && !escaped;
                    escaped = c == '\\' && !escaped;
                    ends
                })
                .map_or(rest.len(), |last| last + 1)
            }
            '/' if rest.starts_with("//") => rest.find('\n').unwrap_or(rest.len()),
            '/' if rest.starts_with("/*") => rest.find("*/").map_or(rest.len(), |last| last + 2),
            _ if is_word(first) => rest.find(|c| !is_word(c)).unwrap_or(rest.len()),
            _ => first.len_utf8(),
        };
        let (token, after) = rest.split_at(length);
        rest = after;
        match first {
            '(' | '[' | '{' if open.len() == DEPTHS => return (Vec::new(), ""),
            '(' | '[' | '{' => open.push(Open { name: std::mem::take(&mut word), field: "" }),
            ')' | ']' | '}' => {
                open.pop();
                word = "";
            }
            ':' | ',' => {
                let field = if first == ':' { word } else { "" };
                open.iter_mut().last().into_iter().for_each(|open| open.field = field);
                word = "";
            }
            _ if is_word(first) => word = token,
            _ if first.is_whitespace() || first == '/' => {}
            _ => word = "",
        }
    }
    (open, word)
}

#[cfg(test)]
mod tests {
    use super::{KINDS, name};
    use crate::SceneDescription;

    const README: &str = include_str!("../../README.md");

    /// A scene with this in its place.
    fn scene(field: &str, kind: &str) -> String {
        let camera = KINDS[0].1[0];
        let rest = match field {
            "camera" => return format!("(version: 1, camera: {kind})"),
            "phase" => format!("media: {{ \"a\": Homogeneous(phase: {kind}) }}"),
            "geometry" => format!("shapes: [(geometry: {kind}, material: \"a\")]"),
            "lights" => format!("lights: [{kind}]"),
            _ => format!("{field}: {{ \"a\": {kind} }}"),
        };
        format!("(version: 1, camera: {camera}, {rest})")
    }

    fn read(field: &str, kind: &str) -> Result<SceneDescription, String> {
        let text = scene(field, kind);
        let start = text.find(kind).unwrap();
        SceneDescription::from_ron(&text).map_err(|error| {
            let error = error.to_string();
            let mut parts = error.splitn(3, ':').skip(1);
            let column: usize = parts.next().unwrap().parse().unwrap();
            format!("{}:{}", column - start, parts.next().unwrap())
        })
    }

    #[test]
    fn every_example_of_the_readme_is_read() {
        let spans = README.split('`').skip(1).step_by(2);
        let mut seen = Vec::new();
        for span in spans {
            let kinds = KINDS.iter().flat_map(|(field, kinds)| kinds.iter().map(move |kind| (field, kind)));
            for (field, kind) in kinds.filter(|(_, kind)| name(kind) == name(span)) {
                let is_name_alone = span == name(kind);
                assert!(is_name_alone || read(field, span).is_ok(), "{span}: {:?}", read(field, span));
                seen.push(span);
            }
        }
        for kind in KINDS.iter().flat_map(|(_, kinds)| *kinds) {
            assert!(seen.contains(kind), "the README does not show `{kind}`");
        }
    }

    #[test]
    fn a_single_value_may_have_its_name() {
        for (field, plain, named) in [
            ("phase", "HenyeyGreenstein(0.6)", "HenyeyGreenstein(g: 0.6)"),
            ("phase", "HenyeyGreenstein((0.6, 0.5, -0.1))", "HenyeyGreenstein(g: (0.6, 0.5, -0.1))"),
            ("phase", "Droplets(8)", "Droplets(diameter: 8)"),
            ("phase", "Table([(0, 1), (180, (2, 1, 0.5))])", "Table(rows: [(0, 1), (180, (2, 1, 0.5))])"),
            ("phase", "Blend([(3, Rayleigh)])", "Blend(parts: [(3, Rayleigh)])"),
            ("materials", "Lambert(0.5)", "Lambert(reflectance: 0.5)"),
            ("materials", "Lambert((0.7, 0.2, 0.1))", "Lambert(reflectance: (0.7, 0.2, 0.1))"),
            ("materials", "Lambert((0.7, 0.2, 0.1))", "Lambert(0.7, 0.2, 0.1)"),
            ("materials", "Mirror(1)", "Mirror(reflectance: 1,)"),
            ("materials", "Dielectric(1.5)", "Dielectric(ior: 1.5)"),
            ("lights", "Constant(1)", "Constant(radiance: 1)"),
        ] {
            let read = |kind| read(field, kind).unwrap_or_else(|error| panic!("{kind}: {error}"));
            assert_eq!(read(plain), read(named));
            assert_eq!(SceneDescription::from_ron(&read(named).to_ron().unwrap()).unwrap(), read(plain));
        }
        assert!(read("geometry", "Mesh(file: \"a.obj\", translate: Some((0, 1, 2)))").is_ok());
    }

    #[test]
    fn other_spellings_are_refused_with_the_right_one() {
        for (field, kind, expected) in [
            (
                "phase",
                "0.5",
                "1: Expected a name, one of `Isotropic`, `Rayleigh`, `HenyeyGreenstein`, `TwoLobes`, `Draine`, `Droplets`, `Table`, `TableFile`, `Blend`, `PerChannel`",
            ),
            (
                "phase",
                r#""Rayleigh""#,
                "1: Expected a name, one of `Isotropic`, `Rayleigh`, `HenyeyGreenstein`, `TwoLobes`, `Draine`, `Droplets`, `Table`, `TableFile`, `Blend`, `PerChannel`",
            ),
            ("phase", "Isotropic()", "10: Expected comma, as in `Isotropic`"),
            ("phase", "HenyeyGreenstein", "17: Expected opening `(`, as in `HenyeyGreenstein(0.6)`"),
            (
                "phase",
                "HenyeyGreenstein(1, 2)",
                "22: Expected a colour: a number, or three in parentheses (r, g, b) but found 2 elements instead",
            ),
            ("phase", "Draine(0.6, 20)", "8: Expected a name, as in `Draine(g: 0.6, alpha: 20)`"),
            ("phase", "Droplets(60)", "10: expected a diameter above 0 and up to 50 micrometres, found 60"),
            (
                "phase",
                "Table([(0, 1), (90, 1)])",
                "23: angle 1 is 90, expected 180 degrees, where tables end",
            ),
            (
                "phase",
                "Table((0, 1))",
                "8: Expected opening `(`, as in `Table([(0, 20), (30, 1), (180, 2)])`",
            ),
            ("phase", "TableFile(\"a.txt\")", "11: Expected a name, as in `TableFile(file: \"fog.txt\")`"),
            (
                "phase",
                "Blend(Rayleigh)",
                "15: Expected a value, or `parts: value` but found a unit value instead",
            ),
            (
                "phase",
                "Blend((3, Rayleigh))",
                "8: Expected opening `(`, as in `Blend([(3, Rayleigh), (1, HenyeyGreenstein(0.9))])`",
            ),
            (
                "camera",
                "Perspective((0, 1, 4), (0, 1, 0), 40)",
                "13: Expected a name, as in `Perspective(origin: (0, 1, 4), target: (0, 1, 0), fov_degrees: 40)`",
            ),
            (
                "camera",
                "Perspective",
                "12: Expected opening `(`, as in `Perspective(origin: (0, 1, 4), target: (0, 1, 0), fov_degrees: 40)`",
            ),
            ("camera", "(origin: (0, 1, 4))", "1: Expected a name, one of `Perspective`"),
            (
                "media",
                "Homogeneous(0.1, 1)",
                "13: Expected a name, as in `Homogeneous(sigma_a: 0.02, sigma_s: (8, 7, 6))`",
            ),
            (
                "media",
                "Homogeneous",
                "12: Expected opening `(`, as in `Homogeneous(sigma_a: 0.02, sigma_s: (8, 7, 6))`",
            ),
            ("media", "(sigma_s: 1)", "1: Expected a name, one of `Homogeneous`"),
            (
                "materials",
                "(ior: 1.5)",
                "1: Expected a name, one of `Lambert`, `Phong`, `Mirror`, `Conductor`, `Metal`, `Dielectric`, `RoughDielectric`, `Null`",
            ),
            ("materials", "Lambert", "8: Expected opening `(`, as in `Lambert(0.7)`"),
            (
                "materials",
                "Lambert()",
                "9: Expected a value, or `reflectance: value` but found a unit value instead",
            ),
            (
                "materials",
                "Lambert(albedo: 0.5)",
                "9: Unexpected field named `albedo` in `Lambert`, expected `reflectance` instead",
            ),
            (
                "materials",
                "Lambert(0.5, 0.5)",
                "17: Expected a colour: a number, or three in parentheses (r, g, b) but found 2 elements instead",
            ),
            (
                "materials",
                "Phong(0.5, 0.2, 10)",
                "7: Expected a name, as in `Phong(diffuse: 0.4, specular: 0.3, exponent: 50)`",
            ),
            ("materials", "Mirror", "7: Expected opening `(`, as in `Mirror(0.9)`"),
            (
                "materials",
                "Conductor(0.1, 1, 1)",
                "11: Expected a name, as in `Conductor(alpha: 0.1, eta: (0.2, 0.4, 1.4), k: (3.9, 2.5, 1.9))`",
            ),
            (
                "materials",
                "Metal(0.1, 0.9)",
                "7: Expected a name, as in `Metal(alpha: 0.1, reflectance: (1, 0.8, 0.4))`",
            ),
            (
                "materials",
                "Metal(alpha: 0.1 reflectance: 0.9)",
                "18: Expected comma, as in `Metal(alpha: 0.1, reflectance: (1, 0.8, 0.4))`",
            ),
            ("materials", "Dielectric", "11: Expected opening `(`, as in `Dielectric(1.5)`"),
            (
                "materials",
                "Dielectric()",
                "12: Expected a value, or `ior: value` but found a unit value instead",
            ),
            (
                "materials",
                "Dielectric(eta: 1.5)",
                "12: Unexpected field named `eta` in `Dielectric`, expected `ior` instead",
            ),
            (
                "materials",
                "Dielectric(ior = 1.5)",
                "15: Expected a value, or `ior: value` but found a unit value instead",
            ),
            (
                "materials",
                r#"Dielectric("glass")"#,
                r#"13: Expected a number but found the string "glass" instead"#,
            ),
            ("materials", "Dielectric(1.5, 1)", "16: Expected a number but found a sequence instead"),
            (
                "materials",
                "Dielectric(ior: 1.5, ior: 1.5)",
                "30: Unexpected duplicate field named `ior` in `Dielectric`",
            ),
            ("materials", "Dielectric { ior: 1.5 }", "11: Expected opening `(`, as in `Dielectric(1.5)`"),
            (
                "materials",
                "RoughDielectric(0.1, 1.5)",
                "17: Expected a name, as in `RoughDielectric(alpha: 0.1, ior: 1.5)`",
            ),
            ("materials", "Null()", "5: Expected comma, as in `Null`"),
            (
                "geometry",
                "Sphere((0, 1, 0), 0.5)",
                "8: Expected a name, as in `Sphere(centre: (0, 1, 0), radius: 0.5)`",
            ),
            (
                "geometry",
                "Sphere(centre: 0, radius: 1)",
                "16: Expected three numbers in parentheses (x, y, z) but found the unsigned integer `0` instead",
            ),
            (
                "geometry",
                "Sphere /* ( */ (centre: (0, 1), radius: 1)",
                "30: Expected three numbers in parentheses (x, y, z) but found 2 elements instead",
            ),
            (
                "geometry",
                "Box((0, 0, 0), (1, 1, 1))",
                "5: Expected a name, as in `Box(min: (-1, 0, -1), max: (1, 2, 1))`",
            ),
            (
                "geometry",
                "Quad((0, 0, 0), (1, 0, 0), (0, 1, 0))",
                "6: Expected a name, as in `Quad(origin: (-1, 0, -1), edge_u: (0, 0, 2), edge_v: (2, 0, 0))`",
            ),
            (
                "geometry",
                r#"Mesh("a\"(.obj")"#,
                r#"6: Expected a name, as in `Mesh(file: "bunny.obj", scale: 0.5)`"#,
            ),
            (
                "geometry",
                "Mesh(file: a.obj)",
                r#"11: Expected text in quotes, as in `Mesh(file: "bunny.obj", scale: 0.5)`"#,
            ),
            (
                "geometry",
                r#"Mesh(file: "a.obj", scale: 1e30)"#,
                "28: expected a number above 0, from 1.2e-38 to 1e12, found 1e30",
            ),
            (
                "geometry",
                "(centre: (0, 1, 0), radius: 1)",
                "1: Expected a name, one of `Sphere`, `Box`, `Quad`, `Mesh`",
            ),
            (
                "lights",
                "Point((0, 3, 0), 5)",
                "7: Expected a name, as in `Point(position: (0, 3, 0), intensity: 5)`",
            ),
            (
                "lights",
                "Spot((0, 3, 0), 5)",
                "6: Expected a name, as in `Spot(position: (0, 3, 0), target: (0, 0, 0), intensity: 5, cutoff_degrees: 20)`",
            ),
            (
                "lights",
                "Directional((0, -1, 0), 1)",
                "13: Expected a name, as in `Directional(direction: (0, -1, 0), irradiance: 1)`",
            ),
            ("lights", "Constant", "9: Expected opening `(`, as in `Constant(1)`"),
            ("lights", r#"Image("sky.exr")"#, r#"7: Expected a name, as in `Image(file: "sky.exr")`"#),
            (
                "lights",
                "5",
                "1: Expected a name, one of `Point`, `Spot`, `Directional`, `Sun`, `Constant`, `Image`",
            ),
        ] {
            assert_eq!(read(field, kind).unwrap_err(), expected, "{kind}");
        }
    }
}
