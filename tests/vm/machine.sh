# A virtual machine with a Debian kernel and the root file system of this one, for tests/vm/run.sh to source.
#
# The kernel's package is unpacked, never installed. The guest's root is the host's, read only, with a layer in memory
# above it; whatever a test writes or installs is gone with the machine. Emulated (TCG): what takes how long in there
# means nothing.

# The commands it takes, each with the package that has it.
vm_needs=(qemu-system-x86_64=qemu-system-x86 busybox=busybox-static cpio=cpio zstd=zstd modprobe=kmod
  dpkg-deb=dpkg apt-get=apt systemctl=systemd udevadm=udev ip=iproute2 v4l2-ctl=v4l-utils apparmor_parser=apparmor)

# vm_missing: the packages that are missing, one a line
vm_missing() {
  local entry
  for entry in "${vm_needs[@]}"; do
    command -v "${entry%%=*}" > /dev/null || echo "${entry#*=}"
  done
}

# vm_kernel FLAVOUR FOLDER: fetches and unpacks Debian's kernel (amd64, rt-amd64); sets vm_release and vm_modules
vm_kernel() {
  local flavour=$1 folder=$2 package
  package=$(apt-cache depends "linux-image-$flavour" | awk '/Depends: linux-image-/ {print $2; exit}')
  [ -n "$package" ] || return 1
  vm_release=${package#linux-image-}
  vm_modules=$folder/$package
  [ ! -e "$vm_modules/.complete" ] || return 0
  rm -rf "$vm_modules"
  mkdir -p "$vm_modules"
  # apt drops its privileges to write, and may not do so here.
  (cd "$vm_modules" && apt-get -q -o APT::Sandbox::User=root download "$package" && dpkg-deb -x ./*.deb .) || return 1
  rm -f "$vm_modules"/*.deb
  depmod -b "$vm_modules" "$vm_release" || return 1
  touch "$vm_modules/.complete"
}

# vm_first_root FOLDER: the first root file system, from which the guest mounts the host's; sets vm_initrd
vm_first_root() {
  local folder=$1 tree module file
  vm_initrd=$folder/initrd-$vm_release
  tree=$(mktemp -d "$folder/initrd.XXXXXX")
  mkdir -p "$tree"/{bin,dev,host,layer,modules,proc,root,sys}
  install -m 755 "$(command -v busybox)" "$tree/bin/busybox"
  install -m 755 "$vm_guest/init" "$tree/init"
  for module in virtio_pci 9pnet_virtio 9p overlay; do
    modprobe -d "$vm_modules" -S "$vm_release" --show-depends $module | awk '$1 == "insmod" {print $2}'
  done | awk '!seen[$0]++' | while read -r file; do
    cp "$file" "$tree/modules/"
    basename "$file" >> "$tree/modules/order"
  done
  (cd "$tree" && find . | cpio --quiet -o -H newc) | gzip -1 > "$vm_initrd"
  rm -rf "$tree"
}

# vm_run SCRIPT FOLDER LIMIT_S: boots, runs the script there as root under systemd, powers off. The folder is /vm in the
# guest; the script's output is in FOLDER/output, the guest's console in FOLDER/console. Returns the script's exit code,
# 1 when the guest never came to its end.
vm_run() {
  local script=$1 folder=$2 limit=$3
  cp "$script" "$folder/script"
  rm -f "$folder/status"
  local share=security_model=none
  timeout --foreground "$limit" qemu-system-x86_64 -accel tcg,thread=multi -cpu max -smp 2 -m 1536 \
    -nodefaults -no-user-config -no-reboot -display none -nic none -serial "file:$folder/console" \
    -kernel "$vm_modules/boot/vmlinuz-$vm_release" -initrd "$vm_initrd" \
    -append "console=ttyS0 quiet panic=-1 tsc=reliable random.trust_cpu=on mitigations=off" \
    -fsdev "local,id=host,path=/,readonly=on,multidevs=remap,$share" -device virtio-9p-pci,fsdev=host,mount_tag=host \
    -fsdev "local,id=modules,path=$vm_modules/lib/modules/$vm_release,readonly=on,$share" \
    -device virtio-9p-pci,fsdev=modules,mount_tag=modules \
    -fsdev "local,id=exchange,path=$folder,$share" -device virtio-9p-pci,fsdev=exchange,mount_tag=exchange \
    -device virtio-rng-pci < /dev/null > "$folder/qemu" 2>&1
  [ -e "$folder/status" ] || return 1
  return "$(cat "$folder/status")"
}
