// How soon Debian's chromium shows a page: milliseconds until it is loaded and painted, the best of three.
//
// Usage: WEFT_NODE_MODULES=DIR/node_modules node open_page.mjs FILE
import { createRequire } from 'node:module'
import { join, resolve } from 'node:path'

const { chromium } = createRequire(join(resolve(process.env.WEFT_NODE_MODULES), 'x'))('playwright-core')
const browser = await chromium.launch({
  executablePath: '/usr/bin/chromium',
  args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
})
let best = Infinity
for (let i = 0; i < 3; ++i) {
  const page = await browser.newPage({ viewport: { width: 1200, height: 900 } })
  const begin = performance.now()
  await page.goto('file://' + process.argv[2], { waitUntil: 'load' })
  await page.evaluate(() => new Promise(painted => requestAnimationFrame(() => requestAnimationFrame(painted))))
  best = Math.min(best, performance.now() - begin)
  await page.close()
}
await browser.close()
console.log(Math.round(best))
