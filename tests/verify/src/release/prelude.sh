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
