// Khronos' validator: errors, warnings and counts of a glTF file, and a line for each message.
import { readFileSync } from 'node:fs';
import validator from 'gltf-validator';

const report = await validator.validateBytes(new Uint8Array(readFileSync(process.argv[2])));
console.log('errors', report.issues.numErrors);
console.log('warnings', report.issues.numWarnings);
const { totalVertexCount, totalTriangleCount, animationCount, maxInfluences } = report.info;
console.log('counts', totalVertexCount, totalTriangleCount, animationCount, maxInfluences);
for (const issue of report.issues.messages) {
  console.log(`${issue.severity}:${issue.code}:${issue.pointer}`.replaceAll(' ', '_'), 1);
}
