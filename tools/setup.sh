#!/usr/bin/env bash
# Sets up a checkout, and does nothing where all is there: system packages through apt-get
# (or the line to run where it may not), then .venv with Scan4D and what its tests need.
set -euo pipefail
cd "$(dirname "$0")/.."

# OpenGL with a software driver, X11 for the window, USB because open3d links to it.
needed=(libegl1 libgl1 libgles2 libgl1-mesa-dri libglx-mesa0 libegl-mesa0 libx11-6 libxext6 libusb-1.0-0)
# A display without a screen, keys and mouse, for the window tests alone; a second driver, and a compiler of shaders.
for_tests=(xvfb xdotool mesa-vulkan-drivers glslang-tools)

# Prints the first interpreter that pyproject.toml's requires-python accepts.
find_python() {
    for python in python3 python3.14 python3.13 python3.12 python3.11; do
        if "$python" -c "import sys; sys.exit(not (3, 11) <= sys.version_info[:2] < (3, 15))" 2>/dev/null; then
            echo "$python"
            return
        fi
    done
    echo "Scan4D needs Python 3.11 to 3.14, and none is on the PATH. On Debian 12 or Ubuntu 22.04:" >&2
    echo "    sudo apt-get install python3.11 python3.11-venv" >&2
    return 1
}

# Prints those of the named packages that are not installed.
missing() {
    local installed
    installed=$(dpkg-query -W -f '${Package} ${db:Status-Status}\n' "$@" 2>/dev/null || true)
    for package; do
        grep -qxF "$package installed" <<<"$installed" || echo "$package"
    done
}

install_packages() {
    if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
        echo "No apt-get here. Scan4D needs what Debian calls ${needed[*]}; its tests ${for_tests[*]}."
        return
    fi
    local lacking as_root=()
    mapfile -t lacking < <(missing "${needed[@]}" "${for_tests[@]}")
    [ ${#lacking[@]} -gt 0 ] || return 0
    if [ "$(id -u)" != 0 ]; then
        as_root=(sudo -n)
        if ! sudo -n true 2>/dev/null; then
            echo "System packages are missing. Please run this, then make again:" >&2
            echo "    sudo apt-get install --no-install-recommends ${lacking[*]}" >&2
            [ -z "$(missing "${needed[@]}")" ] # Scan4D runs without its test tools
            return
        fi
    fi
    echo "Installing system packages: ${lacking[*]}"
    "${as_root[@]}" apt-get update -qq || echo "apt-get update failed; trying the package lists at hand" >&2
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get install -qq -y --no-install-recommends "${lacking[@]}" </dev/null
}

# .venv/ready holds the checkout's path: a .venv copied along with it would still import the old one.
is_ready() { [ .venv/ready -nt pyproject.toml ] && [ "$(<.venv/ready)" = "$PWD" ]; }

if is_ready; then
    install_packages
else
    python=$(find_python)
    # Debian keeps the standard library's ensurepip in a package of its own.
    "$python" -c "import ensurepip" 2>/dev/null ||
        needed+=("$("$python" -c 'import sys; print("python{}.{}-venv".format(*sys.version_info))')")
    install_packages
    echo "Installing Python packages into .venv (once: 250 MB to download, 1 GB on disk)"
    "$python" -m venv .venv
    .venv/bin/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
    echo "$PWD" >.venv/ready
fi
