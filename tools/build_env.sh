# Sourced by the other tools: what cargo needs to know before it builds nimbus. Changes PATH and SHADERC_LIB_DIR only.
# shellcheck shell=bash

# rustup installs here and leaves PATH to the login shell, which a CI job or a service is not.
if ! command -v cargo > /dev/null && [ -x "${CARGO_HOME:-$HOME/.cargo}/bin/cargo" ]; then
    PATH="${CARGO_HOME:-$HOME/.cargo}/bin:$PATH"
    export PATH
fi

# The libraries that the shaderc crate would link before it thinks of building its own: those that pkg-config knows,
# then those in the folder of the distribution (shaderc-sys, build/build.rs).
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

# Whether a program links against it. Debian 12's libshaderc-dev lacks half of glslang and SPIRV-Tools, so that the
# build would run for minutes and then fail at its last step.
shaderc_links() {
    local library=$1 program
    # Without a compiler nothing is known yet, and nothing will be built either.
    command -v c++ > /dev/null || return 0
    program=$(mktemp) || return 0
    if printf '%s\n' 'extern "C" { void *shaderc_compiler_initialize(); void shaderc_compiler_release(void *);' \
        'void *shaderc_compile_into_spv(void *, const char *, unsigned long, int, const char *, const char *, void *); }' \
        'int main() { void *c = shaderc_compiler_initialize();' \
        'shaderc_compile_into_spv(c, "", 0, 0, "", "", 0); shaderc_compiler_release(c); }' |
        c++ -x c++ - -x none "$library" -lpthread -o "$program" 2> /dev/null; then
        rm -f "$program"
        return 0
    fi
    rm -f "$program"
    return 1
}

# An own choice (SHADERC_LIB_DIR, VULKAN_SDK) stands. Otherwise a library that does not link is hidden from the crate
# by naming an empty folder, which makes it build its own copy.
if [ -z "${SHADERC_LIB_DIR:-}" ] && [ -z "${VULKAN_SDK:-}" ] && broken=$(shaderc_on_system) && ! shaderc_links "$broken"; then
    SHADERC_LIB_DIR="${XDG_CACHE_HOME:-$HOME/.cache}/nimbus/no-shaderc"
    mkdir -p "$SHADERC_LIB_DIR"
    export SHADERC_LIB_DIR
    [ -n "${quiet_env:-}" ] || echo "nimbus: $broken does not link; building shaderc from source instead (SHADERC_LIB_DIR=$SHADERC_LIB_DIR)" >&2
fi
