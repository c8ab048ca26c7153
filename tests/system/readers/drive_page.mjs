// A page of Debian's chromium that another program drives: a JSON line in, a JSON line out.
//
// Usage: WEFT_NODE_MODULES=DIR/node_modules node drive_page.mjs WIDTH HEIGHT
//   {"page": "goto", "args": [URL]}                  a method of playwright's page
//   {"keyboard": "press", "args": ["?"]}             of its keyboard
//   {"find": ["getByRole", "button", {"name": "Stop"}], "do": "click", "args": []}   of what is found, the first of several
//   A picture is answered by its hash.
//   {"axe": {"runOnly": ...}}                        violations that axe-core finds
//   {"troubles": true}                               errors on the console, and requests to other hosts, since the last time
import { createHash } from 'node:crypto'
import { readFileSync } from 'node:fs'
import { createRequire } from 'node:module'
import { join, resolve } from 'node:path'
import { createInterface } from 'node:readline'

const require = createRequire(join(resolve(process.env.WEFT_NODE_MODULES), 'x'))
const { chromium } = require('playwright-core')
const [width, height] = process.argv.slice(2).map(Number)
const browser = await chromium.launch({
  executablePath: '/usr/bin/chromium',
  args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
})
const context = await browser.newContext({ viewport: { width, height }, acceptDownloads: true })
const page = await context.newPage()
page.setDefaultTimeout(240_000)
let troubles = []
page.on('console', said => { if (said.type() === 'error') troubles.push(`${said.text()} (${said.location().url})`) })
page.on('pageerror', error => troubles.push(String(error)))
page.on('request', request => {
  const { protocol, host } = new URL(request.url())
  if (/^(http|ws)/.test(protocol) && host !== new URL(page.url()).host && page.url() !== 'about:blank') troubles.push(`a request to ${request.url()}`)
})

async function axe(options) {
  await page.evaluate(readFileSync(require.resolve('axe-core/axe.min.js'), 'utf8'))
  const { violations } = await page.evaluate(options => globalThis.axe.run(document, options), options)
  return violations.map(({ id, impact, help, nodes }) => ({ id, impact, help, nodes: nodes.map(node => `${node.html} ${node.failureSummary}`) }))
}

async function answer(order) {
  const args = order.args ?? []
  if (order.page) return page[order.page](...args)
  if (order.keyboard) return page.keyboard[order.keyboard](...args)
  if (order.find) {
    const [how, ...what] = order.find
    return page[how](...what).first()[order.do](...args)
  }
  if (order.axe) return axe(order.axe)
  if (order.troubles) return troubles.splice(0)
  throw new Error('no such order')
}

for await (const line of createInterface({ input: process.stdin })) {
  let reply
  try {
    const value = await answer(JSON.parse(line))
    let json
    try { json = JSON.stringify(value) } catch { json = undefined }
    const isPicture = Buffer.isBuffer(value)
    reply = `{"value": ${isPicture ? `"${createHash('sha256').update(value).digest('hex')}"` : json ?? 'null'}}`
  } catch (error) {
    reply = JSON.stringify({ error: String(error) })
  }
  process.stdout.write(reply + '\n')
}
await browser.close()
