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
