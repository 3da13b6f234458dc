# The Debian package under real systemd: it installs, becomes active, a hung publisher is killed by the watchdog and is
# back and publishing; removal leaves nothing but configuration.
set -uo pipefail
. /vm/common.sh
uname -rv
device_nodes
installed
devices_emulated
configured
systemctl restart perimapd || fail "the service does not start"
systemctl is-active perimapd || fail "the service is not active"
systemctl is-enabled perimapd || fail "the service is not enabled"
[ "$(ps -o user= -p "$(systemctl show -P MainPID perimapd)")" = perimap ] || fail "it does not run as perimap"
systemctl show -P StatusText perimapd
for kind in ttyS ttyUSB ttyACM video4linux; do
  grep -q " $kind\$" /proc/devices || fail "a $kind that is plugged in from now on is forbidden to it"
done
echo "ok: each kind of device that it may open was known when it started"
received 5 /tmp/first
holds /tmp/first "it publishes" "x.received > 5"

until_true 60 bash -c 'journalctl -u perimapd -o cat | grep -q "tracker: streaming"' || fail "the tracker is not opened"
# An emulated processor may take longer for a command than perimap ctl waits.
until_true 120 bash -c 'perimap ctl record on; find /var/lib/perimap -name "*.mcap" -size +0 | grep -q .' ||
  fail "nothing is recorded"
until_true 120 perimap ctl new-patient || fail "a new patient is refused"
until_true 120 systemctl reload perimapd || fail "reload is refused"
others=$(find /var/lib/perimap /run/perimap -type f -perm /077)
[ -z "$others" ] || fail "others can read or write: $others"
confined

# One thread is held, as if it hung; the others go on.
before=$(systemctl show -P MainPID perimapd)
/vm/bin/hold_thread "$before" publisher &
until_true 60 bash -c "[ \"\$(systemctl show -P MainPID perimapd)\" != $before ] && systemctl is-active perimapd" ||
  fail "the watchdog did not bring it back"
journalctl -u perimapd -o cat | grep -q 'Watchdog timeout' || fail "it was not the watchdog"
[ "$(systemctl show -P NRestarts perimapd)" -ge 1 ] || fail "it was not restarted"
echo "ok: a hung publisher is killed and restarted"
received 5 /tmp/second
holds /tmp/second "it publishes again" "x.received > 5"

kill -9 "$(systemctl show -P MainPID perimapd)"
received 5 /tmp/third
holds /tmp/third "it publishes after kill -9" "x.received > 5"

confined
# What it does not need is denied, although its owner may read it.
echo 'version = 2' > /srv/other.toml
said=$(perimapd -c /srv/other.toml 2>&1)
[[ $said == *version* ]] || fail "unconfined it does not read its configuration: $said"
said=$(aa-exec -p perimapd -- /usr/sbin/perimapd -c /srv/other.toml 2>&1)
[[ $said == *'Permission denied'* ]] || fail "its profile lets it read everything: $said"
dmesg | grep -q 'apparmor="DENIED".*profile="perimapd" name="/srv/other.toml"' || fail "that it was denied is not told"
echo "ok: what the profile does not name is denied"

# Nothing of the package is left but configuration; tests/integration/service/package.sh looks at the whole system.
dpkg -L perimap > /tmp/files
dpkg --force-unsafe-io -r perimap > /tmp/dpkg 2>&1 || fail "removal: $(cat /tmp/dpkg)"
[ -z "$(pgrep perimapd)" ] || fail "removal leaves it running"
while read -r file; do
  case $file in /etc/perimap* | /etc/apparmor.d*) continue ;; esac
  [ -d "$file" ] || [ ! -e "$file" ] || fail "removal leaves $file"
done < /tmp/files
[ ! -e /run/perimap ] || fail "removal leaves /run/perimap"
echo "ok: removal leaves nothing but configuration"
