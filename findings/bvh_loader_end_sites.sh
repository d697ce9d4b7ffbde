#!/usr/bin/env bash
# npm bvh-loader 0.0.9 ("Stable version", the npybvh port of matrix-engine): frame_pose() of a two-joint BVH.
# Guess: it gives each joint's own angles, in degrees, as the file has them; or all in radians.
# Seen: positions are right to 1e-4. The angles are world angles, not the joint's own, as turns about the fixed
#   axes X, Y, Z whatever the order in the file: a hip of X30 Y40 Z50 is given as 48.42 -1.44 60.49. And the
#   unit changes within one array: joints are in degrees, end sites in radians (the knee's 42.68 -67.05 68.12
#   is repeated at its end site as 0.745 -1.170 1.189).
# For users of Atelier: take positions from it, not angles; a rig driven by these angles turns each joint by
#   its parents' turns once more.
set -euo pipefail
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
npm install --prefer-offline --silent --no-audit --no-fund --ignore-scripts bvh-loader@0.0.9 >/dev/null 2>&1 ||
  { echo "bvh-loader 0.0.9 cannot be had"; exit 77; }
cp node_modules/bvh-loader/module/bvh-loader.js loader.mjs   # the package says nothing of its modules' kind
cat > run.mjs <<'JS'
// Valid by the format's description: turns are products in the order of CHANNELS. three 0.187.0 and Babylon
// 9.28.0 put the knee at (-4.868 5.105 10.478) and the end site at (-14.017 2.052 13.121) as well.
import { MEBvh } from './loader.mjs';
console.warn = () => {};
const bvh = new MEBvh();
const joint = 'CHANNELS 3 Xrotation Yrotation Zrotation\n';
bvh._parse_hierarchy('HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\n' +
  'CHANNELS 6 Xposition Yposition Zposition Xrotation Yrotation Zrotation\nJOINT Knee\n{\nOFFSET 0 10 0\n' + joint +
  'End Site\n{\nOFFSET 0 10 0\n}\n}\n}\n');
bvh.parse_motion('Frames: 1\nFrame Time: 0.01\n1 2 3 30 40 50 20 -35 60\n');
const [positions, angles] = bvh.frame_pose(0);
const shown = (rows) => rows.map((row) => Array.from(row, (x) => x.toFixed(3)).join(' ')).join(', ');
const seen = [shown(positions[0].length === 3 ? positions : positions[0]), shown((angles ?? positions[1]))];
console.log(`${bvh.joint_names().join(', ')}\npositions ${seen[0]}\nangles ${seen[1]}`);
const recorded = ['1.000 2.000 3.000, -4.868 5.105 10.478, -14.017 2.052 13.121',
  '48.423 -1.444 60.491, 42.675 -67.049 68.123, 0.745 -1.170 1.189'];
if (seen.join() !== recorded.join()) { console.log(`changed: recorded was ${recorded.join(' and ')}`); process.exit(1); }
JS
node run.mjs
