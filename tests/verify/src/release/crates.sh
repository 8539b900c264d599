rm -rf target/package
cargo package --quiet --locked --package delta-cal --package delta-cal-protocol --package delta-cal-controller \
  --package delta-cal-c --package delta-cal-host
cp target/package/*.crate "$release"
empty
ln -s "$root" delta-cal
cargo new --quiet --lib firmware
cd firmware
follow 'A Rust firmware'
