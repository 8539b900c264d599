tar -czf "$release/delta-cal-page.tar.gz" -C bindings/web dist
cp bindings/web/delta-cal.html "$release"
empty
tar -xzf "$release/delta-cal-page.tar.gz"
cp "$release/delta-cal.html" .
PAGE=$PWD node --test "$root/bindings/web/tests/"
