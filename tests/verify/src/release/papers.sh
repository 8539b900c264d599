rm -rf "$release" target/archive
mkdir -p "$release" target/archive
papers
cp CHANGELOG.md "$release"
