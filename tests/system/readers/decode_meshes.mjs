// Decodes meshes as the console's 3D view does (services/server/console/quantized_mesh.h) and prints {"ms": of one}.
//
// Usage: WEFT_NODE_MODULES=DIR/node_modules node decode_meshes.mjs FILE...
import { readFileSync } from 'node:fs'
import { join, resolve } from 'node:path'
import { pathToFileURL } from 'node:url'

const HEAD_BYTES = 88, ROUNDS = 5
const three = join(resolve(process.env.WEFT_NODE_MODULES), 'three')
const { MeshoptDecoder } = await import(pathToFileURL(join(three, 'examples/jsm/libs/meshopt_decoder.module.js')))
await MeshoptDecoder.ready
const meshes = process.argv.slice(2).map(path => readFileSync(path))
let decoded = 0, began = 0
for (let round = 0; round < ROUNDS; ++round) {
  if (round === 1) [decoded, began] = [0, performance.now()] // the first one compiles
  for (const mesh of meshes) {
    const vertices = mesh.readUInt32LE(8), bytes = mesh.readUInt32LE(16)
    const words = new Uint8Array(8 * vertices)
    MeshoptDecoder.decodeVertexBuffer(words, vertices, 8, mesh.subarray(HEAD_BYTES, HEAD_BYTES + bytes))
    ++decoded
  }
}
console.log(JSON.stringify({ ms: (performance.now() - began) / decoded }))
