#!/usr/bin/env bash
# Sets everything up in .venv, as requirements.lock pins it, and then does what it is asked to:
#   bash setup.sh demo    runs the demo experiment and says where its report lies
#   bash setup.sh test    lints, type-checks and runs the tests, on all cores
#   bash setup.sh test thorough    the same, and more draws and variants: what tests/thorough.txt names
#   bash setup.sh test quick    an answer within a minute: lints, and the tests that take next to nothing
#   bash setup.sh release-check    wheel, sdist, lock, vulnerabilities, licences, bill of materials: see .ci/release-check
#   bash setup.sh benchmark [--quick]    how fast it is beside other programs, and what became slower: python -m benchmarks
#   bash setup.sh mutate geometry --seed 1 --count 60    whether the tests of a room or module notice small errors in it
#   bash setup.sh         sets up, no more
# A second call finds the environment standing and goes straight on.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
say() { printf 'setup: %s\n' "$*" >&2; }
stop() { say "$*"; exit 1; }

as_root() {
    if [ "$(id -u)" = 0 ]; then "$@"; elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then sudo -n "$@"; else return 1; fi
}

debian_install() { # packages that only Debian has; fails quietly where it may not
    command -v apt-get >/dev/null || return 1
    as_root apt-get update -qq >/dev/null 2>&1 || true
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >/dev/null 2>&1
}

find_python() {
    for candidate in "${PYTHON:-}" python3 python3.13 python3.12 python3.11; do
        if [ -n "$candidate" ] && "$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
            printf '%s' "$candidate"
            return
        fi
    done
    return 1
}

install_locked() { # uv, itself pinned by the lock, is ten times as fast as pip; pip serves where uv cannot
    local pip=".venv/bin/python -m pip install -qq --disable-pip-version-check"
    awk '/^[^ #]/ { ours = /^uv==/ } ours' requirements.lock >.venv/uv.lock
    if ! { $pip --require-hashes -r .venv/uv.lock \
        && .venv/bin/uv pip install -q --python .venv/bin/python --compile-bytecode --require-hashes -r requirements.lock; } 2>/dev/null; then
        $pip --require-hashes -r requirements.lock || return 1
    fi
    $pip --no-deps --no-build-isolation -e .
}

set_up() {
    local wanted
    wanted=$(cat requirements.lock pyproject.toml | sha256sum | cut -d' ' -f1)
    [ "$(cat .venv/.set-up 2>/dev/null)" = "$wanted $PWD" ] && return
    local python
    python=$(find_python) || stop "no Python 3.11 or newer found. Install one, or name it: PYTHON=/path/to/python3 bash setup.sh"
    say "making .venv with $("$python" --version); this takes a minute or two"
    rm -rf .venv
    "$python" -m venv .venv >/dev/null 2>&1 || {
        say "Debian keeps venv in a package of its own; installing it"
        rm -rf .venv
        debian_install "python$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')-venv" || debian_install python3-venv \
            || stop "could not install python3-venv. Install it and call again: apt-get install python3-venv"
        "$python" -m venv .venv
    }
    install_locked || stop "the packages in requirements.lock could not be installed; what pip said stands above"
    .venv/bin/python -m compileall -q vidtrack
    printf '%s' "$wanted $PWD" >.venv/.set-up
}

demo() {
    local began=$SECONDS
    .venv/bin/snakemake --cores all
    say "the demo took $((SECONDS - began)) s; its report: $PWD/data/demo/results/report.html"
}

