"""Makes the source archive in a folder, of the crates that the wheel consists of: without firmware, and without tests of others.

    python bindings/python/archive.py FOLDER        # needs maturin and cargo
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

PARTS = ["core", "protocol", "host", "bindings/python"]
HERE = Path(__file__).parent


def trim(root: Path) -> None:
    """Leaves the crates of `PARTS`, and nothing of what their own tests need."""
    kept = {Path(part).parts[0] for part in PARTS} | {"delta_cal"}
    others = [path for path in root.iterdir() if path.is_dir() and path.name not in kept]
    for path in [*others, *root.glob("**/tests/"), *root.glob("**/benches/")]:
        shutil.rmtree(path, ignore_errors=True)
    for path in root.glob("**/src/**/tests.rs"):
        path.unlink()
    for manifest in [root / "Cargo.toml", *(root / part / "Cargo.toml" for part in PARTS)]:
        text = manifest.read_text(encoding="utf-8")
        text = re.sub(r"^\[dev-dependencies\]\n.*?(?=^\[|\Z)", "", text, flags=re.M | re.S)
        text = re.sub(r"^\[\[(bench|example|test)\]\]\n.*?(?=^\[|\Z)", "", text, flags=re.M | re.S)
        text = re.sub(r"^\[profile\.(?!release).*?\]\n.*?(?=^\[|\Z)", "", text, flags=re.M | re.S)
        text = re.sub(r"^members = \[.*?\]", f"members = {PARTS!r}".replace("'", '"'), text, flags=re.M | re.S)
        manifest.write_text(text, encoding="utf-8")
    # The lock file loses what nothing needs any more; no version changes.
    subprocess.run(["cargo", "update", "--quiet", "--workspace", "--offline"], cwd=root, check=True)


def main(folder: Path) -> None:
    with tempfile.TemporaryDirectory() as temporary:
        made = Path(temporary)
        manifest = ["--manifest-path", str(HERE / "Cargo.toml")]
        subprocess.run([sys.executable, "-m", "maturin", "sdist", "--out", str(made), *manifest], check=True, capture_output=True)
        (archive,) = made.glob("*.tar.gz")
        with tarfile.open(archive) as packed:
            packed.extractall(made)
        root = made / archive.name[: -len(".tar.gz")]
        trim(root)
        with tarfile.open(folder / archive.name, "w:gz") as packed:
            for path in sorted(path for path in root.glob("**/*") if path.is_file()):
                packed.add(path, path.relative_to(made).as_posix())


if __name__ == "__main__":
    main(Path(sys.argv[1]))
