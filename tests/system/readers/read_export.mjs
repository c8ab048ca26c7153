// What other programs read in an exported file.
//
// Usage: WEFT_NODE_MODULES=DIR/node_modules node read_export.mjs READER FILE [OUT]
//
//   validate  npm's gltf-validator: prints {"errors", "warnings", "messages"}
//   ply       three.js' PLYLoader, with the attributes that it is told of
//   gltf      three.js' GLTFLoader with MeshoptDecoder: the animation played at its keys
//   usda      three.js' parser of USD: every time sample of every attribute
//   tinyusdz  TinyUSDZ: the mesh at the first time
//
// All but the first write arrays of numbers into OUT, <name>.<type>, and print {name: {"type", "shape"}} with
// types of NumPy.
import { readFileSync, writeFileSync } from 'node:fs'
import { createRequire } from 'node:module'
import { join, resolve } from 'node:path'
import { pathToFileURL } from 'node:url'

const modules = resolve(process.env.WEFT_NODE_MODULES)
const at = path => import(pathToFileURL(join(modules, path)).href)
const bytesOf = path => new Uint8Array(readFileSync(path))

class Arrays {
  constructor(folder) {
    this.folder = folder
    this.described = {}
  }

  add(name, values, shape) {
    const type = values instanceof Float64Array ? 'f8' : values instanceof Float32Array ? 'f4' : 'i4'
    writeFileSync(join(this.folder, `${name}.${type}`), new Uint8Array(values.buffer, values.byteOffset, values.byteLength))
    this.described[name] = { type, shape }
  }
}

async function validate(file) {
  const validator = createRequire(join(modules, 'x'))('gltf-validator')
  const { issues } = await validator.validateBytes(bytesOf(file), { maxIssues: 20 })
  const serious = issues.messages.filter(message => message.severity <= 1)
  return { errors: issues.numErrors, warnings: issues.numWarnings, infos: issues.numInfos, messages: serious }
}

// A picture of a glTF becomes a texture in browsers alone; here its bytes are kept.
function keepPictures(arrays) {
  globalThis.self = globalThis
  globalThis.createImageBitmap = async blob => {
    arrays.add('picture', Int32Array.from(new Uint8Array(await blob.arrayBuffer())), [blob.size])
    return { width: 1, height: 1, close() {} }
  }
}

async function readGltf(file, arrays) {
  const { AnimationMixer } = await at('three/build/three.module.js')
  const { GLTFLoader } = await at('three/examples/jsm/loaders/GLTFLoader.js')
  const { MeshoptDecoder } = await at('meshoptimizer/meshopt_decoder.mjs')
  keepPictures(arrays)
  const loader = new GLTFLoader()
  loader.setMeshoptDecoder(MeshoptDecoder)
  const gltf = await loader.parseAsync(bytesOf(file).buffer, '')
  let mesh = null
  gltf.scene.traverse(thing => { if (thing.isMesh) mesh = thing })
  const { geometry } = mesh
  const vertices = geometry.attributes.position.count
  for (const [name, attribute] of Object.entries(geometry.attributes)) {
    const values = new Float32Array(attribute.count * attribute.itemSize)
    for (let i = 0; i < attribute.count; ++i)
      for (let k = 0; k < attribute.itemSize; ++k) values[i * attribute.itemSize + k] = attribute.getComponent(i, k)
    arrays.add(name, values, [attribute.count, attribute.itemSize])
  }
  arrays.add('faces', Int32Array.from(geometry.index.array), [geometry.index.count / 3, 3])
  const clip = gltf.animations[0]
  const times = clip ? clip.tracks[0].times : [0]
  arrays.add('times', Float64Array.from(times), [times.length])
  const mixer = new AnimationMixer(gltf.scene)
  if (clip) mixer.clipAction(clip).play()
  for (const [kind, name] of [['position', 'positions'], ['normal', 'normals']]) {
    const base = geometry.attributes[kind]
    if (!base) continue
    const targets = geometry.morphAttributes[kind] ?? []
    if (kind === 'normal' && targets.length === 0) continue
    const played = new Float64Array(times.length * vertices * 3)
    times.forEach((time, frame) => {
      if (clip) mixer.setTime(Math.min(time, clip.duration - 1e-9))
      const weights = mesh.morphTargetInfluences ?? []
      for (let v = 0; v < vertices; ++v) {
        for (let k = 0; k < 3; ++k) {
          let value = base.getComponent(v, k)
          for (let t = 0; t < weights.length; ++t) if (weights[t] !== 0) value += weights[t] * targets[t].getComponent(v, k)
          played[(frame * vertices + v) * 3 + k] = value
        }
      }
    })
    arrays.add(name, played, [times.length, vertices, 3])
  }
  const { map, normalMap } = mesh.material
  return { has_texture: !!map, has_normal_map: !!normalMap }
}

async function readPly(file, arrays) {
  const { PLYLoader } = await at('three/examples/jsm/loaders/PLYLoader.js')
  const loader = new PLYLoader()
  loader.setCustomPropertyNameMapping({
    velocity: ['vx', 'vy', 'vz'], state: ['state'], sigma: ['sigma'], views: ['views'], coverage: ['coverage'],
  })
  const geometry = loader.parse(bytesOf(file).buffer)
  for (const [name, { array, count, itemSize }] of Object.entries(geometry.attributes))
    arrays.add(name, Float64Array.from(array), [count, itemSize])
  return {}
}

async function readUsda(file, arrays) {
  const { USDAParser } = await at('three/examples/jsm/loaders/usd/USDAParser.js')
  const { specsByPath } = new USDAParser().parseData(readFileSync(file, 'utf8'))
  for (const [path, { fields }] of Object.entries(specsByPath)) {
    const name = path.split('.').pop().replace(':', '_')
    const { times, values } = fields.timeSamples ?? { times: [], values: [] }
    if (times.length > 0) {
      arrays.add(name, Float64Array.from(values.flatMap(sample => Array.from(sample))), [times.length, values[0].length])
      arrays.add(`${name}_times`, Float64Array.from(times), [times.length])
    } else if (Array.isArray(fields.default) && typeof fields.default[0] === 'number') {
      arrays.add(name, Float64Array.from(fields.default), [fields.default.length])
    }
  }
  return {}
}

async function readTinyUsdz(file, arrays) {
  // It is built for browsers alone.
  globalThis.window = globalThis
  process.type = 'renderer'
  const { default: load } = await at('tinyusdz/tinyusdz.js')
  const wasm = bytesOf(join(modules, 'tinyusdz/tinyusdz.wasm'))
  const native = await load({
    instantiateWasm(imports, ready) {
      WebAssembly.instantiate(wasm, imports).then(({ instance }) => ready(instance))
      return {}
    },
  })
  const usd = new native.TinyUSDZLoaderNative()
  if (!usd.loadFromBinary(bytesOf(file), file)) throw new Error(`${file}: ${usd.error()}`)
  const mesh = usd.getMesh(0)
  arrays.add('points', Float64Array.from(mesh.points), [mesh.points.length / 3, 3])
  arrays.add('faces', Int32Array.from(mesh.faceVertexIndices), [mesh.faceVertexIndices.length / 3, 3])
  return { meshes: usd.numMeshes() }
}

const [reader, file, out] = process.argv.slice(2)
if (reader === 'validate') {
  console.log(JSON.stringify(await validate(file)))
} else {
  const arrays = new Arrays(out)
  const told = await { ply: readPly, gltf: readGltf, usda: readUsda, tinyusdz: readTinyUsdz }[reader](file, arrays)
  console.log(JSON.stringify({ ...told, arrays: arrays.described }))
}
