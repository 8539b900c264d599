#!/bin/sh
# Draws the pictures of pages anew. It needs delta-cal on the path, chromium, and the page as built.
set -eu
docs=$(cd "$(dirname "$0")" && pwd)
cd "$(mktemp -d)"
# The files that the tutorial names.
awk '/^```[a-z]+ / {file = $2; next} /^```/ {file = ""} file {print > file}' "$docs/tutorial.md"
delta-cal calibrate --output example.toml --report report.html > calibrate.txt
region=r=250,z=-680..-480
delta-cal plan robot.toml --count 20 --frame sensor --absolute --within $region --names P --output poses.csv > plan.txt
delta-cal calibrate robot.toml poses.csv tracker.csv --frame sensor --output calibrated.toml > calibrate.txt
delta-cal plan robot.toml --validation poses.csv --frame sensor --within $region --count 20 --seed 7 --names V \
  --output check.csv > plan.txt
delta-cal validate calibrated.toml check.csv check_tracker.csv --frame sensor --limit 0.2mm --report certificate.html > validate.txt
delta-cal workspace "$docs/../host/examples/paper-robot/robot.toml" --output workspace > workspace.txt
sed 's|<svg[^>]*>|&<rect width="100%" height="100%" fill="#fff"/>|' workspace/section.svg > "$docs/workspace.svg"
for picture in report certificate; do
  chromium --headless --no-sandbox --disable-gpu --hide-scrollbars --window-size=1000,1100 \
    --screenshot="$docs/$picture.png" "file://$PWD/$picture.html"
done
cd "$docs/../bindings/web/tests"
node --input-type=module -e '
import { FILE, launch, open } from "./page.mjs";
const browser = await launch();
const { page } = await open(browser, `file://${FILE}`, { viewport: { width: 1000, height: 860 } });
await page.getByRole("button", { name: "Printer with Klipper" }).click();
await page.locator("#bed-picture").waitFor();
await page.screenshot({ path: process.argv[1] });
await browser.close();
' "$docs/page.png"
