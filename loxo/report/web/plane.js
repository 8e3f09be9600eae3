// SPDX-License-Identifier: Apache-2.0
// Drawings of the plane as SVG: scatter with ellipses, roots, intervals.
import { axisText, colourOf, cssVar, escapeHtml, el, figure, legendButton, niceTicks, numbers, onWidth, paint, redraws, tick, value } from './look.js';

function drawing(fig, kind, options, make) {
  const { root, plot, legend } = figure(fig, kind, { half: options.half, focus: false });
  const state = { hidden: new Set() };
  let width = 600;
  const draw = () => (plot.innerHTML = make(width, state));
  const start = () => {
    onWidth(plot, (w) => { width = w; draw(); });
    redraws.add(draw);
  };
  return { root, legend, state, draw, start };
}

// The frame of a plot; returns the scales and the SVG of axes and grid.
function frame(w, h, box, x, y, xAxis, yAxis) {
  const left = 62, right = 14, top = 10, bottom = 44;
  const sx = (v) => left + ((v - box[0]) / (box[1] - box[0])) * (w - left - right);
  const sy = (v) => h - bottom - ((v - box[2]) / (box[3] - box[2])) * (h - top - bottom);
  const xt = niceTicks(box[0], box[1], Math.max(3, w / 95)), yt = niceTicks(box[2], box[3], h / 60);
  let s = '';
  for (const v of xt.ticks) s += `<line class="grid" x1="${sx(v)}" x2="${sx(v)}" y1="${top}" y2="${h - bottom}"/><text x="${sx(v)}" y="${h - bottom + 17}" text-anchor="middle">${tick(v, xt.step)}</text>`;
  for (const v of yt.ticks) s += `<line class="grid" x1="${left}" x2="${w - right}" y1="${sy(v)}" y2="${sy(v)}"/><text x="${left - 7}" y="${sy(v) + 4}" text-anchor="end">${tick(v, yt.step)}</text>`;
  s += `<text x="${(left + w - right) / 2}" y="${h - 6}" text-anchor="middle">${escapeHtml(axisText(xAxis))}</text>`;
  s += `<text transform="translate(13 ${(top + h - bottom) / 2}) rotate(-90)" text-anchor="middle">${escapeHtml(axisText(yAxis))}</text>`;
  return { sx, sy, svg: s, left, right, top, bottom };
}
const open = (w, h, label) => `<svg width="${w}" height="${h}" viewBox="0 0 ${w} ${h}" role="img" aria-label="${escapeHtml(label)}">`;

function extent(values, pad = 0.06) {
  let lo = Infinity, hi = -Infinity;
  for (const v of values) if (v !== null && Number.isFinite(v)) { lo = Math.min(lo, v); hi = Math.max(hi, v); }
  if (!(hi >= lo)) return [-1, 1];
  if (hi === lo) { const d = Math.abs(lo) * 1e-3 || 1; return [lo - d, hi + d]; }
  return [lo - pad * (hi - lo), hi + pad * (hi - lo)];
}

