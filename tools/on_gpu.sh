#!/usr/bin/env bash
# What this machine's GPU does: tests of backends and numerics, experiments and the benchmark, through EGL. Each step has a limit of time, writes a log, and may fail; the others go on.
#
#     tools/on_gpu.sh [--quick] [--environment ARCHIVE] OUT
#     tools/on_gpu.sh --pack DIR [--all] [--python 3.12]
#
# The first form runs the steps, with the packages of an ARCHIVE, else those of .venv, else of python3. Into the
# folder OUT go NAME.log of each step, summary.txt, and data/NAME-DEVICE.json, which docs/data/ takes. Exit
# status: how many steps have failed. --quick: small numbers, to see whether all of it works. SCAN4D_DATA names
# the folder of real scans for the tables. Needs bash, coreutils, tar with xz, and python3; no network.
#
# The second form makes the archive for such machines, DIR/environment.tar.xz, where there is a network: what
# drawing, the tests and the experiments of speed need, less than 60 MB. --all: what the benchmark needs too, several times
# that: without it the benchmark and the tables are left out. --python: the machine's version; else that of python3 here.
set -uo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)

packages=(numpy moderngl PyOpenGL scipy pillow cattrs cmap platformdirs filelock tqdm pytest pytest-xdist hypothesis)
of_benchmark=(open3d-cpu numba scikit-image matplotlib jinja2 DracoPy flip-evaluator)
largest=60 # MB

usage() {
    sed -n '2,/^set /p' "$0" | sed -n 's/^# \{0,1\}//p' >&2
    exit 2
}

pack() { # DIR ALL VERSION
    local dir=$1 version=$3 site size
    local wanted=("${packages[@]}")
    [ "$2" = no ] || wanted+=("${of_benchmark[@]}")
    mkdir -p "$dir" || return 1
    site=$(mktemp -d)
    python3 -m pip install --quiet --disable-pip-version-check --no-compile --target "$site/site" \
        --only-binary=:all: --python-version "$version" "${wanted[@]}" || return 1
    echo "$version" >"$site/site/python-version"
    find "$site/site" -type d \( -name tests -o -name __pycache__ \) -prune -exec rm -rf {} +
    find "$site/site" -name '*.pyi' -delete
    XZ_OPT=-3 tar -C "$site" -cJf "$dir/environment.tar.xz" site || return 1
    rm -rf "$site"
    size=$(($(stat -c %s "$dir/environment.tar.xz") / 1000000))
    echo "$dir/environment.tar.xz: $size MB, for Python $version"
    [ "$2" != no ] || [ "$size" -lt "$largest" ] || { echo "which is more than $largest MB" >&2; return 1; }
}

quick=no all=no archive= pack_into= version= out=
while [ $# -gt 0 ]; do
    case $1 in
    --quick) quick=yes ;;
    --all) all=yes ;;
    --environment | --pack | --python)
        [ $# -gt 1 ] || usage
        case $1 in --environment) archive=$2 ;; --pack) pack_into=$2 ;; *) version=$2 ;; esac
        shift
        ;;
    -*) usage ;;
    *)
        [ -z "$out" ] || usage
        out=$1
        ;;
    esac
    shift
done

if [ -n "$pack_into" ]; then
    [ -z "$out" ] || usage
    pack "$pack_into" "$all" "${version:-$(python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])')}"
    exit
fi
[ -n "$out" ] || usage
mkdir -p "$out/data" || exit 2
out=$(cd "$out" && pwd)

python=python3
export PYTHONPATH="$here:$here/tests/drivers" PYTHONDONTWRITEBYTECODE=1
if [ -n "$archive" ]; then
    mkdir -p "$out/environment" && tar -C "$out/environment" -xf "$archive" || exit 2
    PYTHONPATH=$PYTHONPATH:$out/environment/site
    for_version=$(<"$out/environment/site/python-version")
    found=$(command -v "python$for_version" python3 | head -1)
    if [ -z "$found" ] || ! "$found" -c "import sys; sys.exit('%d.%d' % sys.version_info[:2] != '$for_version')"; then
        echo "$archive is for Python $for_version, which is not here. Pack it with --python" >&2
        exit 2
    fi
    python=$found
