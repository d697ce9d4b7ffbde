#!/usr/bin/env bash
# jsfive 0.4.2 (npm) on files of python3-h5py 3.7.0 (HDF5 1.10.8, Debian 12).
# Guess: frames that were never written read as the file's fill value (-1, or 0 by default), as
#   h5py and h5wasm read them.
# Seen: chunks that do not exist come as undefined, whatever the fill value: sums are NaN, JSON says
#   null. Integers of 64 bits lose their last bits (2^53 + 1 comes as 2^53), and text of fixed
#   length keeps its padding of NUL, so that "hip" is not "hip".
# For users of Atelier: sequences written frame by frame and id columns need h5wasm in a page;
#   joint names are compared after trimming NUL.
set -euo pipefail
. "$(dirname "$(realpath "$0")")/debian.sh"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
debian_packages python3-h5py=3.7.0-8
echo '{"type": "module"}' > package.json
npm install --no-audit --no-fund --ignore-scripts --silent jsfive@0.4.2 \
  > npm.log 2>&1 || { echo "the npm package cannot be had"; exit 77; }

# Valid: written by the HDF5 library itself, and read back by it in the line "h5py".
/usr/bin/python3 - <<'PY'
import h5py, numpy as np
with h5py.File('a.h5', 'w') as f:
    f.create_dataset('marked', (4,), chunks=(2,), dtype='i4', fillvalue=-1)[0:2] = 7
    f.create_dataset('plain', (4,), chunks=(2,), dtype='f4')[0:2] = 7
    f['id'] = np.array([2**53 + 1])
    f['name'] = np.array([b'hip', b'knee'])
with h5py.File('a.h5') as f:
    assert f['marked'][:].tolist() == [7, 7, -1, -1] and f['plain'][:].tolist() == [7, 7, 0, 0]
    assert int(f['id'][0]) == 2**53 + 1 and f['name'][0] == b'hip'
    print('h5py:', f['marked'][:].tolist(), f['plain'][:].tolist(), int(f['id'][0]),
          len(f['name'][0]))
PY
cat > seen.js <<'JS'
import * as hdf5 from 'jsfive';
import fs from 'fs';
const bytes = fs.readFileSync('a.h5');
const file = new hdf5.File(
    bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), 'a.h5');
const all = (name) => Array.from(file.get(name).value, String).join(' ');
console.log(`jsfive: ${all('marked')}, ${all('plain')}, ${file.get('id').value[0]}, ` +
            `${file.get('name').value[0].length}`);
JS
seen=$(node seen.js)
printf '%s\n' "$seen"
expected='jsfive: 7 7 undefined undefined, 7 7 undefined undefined, 9007199254740992, 4'
if [ "$seen" != "$expected" ]; then
  echo "CHANGED: jsfive reads what was not written otherwise than recorded"
  exit 1
fi
