# The other tools source this file before they run cargo. It sets PATH and SHADERC_LIB_DIR only.
# shellcheck shell=bash

# rustup installs cargo in this folder, and only a login shell adds the folder to PATH. CI jobs and
# services do not run in a login shell.
if ! command -v cargo > /dev/null && [ -x "${CARGO_HOME:-$HOME/.cargo}/bin/cargo" ]; then
    PATH="${CARGO_HOME:-$HOME/.cargo}/bin:$PATH"
    export PATH
fi

# Prints the path of the first shaderc library that is installed in these folders. The shaderc crate
# links an installed library if pkg-config or these folders have one; otherwise it builds its own
# (shaderc-sys, build/build.rs).
shaderc_on_system() {
    local folder name
    for folder in "/usr/lib/$(uname -m)-linux-gnu" /usr/lib64 /usr/lib /usr/local/lib; do
        for name in libshaderc.so libshaderc_shared.so libshaderc_combined.a; do
            if [ -e "$folder/$name" ]; then
                printf '%s\n' "$folder/$name"
                return 0
            fi
        done
    done
    return 1
}

# Returns 0 if a program links against the library. Debian 12's libshaderc-dev lacks half of glslang
# and SPIRV-Tools. With it a build of nimbus runs for minutes and fails in its last step.
shaderc_links() {
    local library=$1 program
    # Without a compiler this test is impossible, and so is a build.
    command -v c++ > /dev/null || return 0
    program=$(mktemp) || return 0
    if c++ -x c++ - -x none "$library" -lpthread -o "$program" 2> /dev/null << 'END'; then
extern "C" {
void *shaderc_compiler_initialize();
void shaderc_compiler_release(void *);
void *shaderc_compile_into_spv(void *, const char *, unsigned long, int, const char *,
                               const char *, void *);
}
int main() {
    void *c = shaderc_compiler_initialize();
    shaderc_compile_into_spv(c, "", 0, 0, "", "", 0);
    shaderc_compiler_release(c);
}
END
        rm -f "$program"
        return 0
    fi
    rm -f "$program"
    return 1
}

# If an installed library does not link, SHADERC_LIB_DIR is set to an empty folder, so that the
# shaderc crate builds its own. This does not happen if the user has set SHADERC_LIB_DIR or
# VULKAN_SDK.
if [ -z "${SHADERC_LIB_DIR:-}" ] && [ -z "${VULKAN_SDK:-}" ] &&
    broken=$(shaderc_on_system) && ! shaderc_links "$broken"; then
    SHADERC_LIB_DIR="${XDG_CACHE_HOME:-$HOME/.cache}/nimbus/no-shaderc"
    mkdir -p "$SHADERC_LIB_DIR"
    export SHADERC_LIB_DIR
    [ -n "${quiet_env:-}" ] ||
        echo "nimbus: $broken does not link; cargo builds shaderc from source instead" \
            "(SHADERC_LIB_DIR=$SHADERC_LIB_DIR)" >&2
fi
