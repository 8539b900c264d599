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
