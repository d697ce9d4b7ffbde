// TrustNXT's c2pa-ts: whether the content credentials of a PNG, JPEG or MP4 hold, as it judges them: `valid` 1 or 0, and
// a line for each of its findings, with 1 where it is an error.
import { readFileSync } from 'node:fs';
import { BMFF, JPEG, PNG } from '@trustnxt/c2pa-ts/asset';
import { SuperBox } from '@trustnxt/c2pa-ts/jumbf';
import { ManifestStore, ValidationResult } from '@trustnxt/c2pa-ts/manifest';

const bytes = new Uint8Array(readFileSync(process.argv[2]));
const image = [PNG, JPEG].find((kind) => kind.canRead(bytes));
if (!image) {
  bytes.set(Buffer.from('mif1'), 8); // it reads box files of images alone; the brand is not part of the hash
}
const asset = new (image ?? BMFF)(bytes);
const store = asset.getManifestJUMBF();
console.log('found', store ? 1 : 0);
if (store) {
  let result;
  try {
    result = await ManifestStore.read(SuperBox.fromBuffer(store)).validate(asset);
  } catch (error) {
    console.error(error);
    result = ValidationResult.fromError(error);
  }
  console.log('valid', result.isValid ? 1 : 0);
  for (const entry of result.statusEntries) {
    console.log(entry.code, entry.success ? 0 : 1);
    if (!entry.success) {
      console.error(entry.code, entry.explanation);
    }
  }
}
