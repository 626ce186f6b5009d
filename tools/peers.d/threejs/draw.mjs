// Serves a page to Chromium, has it draw the frames of a job, and prints the result.
//     node draw.mjs JOB PAGE
import fs from 'fs';
import http from 'http';
import path from 'path';
import puppeteer from 'puppeteer-core';

const here = path.dirname(new URL(import.meta.url).pathname);
const [, , job_file, page_file] = process.argv;
const job = JSON.parse(fs.readFileSync(job_file, 'utf8'));
const kinds = { '.js': 'text/javascript', '.html': 'text/html' };

const server = http.createServer((request, response) => {
  const url = request.url.split('?')[0];
  const own = path.join(here, url === '/' ? page_file : url);
  const file = url === '/particles' ? job.particles : own;
  try {
    const body = fs.readFileSync(file);
    response.setHeader('Content-Type', kinds[path.extname(file)] ?? 'application/octet-stream');
    response.end(body);
  } catch {
    response.statusCode = 404;
    response.end();
  }
});
await new Promise(done => server.listen(0, '127.0.0.1', done));

// Returns the greatest resident memory of a process and its children, bytes.
function memoryOf(root) {
  const parents = {}, sizes = {};
  for (const id of fs.readdirSync('/proc').filter(name => /^\d+$/.test(name))) {
    try {
      const status = fs.readFileSync(`/proc/${id}/status`, 'utf8');
      parents[id] = /^PPid:\s*(\d+)/m.exec(status)[1];
      sizes[id] = 1024 * Number(/^VmHWM:\s*(\d+)/m.exec(status)?.[1] ?? 0);
    } catch { /* It has ended. */ }
  }
  const isOf = id => id === root || (parents[id] in parents && isOf(parents[id]));
  return Object.keys(parents).filter(isOf).reduce((sum, id) => sum + sizes[id], 0);
}

const browser = await puppeteer.launch({
  executablePath: fs.readFileSync(path.join(here, 'chrome.txt'), 'utf8').trim(),
  headless: true,
  protocolTimeout: 3_600_000,
  args: ['--no-sandbox', '--disable-dev-shm-usage', '--use-gl=angle', '--use-angle=gl-egl',
    '--ignore-gpu-blocklist'],
});
try {
  const page = await browser.newPage();
  page.on('pageerror', error => console.error(error.message));
  await page.goto(`http://127.0.0.1:${server.address().port}/`);
  await page.waitForFunction('window.ready', { timeout: 30_000 });
  const { png, ...result } = await page.evaluate(job => window.draw(job), job);
  fs.writeFileSync(`${job.picture}.png`, Buffer.from(png.split(',')[1], 'base64'));
  const memory_bytes = memoryOf(String(browser.process().pid));
  const picture = `${job.picture}.png`;
  // Chromium rounds its clock to 0.1 ms.
  console.log(JSON.stringify({ ...result, clock_ns: 1e5, memory_bytes, picture }));
} finally {
  await browser.close();
  server.close();
}