export function scatter(fig) {
  const clouds = (fig.clouds || []).map((c) => ({ ...c, x: numbers(c.x), y: numbers(c.y), colour: colourOf(c.name || '', c.colour) }));
  const ellipses = (fig.ellipses || []).map((e) => ({ ...e, colour: colourOf(e.name || '') }));
  const reach = (e) => [Math.hypot(e.a * Math.cos(e.angle), e.b * Math.sin(e.angle)), Math.hypot(e.a * Math.sin(e.angle), e.b * Math.cos(e.angle))];
  const xs = clouds.flatMap((c) => c.x).concat(ellipses.flatMap((e) => [e.x - reach(e)[0], e.x + reach(e)[0]]));
  const ys = clouds.flatMap((c) => c.y).concat(ellipses.flatMap((e) => [e.y - reach(e)[1], e.y + reach(e)[1]]));
  const d = drawing(fig, 'scatter', { half: true }, (w, state) => {
    const h = fig.equal ? Math.round(Math.min(460, Math.max(260, w * 0.8))) : 300;
    let box = [...extent(xs), ...extent(ys)];
    const xa = fig.x || {}, ya = fig.y || {};
    if (fig.equal) {
      const per = Math.max((box[1] - box[0]) / (w - 76), (box[3] - box[2]) / (h - 54)), mx = (box[0] + box[1]) / 2, my = (box[2] + box[3]) / 2;
      box = [mx - (per * (w - 76)) / 2, mx + (per * (w - 76)) / 2, my - (per * (h - 54)) / 2, my + (per * (h - 54)) / 2];
    }
    box = [xa.lo ?? box[0], xa.hi ?? box[1], ya.lo ?? box[2], ya.hi ?? box[3]];
    const f = frame(w, h, box, xs, ys, xa, ya);
    let s = open(w, h, [fig.title, fig.caption].filter(Boolean).join('. ')) + f.svg;
    s += `<svg x="${f.left}" y="${f.top}" width="${w - f.left - f.right}" height="${h - f.top - f.bottom}" viewBox="${f.left} ${f.top} ${w - f.left - f.right} ${h - f.top - f.bottom}">`;
    for (const m of fig.marks || []) {
      s += m.horizontal ? `<line class="mark" x1="0" x2="${w}" y1="${f.sy(m.at)}" y2="${f.sy(m.at)}"/>` : `<line class="mark" y1="0" y2="${h}" x1="${f.sx(m.at)}" x2="${f.sx(m.at)}"/>`;
      if (m.label) s += m.horizontal ? `<text x="${w - f.right - 4}" y="${f.sy(m.at) - 4}" text-anchor="end">${escapeHtml(m.label)}</text>` : `<text x="${f.sx(m.at) + 4}" y="${f.top + 12}">${escapeHtml(m.label)}</text>`;
    }
    for (const c of clouds) {
      if (state.hidden.has(c.name)) continue;
      if (c.line) {
        let path = '', pen = false;
        c.x.forEach((x, i) => {
          if (x === null || c.y[i] === null) { pen = false; return; }
          path += `${pen ? 'L' : 'M'}${f.sx(x).toFixed(1)} ${f.sy(c.y[i]).toFixed(1)}`;
          pen = true;
        });
        s += `<path d="${path}" fill="none" stroke="${c.colour()}" stroke-width="1.75"/>`;
        continue;
      }
      const r = c.x.length > 300 ? 1.8 : c.x.length > 60 ? 2.5 : 4, opacity = c.x.length > 300 ? 0.55 : 0.85;
      s += `<g fill="${c.colour()}" fill-opacity="${opacity}">`;
      c.x.forEach((x, i) => { if (x !== null && c.y[i] !== null) s += `<circle cx="${f.sx(x).toFixed(1)}" cy="${f.sy(c.y[i]).toFixed(1)}" r="${r}"/>`; });
      s += '</g>';
    }
    const kx = (w - f.left - f.right) / (box[1] - box[0]), ky = (h - f.top - f.bottom) / (box[3] - box[2]);
    for (const e of ellipses) {
      if (state.hidden.has(e.name)) continue;
      s += `<ellipse cx="0" cy="0" rx="${e.a}" ry="${e.b}" transform="translate(${f.sx(e.x)} ${f.sy(e.y)}) scale(${kx} ${-ky}) rotate(${(e.angle * 180) / Math.PI})" fill="none" stroke="${e.colour()}" stroke-width="2" vector-effect="non-scaling-stroke"/>`;
    }
    return s + '</svg></svg>';
  });
  const names = new Map();
  for (const c of clouds) names.set(c.name, { colour: c.colour, style: c.line ? '' : 'points', text: c.name + (c.of ? ` (${c.x.length} of ${c.of})` : '') });
  for (const e of ellipses) if (!names.has(e.name)) names.set(e.name, { colour: e.colour, text: `${e.name} (${value(100 * e.confidence)} %)` });
  for (const [name, n] of names) d.legend.append(legendButton(n.text || '', [n], true, (on) => { state(d, name, on); }).button);
  return d;
}
function state(d, name, on) {
  if (on) d.state.hidden.delete(name); else d.state.hidden.add(name);
  d.draw();
}

function period(im) {
  const t = (2 * Math.PI) / Math.abs(im);
  return t >= 7200 ? `${value(t / 3600, 4)} h` : t >= 600 ? `${value(t / 60, 4)} min` : `${value(t, 4)} s`;
}

