# Short names for what CONTRIBUTING.md describes. `just` lists them.

_default:
    @just --list --unsorted

# Everything that must pass, or the steps named: `just check fmt clippy`
check *STEPS:
    .ci/run {{STEPS}}

# Formats the code
fmt:
    cargo fmt --all

# Runs the tests whose names contain NAME
test NAME="":
    cargo test --locked --workspace -- {{NAME}}

# Compiles with the oldest Rust that is supported
minimum:
    cargo +1.88 check --locked --workspace --all-targets

# The documentation of all crates, in a browser
doc:
    cargo doc --workspace --no-deps --open

# Licences, duplicate and banned crates, sources, known vulnerabilities
deny:
    cargo deny check

# What a version number has to say about the changes since BASE
semver BASE:
    cargo semver-checks --workspace --exclude upbp --exclude upbp-testing --baseline-rev {{BASE}}

# Renders the shipped scene: cornell_media.exr and cornell_media.png
render:
    cargo run --release --example cornell_media

# Rays, photon queries, iterations and weights
bench FILTER="":
    cargo bench --bench rays -- {{FILTER}}
    cargo bench --bench lookups -- {{FILTER}}
    cargo bench --bench iteration -- {{FILTER}}

# Error over time on the suite, and a verdict on the choice of techniques
errors *OPTIONS:
    cargo run --release --example time_to_error -- {{OPTIONS}}

# Agreement with the images of an independent renderer
validate *OPTIONS:
    cargo run --release --example validate -- {{OPTIONS}}

# Extreme scenes, thousands of them
stress *OPTIONS:
    cargo run --release --example stress -- {{OPTIONS}}

# Fuzzes the reader of TARGET (scene, settings, mesh, image, state) for SECONDS; needs nightly and cargo-fuzz
fuzz TARGET SECONDS="600":
    fuzz/run {{TARGET}} {{SECONDS}}
