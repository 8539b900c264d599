//! What a release consists of, in target/release-VERSION. Each part is tried in an empty folder, as its users have it.

use crate::Stage;

/// All parts. Some are the same everywhere, and built on one of the systems only.
pub(crate) const PARTS: [Stage; 8] = [PAPERS, COMMAND, PYTHON, LIBRARY, CRATES, WEB, BOARD, SUMS];

/// The parts that are built on this machine.
pub(crate) fn parts() -> impl Iterator<Item = &'static Stage> {
    PARTS.iter().filter(|part| match part.name {
        "c-library" => cfg!(target_os = "linux"),
        "crates" | "web" | "board" => cfg!(all(target_os = "linux", target_arch = "x86_64")),
        _ => true,
    })
}

/// What every script begins with: it stops at the first failure, and knows where it is.
pub(crate) const PRELUDE: &str = concat!(
    "set -eu; root=$PWD; release=$PWD/target/release-",
    env!("CARGO_PKG_VERSION"),
    r#"
mkdir -p "$release" target/archive
host=$(rustc -vV | sed -n 's/^host: //p')
# The command is static on Linux.
target=$(echo "$host" | sed 's/-linux-gnu$/-linux-musl/')
empty() {
  folder=$(mktemp -d)
  trap 'rm -rf "$folder"' EXIT
  cd "$folder"
}
# Packs a folder of target/archive, and enters an empty folder that has the archive alone.
archive() {
  cp LICENSE-* "$release/THIRD-PARTY.txt" "target/archive/$1"
  tar -czf "$release/$1.tar.gz" -C target/archive "$1"
  empty
  cp "$release/$1.tar.gz" .
}
# Runs the commands below the words that a paragraph of docs/install.md begins with, without those that need the internet.
follow() {
  sh -ec "$(awk -v at="**$1" 'index($0, at) == 1 {on = 1} on == 2 && /^```/ {exit} on == 2 && !/# internet/ {print}
    on == 1 && /^```sh/ {on = 2}' "$root/docs/install.md" | sed "s/x86_64-unknown-linux-musl/$target/; s/x86_64-unknown-linux-gnu/$host/")"
}
# Licences and bill of materials.
papers() {
  cargo fetch --quiet --locked
  cargo fetch --quiet --locked --manifest-path firmware-example/boards/pico2/Cargo.toml
  cargo verify write-papers "$target" "$release"
}
"#
);

const PAPERS: Stage = Stage {
    name: "papers",
    about: "licences and bill of materials of what a release contains",
    commands: &[r#"
rm -rf "$release" target/archive
mkdir -p "$release" target/archive
papers
cp CHANGELOG.md "$release"
"#],
};

const CRATES: Stage = Stage {
    name: "crates",
    about: "the crates for crates.io, each built from its package",
    commands: &[r#"
rm -rf target/package
cargo package --quiet --locked --package delta-cal --package delta-cal-protocol --package delta-cal-controller \
  --package delta-cal-c --package delta-cal-host
cp target/package/*.crate "$release"
empty
ln -s "$root" delta-cal
cargo new --quiet --lib firmware
cd firmware
follow 'A Rust firmware'
"#],
};

const COMMAND: Stage = Stage {
    name: "command",
    about: "the command for this machine, with completions and manual pages",
    commands: &[r#"
rustup target add "$target"
cargo install --quiet --locked --path host --features man --target "$target" --config profile.release.strip=true \
  --root target/installed
name=delta-cal-$target
folder=target/archive/$name
rm -rf "$folder"
mkdir -p "$folder/completions" "$folder/man/man1"
cp README.md CHANGELOG.md target/installed/bin/* "$folder"
cp -r host/examples "$folder"
for shell in bash elvish fish powershell zsh; do
  "$folder/delta-cal" completions "$shell" > "$folder/completions/delta-cal.$shell"
done
"$folder/delta-cal" man "$folder/man/man1"
archive "$name"
export HOME=$PWD
follow 'The command'
delta_cal=$HOME/.local/bin/delta-cal
case $target in *-musl) ldd "$delta_cal" 2>&1 | grep -q -e 'statically linked' -e 'not a dynamic' ;; esac
mkdir mine
cd mine
"$delta_cal" init
"$delta_cal" plan robot.toml --count 12 --output poses.csv
"$delta_cal" calibrate --output calibrated.toml --report report.html
"$delta_cal" export calibrated.toml --for linuxcnc
test -s poses.csv && test -s report.html
grep -q calibrate "$HOME"/.local/share/man/man1/delta-cal.1
test -s "$HOME"/.local/share/man/man1/delta-cal-calibrate.1
grep -q calibrate "$HOME"/.local/share/bash-completion/completions/delta-cal
"#],
};

const LIBRARY: Stage = Stage {
    name: "c-library",
    about: "the C library for this machine, found by CMake and pkg-config",
    commands: &[r#"
cmake -S bindings/c -B target/c-library -DCMAKE_INSTALL_LIBDIR=lib "-DDELTA_CAL_BUILD=$root/target/firmware"
cmake --build target/c-library
name=delta-cal-c-$host
rm -rf "target/archive/$name"
cmake --install target/c-library --prefix "target/archive/$name"
archive "$name"
block() { awk "/^\`\`\`$1\$/{on=1;next} /^\`\`\`/{if(on)exit} on" "$root/docs/c.md"; }
block c > main.c
block text > expected
follow 'The library for C'
LD_LIBRARY_PATH=$name/lib ./controller | diff expected -
block cmake | sed 's/^include.*/find_package(delta-cal 0.1 REQUIRED)/' > CMakeLists.txt
cmake -S . -B build "-DCMAKE_PREFIX_PATH=$PWD/$name"
cmake --build build
build/controller | diff expected -
"#],
};

pub(crate) const WEB: Stage = Stage {
    name: "web",
    about: "the page: clippy, builds, and works in a browser (node, npm, python3, chromium)",
    commands: &[
        "cargo clippy --quiet --package delta-cal-host --package delta-cal-web --no-default-features \
         --target wasm32-unknown-unknown -- --deny warnings",
        "npm ci --prefix bindings/web --no-audit --no-fund",
        "node bindings/web/build.mjs",
        "npm run --silent check --prefix bindings/web",
        "cargo test --quiet --no-run --package delta-cal-host --test it",
        r#"
tar -czf "$release/delta-cal-page.tar.gz" -C bindings/web dist
cp bindings/web/delta-cal.html "$release"
empty
tar -xzf "$release/delta-cal-page.tar.gz"
cp "$release/delta-cal.html" .
PAGE=$PWD node --test "$root/bindings/web/tests/"
"#,
    ],
};

pub(crate) const PYTHON: Stage = Stage {
    name: "python",
    about: "the Python package: clippy, source archive, wheel from it, its tests, types, examples",
    commands: &[
        "cargo clippy --quiet --package delta-cal-python --all-targets -- --deny warnings",
        "cargo test --quiet --no-run --package delta-cal-host --test it",
        r#"
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
"#,
    ],
};

const BOARD: Stage = Stage {
    name: "board",
    about: "the controller for a real board, Raspberry Pi Pico 2, as UF2 (python3)",
    commands: &[
        "rustup target add thumbv8m.main-none-eabihf",
        "cargo build --quiet --locked --release --manifest-path firmware-example/boards/pico2/Cargo.toml \
         --target thumbv8m.main-none-eabihf --target-dir target/pico2",
        // From where the processor sees its flash memory.
        r#"
tool=target/uf2/bin/uf2conv
test -x $tool || { python3 -m venv --clear target/uf2 && target/uf2/bin/pip install --quiet 'adafruit-uf2>=1,<2'; }
program=target/pico2/thumbv8m.main-none-eabihf/release/delta-cal-pico2
"$(rustc --print sysroot)/lib/rustlib/$host/bin/rust-objcopy" --output-target=binary $program $program.bin
$tool $program.bin --convert --base 0x10000000 --family RP2350_ARM_S --output "$release/delta-cal-pico2.uf2"
"#,
    ],
};

const SUMS: Stage = Stage {
    name: "sums",
    about: "SHA-256 of every file of a release",
    commands: &[r#"
cd "$release"
rm -f SHA256SUMS
(sha256sum -- * || shasum -a 256 -- *) > ../SHA256SUMS
mv ../SHA256SUMS .
case $host in *-linux-*) follow 'Check what you downloaded' ;; esac
ls -l
"#],
};
