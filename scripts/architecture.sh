# shellcheck shell=bash
# Building for a Debian architecture, this computer's or another, with a static OpenCV. This file is
# sourced after lib.sh and never run.

# choose_architecture NAME: sets architecture, triple (Rust's name), multiarch (Debian's name in
# paths), and sysroot, the folder with the architecture's libraries: nothing for this computer's.
# Ends the script for an architecture that no package is for.
choose_architecture() {
  architecture=$1
  case $architecture in
    amd64) multiarch=x86_64-linux-gnu ;;
    arm64) multiarch=aarch64-linux-gnu ;;
    *)
      say "There is no package for the architecture $architecture: amd64 and arm64 are known."
      exit 2
      ;;
  esac
  triple=${multiarch/-linux/-unknown-linux}
  sysroot=
  if is_foreign; then
    sysroot=$PWD/target/tools/$architecture
  fi
}

# is_foreign: succeeds if the chosen architecture is not this computer's.
is_foreign() { [ "$architecture" != "$(dpkg --print-architecture)" ]; }

# newest_package ARCHITECTURE: prints the path of the package in target/package, or says how to
# build it and fails.
newest_package() {
  local deb
  mkdir -p target/package
  deb=$(find target/package -maxdepth 1 -name "plumb_*_$1.deb" | sort -V | tail -n 1)
  if [ -z "$deb" ]; then
    say "There is no package for $1 in target/package: make package ARGS=$1"
    return 2
  fi
  printf '%s' "$deb"
}

# set_up_architecture: installs what a build for the chosen architecture needs. For another than
# this computer's: its C++ compiler, its part of Rust, OpenCV's packages in $sysroot, and QEMU,
# which runs its programs. This computer's packages keep their architecture.
set_up_architecture() {
  local module
  if is_foreign; then
    scripts/setup "g++-${multiarch/_/-}" qemu-user-static
    if ! compgen -G "$(rustc --print target-libdir --target "$triple")/libstd-*.rlib" >/dev/null
    then
      say "Adding Rust's $triple target: rustup target add $triple"
      bounded 300 rustup target add "$triple" </dev/null >&2
    fi
    [ -d "$sysroot" ] || fetch_libraries libopencv-core-dev libopencv-imgproc-dev
  fi
  for module in core imgproc; do
    if [ ! -e "$sysroot/usr/lib/$multiarch/libopencv_$module.a" ]; then
      say "$sysroot/usr/lib/$multiarch/libopencv_$module.a is missing: apt-get install" \
        "libopencv-imgproc-dev"
      exit 2
    fi
  done
}

# fetch_libraries PACKAGE...: unpacks packages of the chosen architecture into $sysroot, with the
# sources of this computer's apt and an empty state of its own.
fetch_libraries() {
  local state options package
  say "Fetching for $architecture into $sysroot: $*"
  state=$(mktemp -d)
  mkdir -p "$state/lists/partial" "$state/cache/archives/partial" "$state/packages"
  touch "$state/status"
  options=(-qq -o "APT::Architecture=$architecture" -o "APT::Architectures::=$architecture"
    -o "Dir::State=$state" -o "Dir::State::Status=$state/status" -o "Dir::Cache=$state/cache"
    -o APT::Sandbox::User=root)
  apt-get "${options[@]}" update >&2
  (cd "$state/packages" && apt-get "${options[@]}" download "$@" >&2)
  rm -rf "$sysroot.new"
  for package in "$state"/packages/*.deb; do
    dpkg-deb --extract "$package" "$sysroot.new"
  done
  mv "$sysroot.new" "$sysroot"
  rm -rf "$state"
}

# opencv_libraries FOLDER: makes OpenCV's static libraries for the chosen architecture, with the
# functions of host/debian/opencv.cpp in the place of Debian's, in a folder of FOLDER. Sets the
# variable libraries to it.
opencv_libraries() {
  local folder=$sysroot/usr/lib/$multiarch parts member new core headers compiler=(clang++)
  parts=(host/debian/opencv.cpp "$folder"/libopencv_{core,imgproc}.a)
  # Cargo sees other libraries by the name of their folder only.
  libraries=$PWD/$1/opencv-$architecture-$(cat "${parts[@]}" | sha256sum | cut -c1-12)
  new=$libraries.new
  core=$new/libopencv_core.a
  headers=$(opencv_headers)
  if is_foreign; then
    compiler=("$multiarch-g++")
  fi
  [ ! -d "$libraries" ] || return 0
  rm -rf "$1/opencv-$architecture"-*
  mkdir -p "$new"
  cp "${parts[@]:1}" "$new"
  # Two sources have the name parallel.cpp.
  for member in hal_internal parallel parallel parallel_tbb; do
    ar dD "$core" "$member.cpp.o"
  done
  "${compiler[@]}" -O2 -fPIC -I"${headers%,*}" -I"${headers#*,}" -c -o "$new/plumb.o" \
    "${parts[0]}"
  ar rcsD "$core" "$new/plumb.o"
  mv "$new" "$libraries"
}

# opencv_headers: prints the two folders of OpenCV's headers, with a comma between them.
opencv_headers() {
  printf '%s' "$sysroot/usr/include/opencv4,$sysroot/usr/include/$multiarch/opencv4"
}

# cargo_for_architecture FOLDER ARGUMENT...: runs cargo for the chosen architecture, with the static
# OpenCV of opencv_libraries and the results in FOLDER. QEMU runs another architecture's programs.
cargo_for_architecture() {
  local name=CARGO_TARGET_${triple//-/_}
  local environment=("CARGO_TARGET_DIR=$PWD/$1" "OPENCV_INCLUDE_PATHS=$(opencv_headers)"
    "OPENCV_LINK_PATHS=$libraries"
    "OPENCV_LINK_LIBS=static=opencv_imgproc,static=opencv_core")
  if is_foreign; then
    environment+=("${name^^}_LINKER=$multiarch-gcc")
  fi
  env "${environment[@]}" cargo "${@:2}" --target "$triple"
}

# qemu: prints the words that run a program of the chosen architecture, nothing for this computer's.
qemu() {
  ! is_foreign || printf '%s' "qemu-${triple%%-*}-static -L /usr/$multiarch"
}
