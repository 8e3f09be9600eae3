// SPDX-License-Identifier: Apache-2.0
// Colours, numbers and small DOM helpers.

const light = ['#0b62b8', '#c8500a', '#12805c', '#b0307a', '#6f52c4', '#8a6a00', '#0b8194', '#b8322a', '#5a6877', '#4c7a10'];
const dark = ['#62adff', '#ff9c5c', '#4fd09a', '#f283bb', '#b6a2ff', '#e2c04a', '#4ccfe0', '#ff8577', '#aab8c6', '#a8d968'];
const inkNames = /^(truth|true|reference|true track|printed)$/i;

export const isDark = () => document.documentElement.dataset.theme === 'dark';
export const cssVar = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// Equal names have equal colours everywhere on the page.
const byName = new Map();
export function colourOf(name, wanted) {
  let slot = wanted;
  if (slot === undefined) {
    if (inkNames.test(name)) return () => cssVar('--ink');
    if (!byName.has(name)) byName.set(name, byName.size);
    slot = byName.get(name);
  }
  return (alpha) => paint(slot, alpha);
}
export function paint(slot, alpha) {
  const c = (isDark() ? dark : light)[slot % light.length];
  return alpha === undefined ? c : withAlpha(c, alpha);
}
export function withAlpha(hex, alpha) {
  const n = parseInt(hex.slice(1), 16);
  return `rgba(${n >> 16},${(n >> 8) & 255},${n & 255},${alpha})`;
}

