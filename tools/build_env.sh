# The other tools source this file before they run cargo. It only sets PATH.
# shellcheck shell=bash

# rustup installs cargo in this folder, and only a login shell adds the folder to PATH. CI jobs and
# services do not run in a login shell.
if ! command -v cargo > /dev/null && [ -x "${CARGO_HOME:-$HOME/.cargo}/bin/cargo" ]; then
    PATH="${CARGO_HOME:-$HOME/.cargo}/bin:$PATH"
    export PATH
fi
