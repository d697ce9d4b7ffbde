// Khronos' validator: errors and warnings of a glTF file, and a line for each message.
import { readFileSync } from 'node:fs';
import validator from 'gltf-validator';

const report = await validator.validateBytes(new Uint8Array(readFileSync(process.argv[2])));
console.log('errors', report.issues.numErrors);
console.log('warnings', report.issues.numWarnings);
for (const issue of report.issues.messages) {
  console.log(`${issue.severity}:${issue.code}:${issue.pointer}`.replaceAll(' ', '_'), 1);
}