run_tests() { # a file of tests stays on one worker, with what it has set up; two workers more than cores, for many wait
    command -v chromium >/dev/null || debian_install chromium || say "no chromium: the tests of the report in a browser will be skipped"
    local cores # nproc counts OMP_NUM_THREADS where that is set
    cores=$(env -u OMP_NUM_THREADS -u OMP_THREAD_LIMIT nproc)
    export PATH="$PWD/.venv/bin:$PATH" OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
    local pytest="python -m pytest --dist loadfile --no-loadscope-reorder -n $((cores + 2))"
    if [ "${1:-}" = quick ]; then
        shift
        run_quick_tests "$cores" "$@"
        return
    fi
    if [ "${1:-}" = thorough ]; then shift; else pytest+=" -p tests.brief"; fi
    ruff check .
    ruff format --check --quiet .
    local failed=0 checks # on a core of its own for a while: most of the time that the tests begin with is waiting
    checks=$(mktemp)
    { mypy && lint-imports && snakefmt --check Snakefile workflow; } >"$checks" 2>&1 &
    local checking=$!
    [ $# -gt 0 ] || rewrite_asserts "$cores"
    $pytest "$@" || failed=1
    wait "$checking" || failed=1
    cat "$checks"
    rm -f "$checks"
    [ "$failed" = 0 ] || stop "something failed; see above"
    # decisions that hang on the last bit show under another processor's linear algebra, without fused multiplication
    [ "$(uname -m)" != x86_64 ] || OPENBLAS_CORETYPE=Prescott \
        NPY_DISABLE_CPU_FEATURES="X86_V3 X86_V4 AVX512_ICL AVX512_SPR" $pytest -p tests.quick tests/geometry tests/calibration tests/labelling tests/location
}

rewrite_asserts() { # pytest writes the asserts of a file anew and keeps the result: else each worker does so for all files
    local part pids=()
    for ((part = 0; part < $1; part++)); do
        find tests -name 'test_*.py' | sort | awk -v n="$1" -v part="$part" 'NR % n == part' \
            | xargs env -u PYTHONDONTWRITEBYTECODE python -m pytest -p no:xdist -p no:cacheprovider --collect-only -qq >/dev/null 2>&1 &
        pids+=($!)
    done
    wait "${pids[@]}" || true # what cannot be read is reported by the run itself
}

run_quick_tests() { # one process a core, each with files of its own; types are left to the whole
    local cores=$1 part failed=0 pids=()
    shift
    { ruff check . && ruff format --check --quiet . && lint-imports && snakefmt --check Snakefile workflow 2>/dev/null; } &
    pids+=($!)
    for ((part = 1; part <= cores; part++)); do
        python -m pytest -p no:xdist -p no:cacheprovider -p tests.quick --part "$part/$cores" "$@" &
        pids+=($!)
    done
    for pid in "${pids[@]}"; do wait "$pid" || failed=1; done
    [ "$failed" = 0 ] || stop "something failed; see above"
}

mutate() { # cosmic-ray and what it needs lie in a folder of their own
    local wanted
    wanted=$(sha256sum <benchmarks/mutation.lock)
    if [ "$(cat .venv/mutation/.locked 2>/dev/null)" != "$wanted" ]; then
        .venv/bin/uv pip install -q --python .venv/bin/python --target .venv/mutation --require-hashes -r benchmarks/mutation.lock \
            || stop "the packages in benchmarks/mutation.lock could not be installed; what uv said stands above"
        printf '%s' "$wanted" >.venv/mutation/.locked
    fi
    PYTHONPATH="$PWD:.venv/mutation" OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 .venv/bin/python -m benchmarks.mutation "$@"
}

benchmark() { # other programs lie in a folder of their own, after vidtrack's packages on the path
    local wanted
    wanted=$(sha256sum <benchmarks/peers.lock)
    if [ "$(cat .venv/peers/.locked 2>/dev/null)" != "$wanted" ]; then
        .venv/bin/uv pip install -q --python .venv/bin/python --target .venv/peers --no-deps --require-hashes -r benchmarks/peers.lock \
            || stop "the packages in benchmarks/peers.lock could not be installed; what uv said stands above"
        printf '%s' "$wanted" >.venv/peers/.locked
    fi
    PATH="$PWD/.venv/bin:$PATH" .venv/bin/python -m benchmarks --peers .venv/peers "$@"
}

set_up
case "${1:-}" in
    "") say "ready: .venv/bin/snakemake --cores all runs the demo" ;;
    demo) demo ;;
    test) shift; run_tests "$@" ;;
    benchmark) shift; benchmark "$@" ;;
    mutate) shift; mutate "$@" ;;
    release-check) shift; exec bash .ci/release-check "$@" ;;
    *) stop "no such thing as '$1'; it is demo, test, benchmark, mutate or release-check" ;;
esac
