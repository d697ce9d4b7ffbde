# Sourced by findings: pinned Debian packages, without installing them.
#
#   . "$(dirname "$(realpath "$0")")/debian.sh"      before the script leaves its place
#   cd "$work"                                       a temporary folder
#   debian_packages NAME=VERSION...
#
# What is installed in that very version is used as it is. The rest, with what it depends on and is not
# installed, is downloaded by apt-get and unpacked into ./debian, which is put before the system in the paths
# of programs, libraries, headers and Python. Ends the script with 77 on another distribution and where a
# version cannot be had. FINDINGS_UNPACK=1 unpacks what is installed too.

debian_packages() {
  local pinned missing=() reinstall=() plan
  for pinned in "$@"; do
    if [ "$(dpkg-query -W -f='${db:Status-Abbrev}${Version}' "${pinned%%=*}" 2>/dev/null)" != "ii ${pinned#*=}" ] ||
      [ -n "${FINDINGS_UNPACK:-}" ]; then
      missing+=("$pinned")
    fi
  done
  [ ${#missing[@]} -gt 0 ] || return 0
  if ! grep -qx 'ID=debian' /etc/os-release 2>/dev/null || ! grep -qx 'VERSION_ID="12"' /etc/os-release; then
    echo "skipped: needs Debian 12 (bookworm) and of it: ${missing[*]}"
    exit 77
  fi
  [ -z "${FINDINGS_UNPACK:-}" ] || reinstall=(--reinstall)
  plan=$(LC_ALL=C apt-get -s --no-install-recommends --allow-downgrades "${reinstall[@]}" install "${missing[@]}" 2>&1) || {
    echo "skipped: ${missing[*]} cannot be had (apt-get update, or another release of Debian 12): $(tail -n 1 <<<"$plan")"
    exit 77
  }
  mkdir -p debian/archives
  # "Inst name [version that is installed] (version that is wanted ...)"
  (cd debian/archives && sed -nE 's/^Inst ([^ ]+)( \[[^]]*\])? \(([^ ]+) .*/\1=\3/p' <<<"$plan" |
    LC_ALL=C xargs apt-get -qq download >../log 2>&1) || {
    echo "skipped: ${missing[*]} cannot be downloaded: $(tail -n 1 debian/log)"
    exit 77
  }
  local archive root=$PWD/debian/root
  for archive in debian/archives/*.deb; do
    dpkg -x "$archive" "$root"
  done
  rm -r debian/archives
  local libraries
  libraries=$(find "$root" -name dist-packages -prune -o -name '*.so*' -printf '%h\n' | sort -u | paste -sd:)
  export PATH=$root/usr/bin:$root/usr/games:$PATH
  export LD_LIBRARY_PATH=$libraries${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH} LIBRARY_PATH=$libraries
  export PYTHONPATH=$root/usr/lib/python3/dist-packages CPLUS_INCLUDE_PATH=$root/usr/include
  local headers
  for headers in "$root"/usr/include/{bullet,opencv4,eigen3}; do
    [ ! -d "$headers" ] || CPLUS_INCLUDE_PATH+=:$headers
  done
  [ ! -d "$root/usr/share/blender" ] ||
    export BLENDER_SYSTEM_SCRIPTS=$root/usr/share/blender/scripts BLENDER_SYSTEM_DATAFILES=$root/usr/share/blender/datafiles
  echo "unpacked: ${missing[*]}" >&2
}
