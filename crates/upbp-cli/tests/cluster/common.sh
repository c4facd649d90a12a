# What the scripts share. To be sourced.

set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../../../.." && pwd)
(cd "$root" && cargo build --quiet --locked --release --package upbp-cli)
PATH=$(cd "$root" && realpath -m "${CARGO_TARGET_DIR:-target}")/release:$PATH
export SCENE=$root/examples/scenes/cornell_media.ron
work=$(mktemp -d)

# Fingerprint of the film in a state file.
film() {
    upbp merge "$1" | sed -n '1s/.*film //p'
}

# Ends with success if two state files hold the same film.
compare() {
    local one two
    one=$(film "$1")
    two=$(film "$2")
    echo "one run:  $one"
    echo "in parts: $two"
    [ -n "$one" ] && [ "$one" = "$two" ] && echo "the same to the bit"
}
