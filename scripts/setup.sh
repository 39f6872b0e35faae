# The set-up that scripts/demo and scripts/test share: Python, .venv, packages of the system.
# Sourced by them, from the repository's root. Everything but system packages stays in .venv.

say() { printf '%s\n' "$*" >&2; }
die() { say "$*"; exit 1; }

# --- packages of the system (Debian, Ubuntu) ---------------------------------------------------

as_root() {
    if [ "$(id -u)" = 0 ]; then "$@" </dev/null; else sudo -n "$@" </dev/null; fi
}

may_apt() {
    command -v apt-get >/dev/null || return 1
    [ "$(id -u)" = 0 ] || { command -v sudo >/dev/null && sudo -n true 2>/dev/null </dev/null; }
}

apt_updated=no

# Install packages without a question; false when it may not or when that fails.
apt_install() {
    may_apt || return 1
    say "Installing with apt-get: $*"
    if [ "$apt_updated" = no ]; then
        as_root apt-get -qq update >/dev/null || say "apt-get update failed; going on without it"
        apt_updated=yes
    fi
    as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq -y -o DPkg::Lock::Timeout=120 \
        install --no-install-recommends "$@" >/dev/null
}

# --- Python ------------------------------------------------------------------------------------

new_enough() { "$1" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; }
can_make_venv() { "$1" -c 'import ensurepip, venv' 2>/dev/null; }

# Print a Python of at least 3.11, preferring one that can make a virtual environment.
find_python() {
    local candidate found=
    for candidate in ${PYTHON:-} python3 python3.13 python3.12 python3.11 python3.14; do
        new_enough "$candidate" || continue
        if can_make_venv "$candidate"; then echo "$candidate"; return; fi
        found=${found:-$candidate}
    done
    echo "$found"
}

make_venv() {
    local python package
    python=$(find_python)
    [ -n "$python" ] || die "freelook needs Python 3.11 or newer, and none was found.
Install it (Debian 12, Ubuntu 24.04: sudo apt-get install python3 python3-venv;
Ubuntu 22.04: sudo apt-get install python3.11 python3.11-venv), or name one: PYTHON=/path/to/python3"
    if ! can_make_venv "$python"; then
        package=$("$python" -c 'import sys; print("python%d.%d-venv" % sys.version_info[:2])')
        apt_install "$package" || die "$python cannot make a virtual environment.
Install what is missing: sudo apt-get install $package"
    fi
    say "Making .venv with $("$python" --version)"
    "$python" -m venv --clear .venv
}

# --- freelook and its libraries ----------------------------------------------------------------

# What was installed from: this folder and this pyproject.toml.
stamp_text() { pwd; cat pyproject.toml; }
installed() { [ -f ".venv/stamp-$1" ] && stamp_text | cmp -s - ".venv/stamp-$1"; }

# Print the names of the libraries as pip comes to them: a sign of life in one line.
show_progress() {
    local line name
    while IFS= read -r line; do
        case $line in
            Collecting*) name=${line#Collecting }; printf ' %s' "${name%%[^A-Za-z0-9_.-]*}" ;;
            "Installing collected"*) printf ' ... unpacking' ;;
        esac
    done
    printf '\n'
} >&2

# install_freelook EXTRA: only when something changed since the last time.
install_freelook() {
    .venv/bin/python -c '' 2>/dev/null || make_venv
    if installed "$1"; then return; fi
    say "Installing freelook's libraries into .venv (some 200 MB, once):"
    if ! .venv/bin/python -m pip install --disable-pip-version-check --root-user-action ignore \
        --no-compile --progress-bar off -e ".[$1]" </dev/null 2>&1 |
        tee .venv/install.log | show_progress
    then
        tail -n 15 .venv/install.log >&2
        die "The installation failed; the lines above say why, .venv/install.log says more."
    fi
    stamp_text >".venv/stamp-$1"
}
