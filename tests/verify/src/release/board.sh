tool=target/uf2/bin/uf2conv
test -x $tool || { python3 -m venv --clear target/uf2 && target/uf2/bin/pip install --quiet 'adafruit-uf2>=1,<2'; }
program=target/pico2/thumbv8m.main-none-eabihf/release/delta-cal-pico2
"$(rustc --print sysroot)/lib/rustlib/$host/bin/rust-objcopy" --output-target=binary $program $program.bin
# From where the processor sees its flash memory.
$tool $program.bin --convert --base 0x10000000 --family RP2350_ARM_S --output "$release/delta-cal-pico2.uf2"