export function roots(fig) {
  const all = fig.roots || [];
  const d = drawing(fig, 'roots', { half: true, focus: false }, (w) => {
    const h = 340;
    const box = [...extent(all.map((r) => r.re).concat(0), 0.25), ...extent(all.map((r) => r.im).concat(0), 0.12)];
    if (all.every((r) => r.re === 0)) box[0] = box[1] = 0;
    const least = (box[3] - box[2]) * 0.05;
    if (box[1] - box[0] < least) { const m = (box[0] + box[1]) / 2; box[0] = m - least; box[1] = m + least; }
    const f = frame(w, h, box, [], [], { label: 'real part', unit: '1/s' }, { label: 'imaginary part', unit: '1/s' });
    let s = open(w, h, [fig.title, fig.caption].filter(Boolean).join('. ')) + f.svg;
    s += `<line class="mark" x1="${f.sx(0)}" x2="${f.sx(0)}" y1="${f.top}" y2="${h - f.bottom}"/><line class="mark" x1="${f.left}" x2="${w - f.right}" y1="${f.sy(0)}" y2="${f.sy(0)}"/>`;
    const taken = [];
    for (const r of all) {
      const x = f.sx(r.re), y = f.sy(r.im), c = paint(r.re > 1e-12 ? 7 : 0);
      s += `<path d="M${x - 5} ${y - 5}L${x + 5} ${y + 5}M${x - 5} ${y + 5}L${x + 5} ${y - 5}" stroke="${c}" stroke-width="2" fill="none"/>`;
      if (taken.some((t) => Math.abs(t[0] - x) < 140 && Math.abs(t[1] - y) < 13)) continue;
      taken.push([x, y]);
      const words = [r.name, Math.abs(r.im) > 0 ? period(r.im) : ''].filter(Boolean).join(', ');
      const right = x < w * 0.6;
      if (words) s += `<text class="halo" x="${x + (right ? 10 : -10)}" y="${y + 4}" text-anchor="${right ? 'start' : 'end'}">${escapeHtml(words)}</text>`;
    }
    return s + '</svg>';
  });
  return d;
}

export function intervals(fig) {
  const rows = fig.rows || [];
  const reach = (r) => (Number.isFinite(r.sigma) ? 2 * r.sigma : 0);
  const d = drawing(fig, 'intervals', { half: true, focus: false }, (w) => {
    const line = 30, h = rows.length * line + 60, bottom = 46, left = Math.min(24 + 6.6 * Math.max(4, ...rows.map((r) => (r.name || '').length)), w * 0.45), right = 16;
    const values = rows.flatMap((r) => [r.value - reach(r), r.value + reach(r)]).concat(fig.reference ?? []);
    const box = extent(values, 0.08), sx = (v) => left + ((v - box[0]) / (box[1] - box[0])) * (w - left - right);
    const t = niceTicks(box[0], box[1], Math.max(4, (w - left) / 70));
    let s = open(w, h, [fig.title, fig.caption].filter(Boolean).join('. '));
    for (const v of t.ticks) s += `<line class="grid" x1="${sx(v)}" x2="${sx(v)}" y1="4" y2="${h - bottom}"/><text x="${sx(v)}" y="${h - bottom + 17}" text-anchor="middle">${tick(v, t.step)}</text>`;
    s += `<text x="${(left + w - right) / 2}" y="${h - 6}" text-anchor="middle">${escapeHtml(axisText(fig.x))}</text>`;
    if (fig.reference !== undefined) s += `<line class="mark" x1="${sx(fig.reference)}" x2="${sx(fig.reference)}" y1="4" y2="${h - bottom}"/>` + (fig.reference_name ? `<text class="halo" x="${sx(fig.reference) + 4}" y="12">${escapeHtml(fig.reference_name)}</text>` : '');
    rows.forEach((r, i) => {
      const y = 8 + line * (i + 0.5), c = r.highlighted ? cssVar('--accent') : cssVar('--muted');
      s += `<text x="${left - 10}" y="${y + 4}" text-anchor="end" class="${r.highlighted ? 'strong' : ''}">${escapeHtml(r.name || '')}</text>`;
      if (r.value === undefined || r.value === null) { s += `<text x="${left + 8}" y="${y + 4}">not valid</text>`; return; }
      if (reach(r) > 0) {
        s += `<line x1="${sx(r.value - 2 * r.sigma)}" x2="${sx(r.value + 2 * r.sigma)}" y1="${y}" y2="${y}" stroke="${c}" stroke-width="1.25"/>`;
        s += `<line x1="${sx(r.value - r.sigma)}" x2="${sx(r.value + r.sigma)}" y1="${y}" y2="${y}" stroke="${c}" stroke-width="4" stroke-linecap="round" opacity=".55"/>`;
      }
      s += `<circle cx="${sx(r.value)}" cy="${y}" r="4.5" fill="${c}" stroke="${cssVar('--panel')}" stroke-width="1.5"><title>${escapeHtml(r.text || '')}</title></circle>`;
    });
    return s + '</svg>';
  });
  if (rows.some((r) => reach(r) > 0)) d.legend.append(el('span', { class: 'readout' }, 'thick: 1 σ, thin: 2 σ'));
  return d;
}
