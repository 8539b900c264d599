cd "$release"
rm -f SHA256SUMS
(sha256sum -- * || shasum -a 256 -- *) > ../SHA256SUMS
mv ../SHA256SUMS .
case $host in *-linux-*) follow 'Check what you downloaded' ;; esac
ls -l
