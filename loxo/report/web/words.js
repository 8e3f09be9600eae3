// SPDX-License-Identifier: Apache-2.0
// Text, tables, certificates.
import { el } from './look.js';

// `code` and **strong** inside a line.
function inline(text) {
  return text.split(/(`[^`]*`|\*\*[^*]+\*\*)/).filter(Boolean).map((part) => {
    if (part.length > 2 && part[0] === '`') return el('code', {}, part.slice(1, -1));
    if (part.length > 4 && part.startsWith('**')) return el('strong', {}, part.slice(2, -2));
    return part;
  });
}

const verdictWords = { good: 'passed', bad: 'failed', note: 'note' };

export function text(b) {
  const root = el('div', { class: `text ${b.verdict ? 'verdict ' + b.verdict : ''}`, role: b.verdict ? 'note' : undefined });
  if (b.verdict) root.append(el('span', { class: 'sr' }, verdictWords[b.verdict] + ': '));
  for (const paragraph of (b.text || '').split(/\n\s*\n/)) {
    const lines = paragraph.split('\n');
    let words = [], list = null;
    const flush = () => { if (words.length) root.append(el('p', {}, inline(words.join(' ')))); words = []; };
    for (const l of lines) {
      if (l.startsWith('- ')) {
        flush();
        if (!list) root.append((list = el('ul')));
        list.append(el('li', {}, inline(l.slice(2))));
      } else if (l.trim()) { list = null; words.push(l); }
    }
    flush();
  }
  return { root };
}

export function keyvalues(b) {
  return { root: el('div', { class: 'block keyvalues' }, b.title ? el('h3', {}, b.title) : null,
    el('dl', {}, (b.rows || []).flatMap(([k, v]) => [el('dt', {}, k), el('dd', {}, inline(v))]))) };
}

export function table(b) {
  const columns = b.columns || [], rows = b.rows || [];
  const isNumber = columns.map((_, i) => rows.some((r) => r.cells[i] && typeof r.cells[i] === 'object' && 'value' in r.cells[i]));
  const body = el('tbody');
  const fill = (order) => {
    body.replaceChildren();
    for (const r of order) {
      body.append(el('tr', { class: r.highlighted ? 'chosen' : undefined }, columns.map((_, i) => {
        const c = r.cells[i] ?? '';
        const cell = typeof c === 'string' ? { text: c } : c;
        return el(i === 0 ? 'th' : 'td', { scope: i === 0 ? 'row' : undefined, class: [isNumber[i] ? 'number' : '', cell.verdict || ''].join(' ').trim() || undefined },
          cell.verdict && isNumber[i] === false ? el('span', { class: `chip ${cell.verdict}` }, cell.text || '') : inline(cell.text || ''));
      })));
      if (r.note) body.append(el('tr', { class: r.highlighted ? 'rownote chosen' : 'rownote' }, el('td', { colspan: columns.length }, inline(r.note))));
    }
  };
  fill(rows);
  const heads = columns.map((c, i) => {
    const th = el('th', { scope: 'col', class: isNumber[i] ? 'number' : undefined, 'aria-sort': 'none' });
    const button = el('button', { type: 'button', title: 'sort' }, c.title || '', c.unit ? el('span', { class: 'unit' }, c.unit) : null);
    let direction = 0;
    button.addEventListener('click', () => {
      direction = direction === 1 ? -1 : direction === -1 ? 0 : 1;
      for (const h of heads) h.setAttribute('aria-sort', 'none');
      if (direction) th.setAttribute('aria-sort', direction > 0 ? 'ascending' : 'descending');
      const keyOf = (r) => { const c = r.cells[i] ?? ''; return typeof c === 'object' && 'value' in c ? c.value ?? Infinity : typeof c === 'object' ? c.text || '' : c; };
      fill(direction ? [...rows].sort((p, q) => { const u = keyOf(p), v = keyOf(q); return direction * (typeof u === 'number' && typeof v === 'number' ? u - v : String(u).localeCompare(String(v))); }) : rows);
    });
    th.append(rows.length > 2 ? button : el('span', {}, ...button.childNodes));
    return th;
  });
  return { root: el('figure', { class: 'block table' }, b.title ? el('h3', {}, b.title) : null,
    el('div', { class: 'scroll', tabindex: '0', role: 'group', 'aria-label': b.title || b.caption || 'table' }, el('table', {}, el('thead', {}, el('tr', {}, heads)), body)),
    b.left_out ? el('p', { class: 'remark' }, `The first ${rows.length} of ${rows.length + b.left_out} rows.`) : null,
    b.caption ? el('figcaption', {}, inline(b.caption)) : null) };
}

export function certificate(b) {
  const constants = b.constants || [], correlation = b.correlation || [];
  const names = constants.map((c) => c.name);
  return { root: el('section', { class: `block certificate ${b.verdict || ''}`, 'aria-label': b.title || 'certificate' },
    el('header', {}, el('h3', {}, b.title || 'Certificate'), b.verdict_text ? el('span', { class: `chip ${b.verdict || 'note'}` }, b.verdict_text) : null),
    el('div', { class: 'constants' }, constants.map((c) => el('div', {}, el('span', { class: 'name' }, c.name), el('span', { class: 'figure' }, c.text, c.unit ? el('small', {}, ' ' + c.unit) : null)))),
    correlation.length > 1 ? el('div', { class: 'scroll' }, el('table', { class: 'correlation' }, el('caption', {}, 'Correlation'),
      el('thead', {}, el('tr', {}, el('th'), names.map((n) => el('th', { scope: 'col' }, n)))),
      el('tbody', {}, correlation.map((row, i) => el('tr', {}, el('th', { scope: 'row' }, names[i] || ''), row.map((v) => el('td', { style: v === null ? undefined : `--strength:${Math.min(1, Math.abs(v))}`, class: v < 0 ? 'less' : 'more' }, v === null ? '–' : v.toFixed(3).replace('-', '−')))))))) : null,
    el('dl', {}, (b.rows || []).flatMap(([k, v]) => [el('dt', {}, k), el('dd', {}, inline(v))]))) };
}