export function el(tag, attrs = {}, ...children) {
  const e = document.createElement(tag);
  for (const [k, v] of Object.entries(attrs)) {
    if (v === undefined || v === false) continue;
    if (k.startsWith('on')) e.addEventListener(k.slice(2), v);
    else e.setAttribute(k, v === true ? '' : v);
  }
  for (const c of children.flat()) if (c !== undefined && c !== null) e.append(c);
  return e;
}
export const escapeHtml = (s) => String(s).replace(/[&<>"]/g, (c) => ({ '&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;' })[c]);

// Arrays of the page: plain numbers, or float32 in base64 with an offset. NaN becomes null (a gap).
export function numbers(a) {
  if (!a) return [];
  if (Array.isArray(a)) return a;
  const raw = atob(a.d);
  const bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  const view = new DataView(bytes.buffer);
  const n = bytes.length >> 2;
  const out = new Array(n);
  const offset = a.o || 0;
  for (let i = 0; i < n; i++) {
    const v = view.getFloat32(4 * i, true);
    out[i] = Number.isNaN(v) ? null : v + offset;
  }
  return out;
}

const superscript = { '-': '⁻', 0: '⁰', 1: '¹', 2: '²', 3: '³', 4: '⁴', 5: '⁵', 6: '⁶', 7: '⁷', 8: '⁸', 9: '⁹' };
const raised = (n) => String(n).replace(/./g, (c) => superscript[c]);
const minus = (s) => s.replace(/^-/, '−');

// Decimals that write multiples of `step` (1, 2, 2.5 or 5 times a power of ten).
function decimalsOf(step) {
  const d = -Math.floor(Math.log10(step) + 1e-9), m = step * 10 ** d;
  return Math.max(0, Math.min(15, Math.abs(m - Math.round(m)) > 1e-6 ? d + 1 : d));
}

// A number beside others of the same kind; `step` is what should be told apart.
export function tick(v, step) {
  if (v === null || v === undefined) return '';
  if (v === 0) return '0';
  const size = Math.abs(v);
  if (size >= 1e6 || (size < 1e-3 && step < 1e-3)) {
    const exponent = Math.floor(Math.log10(size) + 1e-9);
    const digits = Math.max(0, Math.min(12, exponent + (step < 1 ? decimalsOf(step) : -Math.floor(Math.log10(step) + 1e-9))));
    if (digits <= 4) {
      const m = (v / 10 ** exponent).toFixed(digits).replace(/\.?0+$/, '');
      return `${m === '1' ? '' : m === '-1' ? '−' : minus(m) + '·'}10${raised(exponent)}`;
    }
    if (size >= 1e6) return minus(v.toFixed(Math.max(0, -Math.floor(Math.log10(step) + 1e-9))));
  }
  return minus(v.toFixed(decimalsOf(step)));
}
export function logTick(v) {
  if (v === null || v === undefined) return '';
  const e = Math.round(Math.log10(v));
  if (Math.abs(v / 10 ** e - 1) < 1e-6) return e >= -2 && e <= 4 ? String(+v.toPrecision(3)) : `10${raised(e)}`;
  return e >= -2 && e <= 4 ? String(+v.toPrecision(3)) : '';
}
export function value(v, digits = 5) {
  if (v === null || v === undefined || Number.isNaN(v)) return '–';
  if (v === 0) return '0';
  const size = Math.abs(v);
  if (size >= 1e7 || size < 1e-4) {
    const [m, e] = v.toExponential(digits - 1).split('e');
    return `${minus(m)}·10${raised(+e)}`;
  }
  return minus(String(+v.toPrecision(digits)));
}
export function clock(s, span) {
  if (s === null || s === undefined) return '';
  const sign = s < 0 ? '−' : '';
  const r = Math.round(Math.abs(s) * 1000) / 1000;
  const two = (n) => String(n).padStart(2, '0');
  const h = Math.floor(r / 3600), m = Math.floor(r / 60) % 60, sec = Math.floor(r % 60);
  const frac = span < 20 ? (r % 1).toFixed(span < 2 ? 2 : 1).slice(1) : '';
  return r >= 3600 || span >= 7200 ? `${sign}${h}:${two(m)}:${two(sec)}` : `${sign}${m}:${two(sec)}${frac}`;
}

export function axisText(axis) {
  const a = axis || {};
  return [a.label, a.unit ? `[${a.unit}]` : ''].filter(Boolean).join(' ');
}

// Ticks at 1, 2, 5 · 10^n.
export function niceTicks(lo, hi, count) {
  const raw = (hi - lo) / Math.max(1, count);
  const base = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((m) => m * base).find((s) => s >= raw * 0.999) || 10 * base;
  const out = [];
  for (let i = Math.ceil(lo / step - 1e-9); i * step <= hi + 1e-9 * step; i++) out.push(i * step);
  return { ticks: out, step };
}

// What redraws itself when the theme or the paper changes.
export const redraws = new Set();
const fits = new Set();
export function refitAll() {
  for (const f of fits) f();
}
export function redrawAll() {
  for (const f of redraws) f();
}

// A figure's frame: title, legend, plot, caption.
export function figure(fig, kind, options = {}) {
  const caption = fig.caption || '';
  const label = [fig.title, caption].filter(Boolean).join('. ');
  const plot = el('div', { class: `plot ${kind}`, role: 'group', tabindex: options.focus === false ? undefined : '0', 'aria-label': label || kind });
  const legend = el('div', { class: 'legend' });
  const root = el('figure', { class: `block ${options.half ? 'half' : ''}` }, fig.title ? el('h3', {}, fig.title) : null, legend, plot,
    caption ? el('figcaption', {}, caption) : null);
  return { root, plot, legend };
}

// A switch of the legend; calls back with its new state.
export function legendButton(text, swatches, on, change) {
  const values = el('span', { class: 'value' });
  const b = el('button', { type: 'button', class: 'key', 'aria-pressed': String(on), title: 'show or hide' },
    swatches.map((s) => {
      const i = el('i', { class: `swatch ${s.style || ''}` });
      const dress = () => (i.style.color = s.colour());
      dress();
      redraws.add(dress);
      return i;
    }), el('span', {}, text), values);
  b.addEventListener('click', () => {
    const now = b.getAttribute('aria-pressed') !== 'true';
    b.setAttribute('aria-pressed', String(now));
    change(now);
  });
  return { button: b, values };
}

// Runs `draw(width)` now and when the width of `host` changes.
export function onWidth(host, draw) {
  let last = 0;
  const run = () => {
    const w = Math.round(host.clientWidth);
    if (w > 0 && w !== last) {
      last = w;
      draw(w);
    }
  };
  new ResizeObserver(run).observe(host);
  fits.add(run);
  run();
}

// Cursors that walk together: charts tell, maps listen.
export const cursors = new EventTarget();
export function tellCursor(sync, x) {
  cursors.dispatchEvent(new CustomEvent('at', { detail: { sync, x } }));
}
