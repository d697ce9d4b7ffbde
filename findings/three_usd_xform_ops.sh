#!/usr/bin/env bash
# three 0.187.0, USDLoader: which transform ops of a prim are applied, beside what the USD schema says.
# Guess: all ops that xformOpOrder lists are applied in that order, and only those.
# Seen: of the six Euler orders rotateXYZ alone is applied; rotateZYX (30 40 50) is passed over as if it were
#   zero. So are ops with a suffix other than pivot (xformOp:translate:body). An op that
#   xformOpOrder does not list, which USD has switched off, is applied if there is no xformOpOrder. And an
#   animated xformOp:rotateZ or xformOp:transform yields no animation, beside translate, orient and rotateXYZ
#   that do. No warning for any of it.
# For users of Atelier: write translate and orient without suffixes, still or moving, and always an xformOpOrder;
#   these three reads right. A still xformOp:transform is read right too.
set -euo pipefail
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
npm install --prefer-offline --silent --no-audit --no-fund --ignore-scripts three@0.187.0 >/dev/null 2>&1 ||
  { echo "three 0.187.0 cannot be had"; exit 77; }
cat > run.mjs <<'JS'
// Valid: UsdGeomXformable lists rotateXYZ to rotateZYX, rotateX to rotateZ, transform and suffixed ops, says that
// the order is xformOpOrder's, and that ops outside it do not count. rotateZYX turns by Z first.
import { Vector3 } from 'three';
import { USDLoader } from 'three/examples/jsm/loaders/USDLoader.js';
const scene = (ops) => new USDLoader().parse(`#usda 1.0
(
    defaultPrim = "Root"
    metersPerUnit = 1
    timeCodesPerSecond = 24
    upAxis = "Y"
)
def Xform "Root"
{
${ops}
    def Mesh "M"
    {
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    }
}
`);
const order = (name) => `    uniform token[] xformOpOrder = ["${name}"]`;
function corner(ops) {                       // where the point (1 0 0) of the mesh ends
  const group = scene(ops);
  group.updateMatrixWorld(true);
  let mesh;
  group.traverse((object) => { if (object.isMesh) mesh = object; });
  return new Vector3(1, 0, 0).applyMatrix4(mesh.matrixWorld).toArray().map((x) => Number(x.toFixed(3)) || 0).join(' ');
}
const moving = (type, name, a, b) => scene(
  `    ${type} ${name}.timeSamples = {\n        0: ${a},\n        24: ${b},\n    }\n${order(name)}`).animations.length;
const identity = '( (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1) )';
const quarter = '( (0, 1, 0, 0), (-1, 0, 0, 0), (0, 0, 1, 0), (5, 0, 0, 1) )';
const rows = [                               // what, what the schema gives, seen, recorded
  ['rotateXYZ 30 40 50', '0.492 0.587 -0.643', corner(`    double3 xformOp:rotateXYZ = (30, 40, 50)\n${order('xformOp:rotateXYZ')}`), '0.492 0.587 -0.643'],
  ['rotateZYX 30 40 50', '0.492 0.870 0.025', corner(`    double3 xformOp:rotateZYX = (30, 40, 50)\n${order('xformOp:rotateZYX')}`), '1 0 0'],
  ['translate:body 7 0 0', '8 0 0', corner(`    double3 xformOp:translate:body = (7, 0, 0)\n${order('xformOp:translate:body')}`), '1 0 0'],
  ['translate 7 0 0, not in the order', '1 0 0', corner('    double3 xformOp:translate = (7, 0, 0)'), '8 0 0'],
  ['animated translate, clips', 1, moving('double3', 'xformOp:translate', '(0, 0, 0)', '(1, 0, 0)'), 1],
  ['animated rotateZ, clips', 1, moving('double', 'xformOp:rotateZ', '0', '90'), 0],
  ['animated transform, clips', 1, moving('matrix4d', 'xformOp:transform', identity, quarter), 0],
];
let failed = false;
for (const [what, schema, seen, recorded] of rows) {
  console.log(`${what}: ${seen} (USD: ${schema})`);
  if (seen !== recorded) failed = true;
}
if (failed) { console.log(`changed: recorded were ${rows.map((row) => row[3]).join('; ')}`); process.exit(1); }
JS
node run.mjs
