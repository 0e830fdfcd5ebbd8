#!/usr/bin/env bash
# Makes everything that vlnhijack needs: a virtual environment, libLLVM >= 16, the package.
# Usage: tools/setup.sh [venv folder]. Safe to run again.
set -euo pipefail
cd "$(dirname "$0")/.."
venv=${1:-.venv}

say() { printf 'setup: %s\n' "$*" >&2; }
die() { say "$*"; exit 1; }

find_python() {
    local candidate
    for candidate in ${PYTHON:-} python3.11 python3.12 python3.13 python3; do
        if "$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
            echo "$candidate"
            return
        fi
    done
    die "needs Python >= 3.11; install it, or name it: PYTHON=/path/to/python make setup"
}

as_root() {
    if [ "$(id -u)" = 0 ]; then "$@"; else sudo -n "$@"; fi
}

require_llvm() {
    "$venv/bin/python" -c 'from vlnhijack.llvm import require_llvm; require_llvm()'
}

install_llvm() {
    command -v apt-get >/dev/null || return 1
    say "installing libLLVM"
    as_root apt-get update -qq || say "apt-get update failed; trying with the lists at hand"
    local version
    for version in 19 20 18 17 16; do
        if as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq "libllvm$version" >&2; then
            return
        fi
    done
    return 1
}

ensure_llvm() {
    local message
    require_llvm 2>/dev/null && return
    install_llvm || say "libLLVM could not be installed (neither root nor password-less sudo?)"
    message=$(require_llvm 2>&1) && return
    die "$(tail -n 1 <<<"$message")"
}

# Without an NVIDIA driver the small CPU build of torch is enough, where its index can be reached.
torch_index() {
    local index=https://download.pytorch.org/whl/cpu
    [ "$(uname -s)" = Linux ] && ! command -v nvidia-smi >/dev/null || return 0
    "$venv/bin/python" - "$index" <<'PROBE' || true
import sys, urllib.request
try:
    urllib.request.urlopen(f"{sys.argv[1]}/torch/", timeout=5).close()
    print(f"--extra-index-url={sys.argv[1]}")
except OSError:
    pass
PROBE
}

if ! "$venv/bin/python" -m pip --version >/dev/null 2>&1; then
    python=$(find_python)
    say "creating $venv with $python"
    "$python" -m venv --clear "$venv" || die "cannot create $venv (Debian: apt-get install python3-venv)"
fi
ensure_llvm
say "installing vlnhijack and what it needs (a few minutes)"
# shellcheck disable=SC2046
"$venv/bin/python" -m pip install -qq $(torch_index) -c constraints.txt -e '.[dev,notebooks]' \
    || die "pip failed; see its message above"
"$venv/bin/python" -m vlnhijack.rendering.probe llvm_ad_rgb \
    || die "Mitsuba does not render here; $venv/bin/vlnhijack doctor says more"
say "done"
