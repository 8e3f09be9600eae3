// SPDX-License-Identifier: Apache-2.0
// Bundles the front end and writes it as a C++ source: node build.mjs OUT.cpp
import { readFileSync, writeFileSync } from 'node:fs';
import { build, transform } from 'esbuild';
import { geoArea } from 'd3-geo';
import { feature } from 'topojson-client';

const out = process.argv[2];
const bundled = await build({
  entryPoints: ['main.js'], bundle: true, minify: true, write: false, format: 'iife', target: 'es2020',
  legalComments: 'none', charset: 'utf8', logLevel: 'warning',
});
const css = readFileSync('node_modules/uplot/dist/uPlot.min.css', 'utf8') + readFileSync('style.css', 'utf8');
const style = (await transform(css, { loader: 'css', minify: true, legalComments: 'none' })).code;

// Their licences ask that the notice goes with every copy. Addresses are left out: a page names no host.
const notices = ['uplot', 'd3-geo', 'd3-array', 'internmap', 'topojson-client', 'world-atlas'].map((name) => {
  const text = readFileSync(`node_modules/${name}/LICENSE`, 'utf8').trim().replace(/https?:\/\/\S+/g, '').replaceAll('*/', '');
  return `${name}\n${text}`;
});
const script = `/*\nThis page contains:\n\n${notices.join('\n\n')}\n\nCoastlines: Natural Earth (public domain).\n*/\n${bundled.outputFiles[0].text}`;

// The finer coast: polygons of rings (land first, then its lakes) in hundredths of a degree, differences, zigzag, seven bits a byte.
const atlas = JSON.parse(readFileSync('node_modules/world-atlas/land-50m.json', 'utf8'));
const coast = [];
function put(v) {
  let u = v < 0 ? -2 * v - 1 : 2 * v;
  for (; u > 127; u = Math.floor(u / 128)) coast.push((u % 128) + 128);
  coast.push(u);
}
for (const f of feature(atlas, atlas.objects.land).features) for (const polygon of f.geometry.coordinates) {
  // A ring that rounding turned inside out would be the whole Earth but an island.
  const rings = polygon.map((ring) => ring.map((p) => [Math.round(100 * p[0]), Math.round(100 * p[1])]).filter((p, i, all) => i === 0 || p[0] !== all[i - 1][0] || p[1] !== all[i - 1][1]))
    .filter((ring, i) => {
      if (ring.length < 4) return false;
      const area = geoArea({ type: 'Polygon', coordinates: [ring.map((p) => [p[0] / 100, p[1] / 100])] });
      return i === 0 ? area > 1e-8 && area < 6 : area > 6 && 4 * Math.PI - area > 1e-8;
    });
  if (!rings.length) continue;
  put(rings.length);
  for (const ring of rings) {
    put(ring.length);
    let before = [0, 0];
    for (const p of ring) {
      put(p[0] - before[0]);
      put(p[1] - before[1]);
      before = p;
    }
  }
}

function literal(name, text) {
  const bytes = Buffer.isBuffer(text) ? text : Buffer.from(text, 'utf8');
  const lines = [];
  for (let i = 0; i < bytes.length; i += 4000) {
    let line = '';
    for (const b of bytes.subarray(i, i + 4000)) {
      if (b === 0x0a) line += '\\n';
      else if (b === 0x22 || b === 0x5c) line += '\\' + String.fromCharCode(b);
      else if (b === 0x3f) line += '\\?'; // no trigraphs
      else if (b < 0x20 || b > 0x7e) line += '\\' + b.toString(8).padStart(3, '0');
      else line += String.fromCharCode(b);
    }
    lines.push(`    "${line}"`);
  }
  return `const char* const ${name} =\n${lines.join('\n')};\nconst std::size_t ${name}Size = ${bytes.length};\n`;
}

writeFileSync(out, `// Generated from loxo/report/web by build.mjs. Do not edit.
#include "loxo/report/web_bundle.hpp"

namespace loxo::report {

${literal('kWebStyle', style)}
${literal('kWebScript', script)}
${literal('kWebCoast', Buffer.from(coast))}
}  // namespace loxo::report
`);
