// SPDX-License-Identifier: Apache-2.0
// Builds the page from its data. What it did is written on <html> (data-blocks, data-rendered, data-errors) for tests.
import { el, redrawAll, refitAll } from './look.js';
import { cdf, fan, histogram, series, stacked } from './chart.js';
import { map } from './map.js';
import { intervals, roots, scatter } from './plane.js';
import { certificate, keyvalues, table, text } from './words.js';

const makers = { text, keyvalues, table, certificate, series, fan, stacked, histogram, cdf, map, scatter, roots, intervals };
const html = document.documentElement;
let errors = 0;
function failed(message) {
  html.dataset.errors = String(++errors);
  html.dataset.firstError ??= String(message);
}
addEventListener('error', (e) => failed(e.message));
html.dataset.errors = '0';

function store(theme) {
  try { return theme === undefined ? localStorage.getItem('loxo-theme') : localStorage.setItem('loxo-theme', theme); } catch { return null; }
}
const asked = /theme=(dark|light)/.exec(location.hash);
const system = matchMedia('(prefers-color-scheme: dark)');
const setTheme = (t) => { html.dataset.theme = t; };
setTheme(asked ? asked[1] : store() || (system.matches ? 'dark' : 'light'));

function build(page) {
  document.body.append(el('a', { class: 'sr skip', href: '#content' }, 'to the content'));
  const toggle = el('button', { type: 'button', class: 'theme', 'aria-label': 'dark or light', title: 'dark or light', onclick: () => {
    setTheme(html.dataset.theme === 'dark' ? 'light' : 'dark');
    store(html.dataset.theme);
    redrawAll();
  } }, '◐');
  document.body.append(el('header', { class: 'top' }, el('div', {}, el('h1', {}, page.title || 'Report'), page.subtitle ? el('p', { class: 'subtitle' }, page.subtitle) : null), toggle));

  const sections = page.sections || [];
  const main = el('main', { id: 'content' });
  if (sections.length > 2) {
    const items = el('ol');
    let group = null, inner = items;
    sections.forEach((s, i) => {
      if ((s.group || null) !== group) {
        group = s.group || null;
        inner = items;
        if (group) items.append(el('li', {}, el('span', {}, group), (inner = el('ol'))));
      }
      inner.append(el('li', {}, el('a', { href: `#s${i + 1}` }, s.title || `Section ${i + 1}`)));
    });
    document.body.append(el('nav', { 'aria-label': 'Contents' }, items));
    document.body.classList.add('with-nav');
  }
  document.body.append(main);

  let blocks = 0, rendered = 0;
  sections.forEach((s, i) => {
    const section = el('section', { id: `s${i + 1}`, class: 'part' }, s.title ? el('h2', {}, s.title) : null);
    main.append(section);
    for (const b of s.blocks || []) {
      blocks++;
      try {
        const made = makers[b.kind](b);
        section.append(made.root);
        if (made.start) made.start();
        rendered++;
      } catch (e) {
        failed(`${b.kind} "${b.title || ''}": ${e && e.message}`);
        console.error(e);
        section.append(el('p', { class: 'text verdict bad' }, `This ${b.kind} could not be drawn: ${e && e.message}`));
      }
    }
  });
  if (page.provenance && page.provenance.length) {
    document.body.append(el('footer', {}, el('h2', {}, 'Where this page comes from'), el('dl', {}, page.provenance.flatMap(([k, v]) => [el('dt', {}, k), el('dd', {}, v)])),
      el('p', { class: 'remark' }, 'Drawn with uPlot, d3-geo and topojson-client; coastlines from Natural Earth. Their licences are in the source of this page.')));
  }
  html.dataset.blocks = String(blocks);
  html.dataset.rendered = String(rendered);

  system.addEventListener('change', (e) => { if (!store() && !asked) { setTheme(e.matches ? 'dark' : 'light'); redrawAll(); } });
  // Paper is light and about 700 pixels wide; canvases do not follow by themselves.
  let before = null;
  addEventListener('beforeprint', () => {
    before = html.dataset.theme;
    setTheme('light');
    html.classList.add('printing');
    refitAll();
    redrawAll();
  });
  addEventListener('afterprint', () => {
    setTheme(before || 'light');
    html.classList.remove('printing');
    refitAll();
    redrawAll();
  });
}

try {
  build(JSON.parse(document.getElementById('page').textContent));
} catch (e) {
  failed(e && e.message);
  console.error(e);
}
// "#only=2": one section alone, for pictures of it.
const only = /only=(\d+)/.exec(location.hash);
if (only) for (const s of document.querySelectorAll('.part')) s.hidden = s.id !== `s${only[1]}`;
