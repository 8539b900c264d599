test "$release/THIRD-PARTY.txt" -nt Cargo.lock || papers
cp LICENSE-* "$release/THIRD-PARTY.txt" bindings/python
python3 -m venv --clear target/python
python=$(ls "$PWD"/target/python/*/python)
"$python" -m pip install --quiet 'maturin>=1.9,<2' ziglang
rm -f "$release"/delta_cal-*
"$python" bindings/python/archive.py "$release"
# The wheel is built from the source archive, in an empty folder, with the versions of the lock file. Cargo builds again what
# is newer than the last build: the archive's files are as old as their commit, so they are unpacked with the time of now.
unpacked=${TMPDIR:-/tmp}/delta-cal-source
rm -rf "$unpacked"
mkdir "$unpacked"
tar -xzmf "$release"/delta_cal-*.tar.gz -C "$unpacked"
case $host in
  # For any Linux of the last ten years.
  *-linux-gnu) portable='--zig --compatibility manylinux2014' ;;
  *) portable= ;;
esac
cd "$unpacked"/delta_cal-*
PATH=$(dirname "$python"):$PATH CARGO_TARGET_DIR=$root/target "$python" -m maturin build --quiet --release --locked $portable --out "$release"
cd "$root"
rm -rf "$unpacked"
"$python" -m pip install --quiet "$(ls "$release"/delta_cal-*.whl)[test]"
"$python" -m zipfile --list "$(ls "$release"/delta_cal-*.whl)" | grep -q 'licenses/THIRD-PARTY.txt'
export DELTA_CAL=$PWD/target/debug/delta-cal MYPYPATH=$PWD/bindings/python/tests
empty
"$python" -m pytest --quiet -p no:cacheprovider "$root/bindings/python/tests"
"$python" -m mypy --strict "$root/bindings/python/examples"
"$python" -m mypy --strict --package delta_cal
"$python" -m mypy.stubtest --concise delta_cal
package=$("$python" -c 'import delta_cal; print(delta_cal.__path__[0])')
"$python" -m pyright --warnings --pythonpath "$python" "$package"
"$python" "$root/bindings/python/examples/laboratory.py"
"$python" "$root/bindings/python/examples/circles.py"
"$python" "$root/bindings/python/examples/cluster.py" 500 2
cp "$release"/delta_cal-*.whl "$root/host/examples/paper-robot/robot.toml" .
"$python" -m pip download --quiet numpy
follow 'The Python package'
