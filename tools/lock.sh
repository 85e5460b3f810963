#!/bin/sh
# Writes the lock files: every package and every file's hash, and no index address.
#
# The packages that the public index offers are locked, whatever index this user's pip is set to: a
# lock must not depend on who wrote it. Resolved on the oldest Python that is supported, so that
# every pin installs on all of them. `make lock UPGRADE=1` takes newer versions.
set -eu
cd "$(dirname "$0")/.."
export PIP_CONFIG_FILE=/dev/null CUSTOM_COMPILE_COMMAND="make lock"
unset PIP_FIND_LINKS PIP_EXTRA_INDEX_URL PIP_INDEX_URL || true
python=${1:-.venv/bin/python}

case $("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])') in
    3.11) ;;
    *) echo "lock: $python is not Python 3.11, the oldest that is supported" >&2; exit 1 ;;
esac

compile() {
    "$python" -m piptools compile --quiet --generate-hashes --allow-unsafe --strip-extras \
        --no-emit-index-url --no-emit-find-links --no-emit-options --no-emit-trusted-host \
        ${UPGRADE:+--upgrade} "$@"
}

compile --extra dashboard --extra notify --extra parquet --extra workbench --output-file requirements/lock.txt pyproject.toml
for part in build dev bench mutation; do
    compile --output-file "requirements/$part.txt" "requirements/$part.in"
done
