// SPDX-License-Identifier: Apache-2.0
// Bundles the front end and writes it as a C++ source: node build.mjs OUT.cpp
import { readFileSync, writeFileSync } from 'node:fs';
import { build, transform } from 'esbuild';

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

function literal(name, text) {
  const bytes = Buffer.from(text, 'utf8');
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
}  // namespace loxo::report
`);
