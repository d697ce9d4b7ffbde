// dxf-parser: unit, corners of the header, and corners of each polyline with its block and layer.
import { readFileSync } from 'node:fs';
import DxfParser from 'dxf-parser';

const drawing = new DxfParser().parseSync(readFileSync(process.argv[2], 'utf8'));
console.log('unit', drawing.header.$INSUNITS);
for (const name of ['$EXTMIN', '$EXTMAX']) console.log(name, drawing.header[name].x, drawing.header[name].y);
function say(block, entities) {
  for (const entity of entities) {
    if (entity.type !== 'POLYLINE') continue;
    const xs = entity.vertices.map((v) => v.x);
    const ys = entity.vertices.map((v) => v.y);
    console.log(`${block}:${entity.layer}`, Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys));
  }
}
for (const [name, block] of Object.entries(drawing.blocks)) say(name, block.entities);
say('drawing', drawing.entities);
