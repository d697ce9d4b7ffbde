#!/usr/bin/env bash
# npm three 0.187.0: OBJExporter, PLYExporter, STLExporter of a skinned mesh whose bone has moved by 3 and of a
# mesh whose morph target moves it by 0.5.
# Guess: an exporter writes what the viewer shows, or all three the mesh at rest.
# Seen: STL has the skinned mesh where it is shown and the morphed one at rest; OBJ and PLY have both at rest.
#   No warning. SkinnedMesh.getVertexPosition, which renders and boxes go by, has both where they are shown.
# Valid: one bone of weight 1; one target of weight 1.
# For users of Atelier: a person exported from a three viewer as OBJ or PLY stands in the rest pose, in clothes of
#   no frame; take `atelier export --format obj`, or apply getVertexPosition to every vertex first.
set -euo pipefail
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
echo '{"type": "module"}' > package.json
npm install --prefer-offline --silent --no-audit --no-fund --ignore-scripts three@0.187.0 >/dev/null 2>&1 ||
  { echo "three 0.187.0 cannot be had"; exit 77; }
cat > run.mjs <<'JS'
import { Bone, BufferAttribute, BufferGeometry, Mesh, Scene, Skeleton, SkinnedMesh, Vector3 } from 'three';
import { OBJExporter } from 'three/addons/exporters/OBJExporter.js';
import { PLYExporter } from 'three/addons/exporters/PLYExporter.js';
import { STLExporter } from 'three/addons/exporters/STLExporter.js';
globalThis.requestAnimationFrame = (then) => then();  // PLYExporter calls back by it
const triangle = () => new BufferGeometry()
  .setAttribute('position', new BufferAttribute(new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0]), 3)).setIndex([0, 1, 2]);
const skinned = new SkinnedMesh(triangle()
  .setAttribute('skinIndex', new BufferAttribute(new Uint16Array(12), 4))
  .setAttribute('skinWeight', new BufferAttribute(new Float32Array([1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]), 4)));
const bone = new Bone();
skinned.add(bone);
skinned.bind(new Skeleton([bone]));
bone.position.x = 3;
const shape = triangle();
shape.morphTargetsRelative = true;
shape.morphAttributes.position = [new BufferAttribute(new Float32Array([0.5, 0, 0, 0.5, 0, 0, 0.5, 0, 0]), 3)];
const morphed = new Mesh(shape);
morphed.morphTargetInfluences[0] = 1;
for (const [name, mesh] of Object.entries({ skinned, morphed })) {
  const scene = new Scene().add(mesh);
  scene.updateMatrixWorld(true);
  let ply;
  new PLYExporter().parse(scene, (text) => { ply = text; });
  const first = {
    shown: mesh.getVertexPosition(0, new Vector3()).x,
    OBJ: new OBJExporter().parse(scene).match(/^v (\S+)/m)[1],
    PLY: ply.split('end_header\n')[1].split(' ')[0],
    STL: new STLExporter().parse(scene).match(/vertex (\S+)/)[1],
  };
  console.log(`${name}: ${Object.entries(first).map(([kind, x]) => `${kind} ${Number(x)}`).join(', ')}`);
}
JS
seen=$(node run.mjs)
printf '%s\n' "$seen"
[ "$seen" = 'skinned: shown 3, OBJ 0, PLY 0, STL 3
morphed: shown 0.5, OBJ 0, PLY 0, STL 0' ] || { echo "CHANGED: three's exporters write other poses than recorded"; exit 1; }
