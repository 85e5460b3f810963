#!/bin/sh
# Makes the virtual environment and puts the locked packages into it: setup.sh VENV LOCK...
#
# Needs a Python from 3.11 to 3.14, for which the locks have files, and nothing else. Files that the locks do not name by hash are
# refused; which index pip asks is the user's own setting.
set -eu
cd "$(dirname "$0")/.."
venv=$1
shift

fits() {
    "$1" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info < (3, 15))' 2>/dev/null
}

find_python() {
    for candidate in ${PYTHON:-} python3 python3.14 python3.13 python3.12 python3.11 python; do
        if fits "$candidate"; then
            echo "$candidate"
            return
        fi
    done
    found=$(python3 --version 2>&1) || found="no python3"
    echo "setup: found $found, expected Python 3.11, 3.12, 3.13 or 3.14" >&2
    echo "setup: install one of them, or name it: make PYTHON=/path/to/python3.12 ..." >&2
    exit 1
}

make_venv() {
    python=$(find_python) || exit 1
    # Debian keeps the part of Python that puts pip into an environment in a package of its own.
    if ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
        tools/debian_packages.sh python3-venv || exit 1
    fi
    echo "setup: virtual environment $venv with $("$python" --version)"
    # Here alone, as further locks are added to the environment that this makes.
    echo "setup: usually about a minute in all, more where the network is slow"
    "$python" -m venv --clear "$venv"
}

if ! { [ -x "$venv/bin/python" ] && fits "$venv/bin/python" \
    && "$venv/bin/python" -m pip --version >/dev/null 2>&1; }; then
    make_venv
fi

# Some rivals in the benchmarks are published as source only: they are built with the locked tools
# that are already in the environment, so that nothing unlocked is fetched.
install() {
    PIP_DISABLE_PIP_VERSION_CHECK=1 "$venv/bin/python" -m pip install --progress-bar off \
        --require-hashes --no-deps --no-build-isolation --no-compile -r "$1" 2>"$venv/setup-errors.txt"
}

# Tells of pip's output, which comes on standard input, how far it is: progress PACKAGES.
progress() {
    count=0
    while read -r word rest; do
        case "$word $rest" in
        "Collecting "*" (from -r "* | "Processing "*" (from -r "*) # from an index, from a folder
            count=$((count + 1))
            if [ $((count % 10)) = 0 ]; then echo "setup:   $count of $1 are here"; fi
            ;;
        "Installing collected packages"*) echo "setup:   all $1 are here and are being installed" ;;
        "setup failed") return 1 ;;
        esac
    done
}

purpose() {
    case "${1##*/}" in
    lock.txt) echo "to run rigwatch" ;;
    build.txt) echo "more, to install rigwatch itself" ;;
    dev.txt) echo "to check rigwatch" ;;
    mutation.txt) echo "to check its tests" ;;
    *) echo "to compare rigwatch with" ;;
    esac
}

# Names as pip compares them, NAME==VERSION a line.
normalised() {
    tr 'A-Z_.' 'a-z--'
}

# Locks share packages: only those that the environment lacks are counted. missing LOCK.
missing() {
    for found in "$venv"/lib/python*/site-packages/*.dist-info; do
        found=${found##*/}
        echo "${found%.dist-info}"
    done | sed 's/-/==/' | normalised >"$venv/present.txt"
    grep -o '^[A-Za-z0-9][^ ]*' "$1" | normalised | grep -c -v -x -F -f "$venv/present.txt" || true
}

for lock in "$@"; do
    packages=$(missing "$lock")
    echo "setup: $packages packages $(purpose "$lock") ($lock)"
    { install "$lock" || { cat "$venv/setup-errors.txt" >&2 && echo "setup failed"; }; } \
        | progress "$packages"
done
# The project comes with what it runs with. Further locks leave it alone: it may be running. Python
# compiles of their packages what is imported, less than half.
case " $* " in
*" requirements/lock.txt "*)
    # On all cores, and not the packages' own tests, which are a quarter of all. Some packages hold
    # files for another Python.
    "$venv/bin/python" -m compileall -qq -j 0 -x '/site-packages/.*/tests?/' "$venv/lib" || true
    "$venv/bin/python" -m pip install --quiet --quiet --no-deps --no-build-isolation --editable .
    ;;
esac
