# Shared by ./run and ./test: what is missing is installed, and the suite is built. Sourced by bash.
# shellcheck shell=bash

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# Debian's python3 even where another one is first (pyenv, conda): catkin and the nodes need its packages.
export PATH=/usr/bin:/bin:/usr/sbin:/sbin:$PATH
unset PYTHONHOME PYTHONPATH VIRTUAL_ENV
# Numbers with a point in every language; texts in UTF-8.
export LC_ALL=C.UTF-8 LANG=C.UTF-8  # the second: of the keys of the compiler's cache
# Sockets listen on this machine alone, unless the shell names an address.
[ -n "${ROS_IP:-}${ROS_HOSTNAME:-}" ] || export ROS_HOSTNAME=localhost

say() { printf '== %s\n' "$*"; }
fail() {
  printf '%s: %s\n' "${0##*/}" "$*" >&2
  exit 1
}

# Told at once, before anything is installed: Debian's ROS packages beside a ROS of /opt/ros would break that one.
refuse_other_systems() {
  local system=${VEST_OS_RELEASE:-/etc/os-release} ros=${VEST_OPT_ROS:-/opt/ros} name ours
  ours=$(. "$system" 2>/dev/null && [ "${ID:-}" = debian ] && [ "${VERSION_ID:-}" = 12 ] && echo yes)
  name=$(. "$system" 2>/dev/null && echo "${PRETTY_NAME:-}")
  [ -z "$(ls -A "$ros" 2>/dev/null)" ] || fail "$ros has a ROS of its own ($(ls "$ros" | tr '\n' ' ')): nothing was installed beside it. Build VEST in a catkin workspace (README.md, docs/noetic.md)"
  [ "$ours" = yes ] || fail "this is ${name:-not a system that is known}; packages are installed on Debian 12 only. Build VEST in a catkin workspace (README.md, docs/noetic.md)"
}

# install_missing FILE…: apt packages that the lists name and the machine lacks. Needs no network when all is there.
install_missing() {
  local -a wanted missing=()
  mapfile -t wanted < <(sed -e 's/#.*//' -e 's/[[:space:]]//g' -e '/^$/d' "$@" | sort -u)
  local installed package
  installed=$(dpkg-query -W -f='${Package} ${db:Status-Abbrev}\n' "${wanted[@]}" 2>/dev/null | awk '$2 == "ii" {print $1}')
  for package in "${wanted[@]}"; do
    grep -qxF "$package" <<<"$installed" || missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return 0
  local -a sudo=()
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || fail "these Debian packages are missing, and there is no sudo to install them: ${missing[*]}"
    sudo=(sudo)
  fi
  say "installing ${#missing[@]} Debian packages that VEST is built with and runs on (ROS 1, rviz, libraries): ${missing[*]}"
  "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get update || fail "apt-get update failed: is there a network?"
  "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "${missing[@]}" ||
    fail "apt-get install failed, see above (Debian 12 is what this is made for)"
}

# configure FOLDER [cmake options]: where the folder is fresh or was configured with other options. Twice, because the
# first pass does not know the packages' paths yet.
configure() {
  local build=$1 pass
  shift
  [ -f "$build/build.ninja" ] && [ "$(cat "$build/.configured" 2>/dev/null)" = "$*" ] && return 0
  mkdir -p "$build"
  rm -f "$build/.configured"
  for pass in 1 2; do
    say "configuring $build ($pass of 2)"
    cmake -S "$repository" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
      -DPYTHON_EXECUTABLE=/usr/bin/python3 -DPython3_EXECUTABLE=/usr/bin/python3 \
      -DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache -DVEST_UNITY_BUILD=ON "$@" >"$build/configure.log" 2>&1 ||
      { tail -n 40 "$build/configure.log" >&2; fail "cmake failed; all of its output: $build/configure.log"; }
  done
  echo "$*" >"$build/.configured"
}

# build FOLDER [targets]: on a terminal progress is ninja's own line; elsewhere only what goes wrong is said. (Each build checks
# the dependencies of 59 messages and services anew, a line for each.)
build() {
  local build=$1
  local -a quiet=()
  shift
  [ -t 1 ] || { quiet=(--quiet); say "building $build (the first time this takes minutes)"; }
  export CCACHE_BASEDIR=$repository CCACHE_NOHASHDIR=1
  # Two at once in one folder would break each other's files.
  (
    flock -n 9 || { say "waiting for another build in $build"; flock 9; }
    # Where a CMake file changed, cmake runs again, and has as much to say as the first time.
    ninja -C "$build" build.ninja >"$build/regenerate.log" 2>&1 9>&- || { tail -n 40 "$build/regenerate.log" >&2; exit 1; }
    NINJA_STATUS='[%f/%t %es] ' ninja ${quiet[@]+"${quiet[@]}"} -C "$build" "$@" 9>&-
  ) 9>"$build/.lock" || fail "the build failed, see above"
}

# free_port FIRST: a TCP port that nobody listens on.
free_port() {
  local port
  for ((port = $1; port < $1 + 200; port++)); do
    (exec 3<>"/dev/tcp/127.0.0.1/$port") 2>/dev/null || { echo "$port"; return 0; }
  done
  fail "no free port between $1 and $(($1 + 199))"
}