elif [ -x "$here/.venv/bin/python" ]; then
    python=$here/.venv/bin/python
fi
cd "$here" || exit 2
unset DISPLAY WAYLAND_DISPLAY # so that EGL is taken

failed=0
: >"$out/summary.txt"
tell() { echo "$*" | tee -a "$out/summary.txt"; }

step() { # NAME SECONDS COMMAND...
    local name=$1 limit=$2 start=$SECONDS code
    shift 2
    echo "$name, at most $limit s"
    echo "$*" >"$out/$name.log"
    timeout -k 10 "$limit" "$@" >>"$out/$name.log" 2>&1
    code=$?
    case $code in
    0) tell "$name: done in $((SECONDS - start)) s" ;;
    124 | 137) tell "$name: STOPPED after $limit s, see $name.log" ;;
    *) tell "$name: FAILED with $code after $((SECONDS - start)) s: $(tail -n 1 "$out/$name.log" | cut -c 1-200)" ;;
    esac
    [ $code = 0 ] || failed=$((failed + 1))
    return $code
}

has() { # LIBRARY...
    "$python" -c 'import sys; from importlib.util import find_spec; sys.exit(not all(map(find_spec, sys.argv[1:])))' "$@"
}

suite() { # NAME SECONDS ARGUMENTS...: the benchmark, or an experiment that stores its rows
    local name=$1 limit=$2
    shift 2
    if ! has open3d numba jinja2 matplotlib scipy skimage; then
        tell "$name: left out: it needs the packages of --pack --all"
        return
    fi
    local program=(tools/experiment.py "$name")
    [ "$name" != benchmark ] || program=(-m viewer bench)
    step "$name" "$limit" "$python" "${program[@]}" "$@" --force -o "$out/$name" || return
    [ ! -f "$out/$name/$name.json" ] || cp "$out/$name/$name.json" "$out/data/$name-$device.json"
}

# A context, or nothing else will work; and what the files are called by.
step device 60 "$python" -c '
from viewer.bench.run import slug
from viewer.gpu.context import headless
gpu = headless()
print(gpu.device, gpu.driver, sep="\n")
print(f"{gpu.max_storage_bytes / 2**20:.0f} MB in a storage block, {gpu.max_points:,} points, timer: {gpu.timers.kind}")
print(slug(gpu))' || exit 1
device=$(tail -n 1 "$out/device.log")
tell "$(tail -n 4 "$out/device.log" | head -n 3 | paste -sd ' ')"

tested=(tests/gpu tests/picture tests/splatting tests/visibility tests/projection tests/backends tests/drawing tests/numerics)
if [ $quick = yes ]; then
    tested=(tests/gpu/test_bins.py tests/splatting/test_fastest.py tests/backends/test_instancing.py)
fi
pytest=("$python" -m pytest -q -rs -p no:cacheprovider -p no:benchmark -p left_out -m "not slow")
! has xdist || pytest+=(-n "$(nproc)" --dist worksteal)
speed() { step "$1" "$2" "$python" tools/experiment.py "$1" --store "$out/data" "${@:3}"; }
if [ $quick = yes ]; then
    step tests 900 "${pytest[@]}" "${tested[@]}"
    speed points 120 --counts 10000 --size 320x240 --rounds 1
    speed range_samples 300 --size 300x200
    speed splats 300 --counts 20000 --size 640x480 --rounds 3
    speed bandwidth 120 --counts 10000 100000 --size 320x240 --rounds 1 --megabytes 16
    suite benchmark 300 --quick --scene torus --backend points --views 1 --size 96x64
    suite feeds 600 --quick --views 1 --size 96x64
    suite octrees 600 --quick --views 1 --size 96x64
else
    step tests 3600 "${pytest[@]}" "${tested[@]}"
    speed points 600 --rounds 11
    speed range_samples 600
    speed splats 900
    speed bandwidth 600
    suite benchmark 900 --quick
    suite feeds 3600
    suite octrees 3600
fi
[ -z "$archive" ] || rm -rf "$out/environment"
tell "$failed steps have failed; measurements are in $out/data"
exit $failed
