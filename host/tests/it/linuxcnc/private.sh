#!/bin/sh
# Runs LinuxCNC with the component installed where only this process and its children see it: to be started in
# namespaces of its own (unshare), as root of these.
#
#   private.sh COMPONENT_FOLDER BUILD_FOLDER RUN_FOLDER
set -eu
component=$1
build=$2
run=$3
modules=$(sed -n 's/^RTLIBDIR := //p' "$(halcompile --print-modinc)" | tail -n 1)
cp -r "$modules" "$run/modules"
mount --bind "$run/modules" "$modules"
make --silent --directory "$component" BUILD="$build" install
cd "$run"
HOME=$run
export HOME
# LinuxCNC refuses to run as root.
exec unshare --user --map-user=1000 --map-group=1000 timeout --kill-after=10 150 linuxcnc -r delta.ini
