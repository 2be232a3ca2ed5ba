# shellcheck shell=bash
# Bare Debian systems to try things in. This file is sourced after lib.sh and architecture.sh and
# never run.

# own_mounts SCRIPT ARGUMENT...: runs the script again in a mount namespace of its own, so that what
# it mounts is gone at its end, however it ends. Ends the script where that is impossible.
own_mounts() {
  if [ "$(id -u)" -ne 0 ] || ! command -v debootstrap >/dev/null; then
    say "It needs root, and: apt-get install debootstrap"
    exit 2
  fi
  if [ -z "${PLUMB_MOUNTS:-}" ]; then
    PLUMB_MOUNTS=own exec unshare --mount --pid --fork --kill-child --propagation private "$@"
  fi
}

# choose_bare SUITE: makes a bare system of the chosen architecture, if there is none, in a folder
# of target/bare, and sets bare to the folder. QEMU runs the programs of another architecture.
choose_bare() {
  bare=$PWD/target/bare/$1-${architecture:?}
  if is_foreign; then
    scripts/setup qemu-user-static binfmt-support
    local processor=${triple:?}
    processor=qemu-${processor%%-*}
    if [ ! -e "/proc/sys/fs/binfmt_misc/$processor" ]; then
      say "The kernel does not give programs of $architecture to QEMU. As root:"
      say "mount -t binfmt_misc binfmt_misc /proc/sys/fs/binfmt_misc;" \
        "update-binfmts --enable $processor"
      exit 2
    fi
  fi
  [ -d "$bare" ] || make_bare "$1"
}

# make_bare SUITE: makes the bare system. It takes this machine's configuration of apt.
make_bare() {
  local suite=$1 mirror options=() script=()
  local keys=/usr/share/keyrings/ubuntu-archive-keyring.gpg
  say "Making a bare $suite ($architecture) in $bare (a minute or so, in QEMU ten)"
  mkdir -p target/bare
  rm -rf "$bare.new"
  if [ "$suite" = noble ]; then
    if [ ! -e "$keys" ]; then
      say "The keys of Ubuntu's packages are missing: apt-get install ubuntu-archive-keyring"
      exit 2
    fi
    # All releases of Ubuntu since gutsy are made in one way.
    if [ -z "${UBUNTU_MIRROR:-}" ]; then
      say "UBUNTU_MIRROR must name a mirror of Ubuntu: the address in its sources.list."
      exit 2
    fi
    options=(--keyring="$keys") mirror=$UBUNTU_MIRROR
    script=(/usr/share/debootstrap/scripts/gutsy)
  else
    # The first source of packages of this machine.
    mirror=$(apt-get indextargets 'Created-By: Packages' | awk '/^Repo-URI: / && !n++ { print $2 }')
  fi
  debootstrap --arch="$architecture" --variant=minbase --include=ca-certificates \
    "${options[@]}" "$suite" "$bare.new" "$mirror" "${script[@]}" >&2
  cp -r /etc/apt/apt.conf.d/. "$bare.new/etc/apt/apt.conf.d/"
  mv "$bare.new" "$bare"
}

# copy_bare: makes a copy of the bare system, which is removed when the script ends, and sets root
# to its folder.
copy_bare() {
  # As /proc/mounts names it.
  root=$(realpath "$(mktemp -d)")
  trap remove_copy EXIT
  cp -a "$bare/." "$root"
  cp /etc/resolv.conf /etc/hosts "$root/etc/"
  mount -t proc proc "$root/proc"
  mount --bind /dev "$root/dev"
  mount -t devpts -o ptmxmode=666,gid=5,mode=620 devpts "$root/dev/pts"
}

# show_inside FOLDER...: shows folders of this computer in the copy, at the same paths, read-only: a
# mistake in the copy must not change them.
show_inside() {
  local folder
  for folder in "$@"; do
    mkdir -p "$root$folder"
    mount --bind "$folder" "$root$folder"
    mount -o remount,bind,ro "$root$folder"
  done
}

# mounted: prints what is mounted in the copy, the innermost first.
mounted() {
  awk -v within="$root/" 'index($2, within) == 1 { print $2 }' /proc/mounts | sort --reverse
}

# remove_copy: removes the copy, once nothing is mounted in it. `rm --one-file-system` is no guard:
# a folder that is mounted from the same disk is of the same file system.
remove_copy() {
  mounted | xargs --no-run-if-empty umount --lazy
  if [ -n "$(mounted)" ]; then
    say "$root is not removed: these are mounted in it:" "$(mounted)"
    return 1
  fi
  rm -rf --one-file-system "$root"
}

# inside COMMAND...: runs a command in the copy.
inside() { chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 "$@"; }
