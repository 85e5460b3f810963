#!/bin/sh
# Installs Debian packages where that is allowed, else prints the one command that does.
#
#   debian_packages.sh PACKAGE...     fails where they are missing and cannot be installed
#   debian_packages.sh --wish PACKAGE...     remarks on it and goes on
set -eu

wish=false
if [ "$1" = --wish ]; then
    wish=true
    shift
fi

missing=
for package in "$@"; do
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' \
        || missing="$missing $package"
done
[ -n "$missing" ] || exit 0

give_up() {
    echo "setup: $1; this installs what is missing:" >&2
    echo "    sudo apt-get install --yes --no-install-recommends$missing" >&2
    $wish && exit 0
    exit 1
}

command -v apt-get >/dev/null 2>&1 || give_up "no apt-get here for$missing"
if [ "$(id -u)" = 0 ]; then
    as_root=
elif sudo -n true 2>/dev/null; then
    as_root="sudo -n"
else
    give_up "not allowed to install$missing"
fi

# Two that run beside each other would find the packages locked.
exec 9<"$0"
flock 9
echo "setup: installing Debian packages$missing"
install() {
    $as_root env DEBIAN_FRONTEND=noninteractive \
        apt-get install --yes --quiet --no-install-recommends $missing >/dev/null
}
install 2>/dev/null || { $as_root apt-get update --quiet >/dev/null && install; } \
    || give_up "apt-get could not install$missing"
