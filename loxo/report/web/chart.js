// SPDX-License-Identifier: Apache-2.0
// Everything drawn over one x: series, fans, stacked areas, histograms and cumulative distributions.
import uPlot from 'uplot';
import { axisText, clock, colourOf, cssVar, el, figure, legendButton, logTick, numbers, onWidth, redraws, tellCursor, tick, value } from './look.js';

const font = '12px ui-sans-serif, system-ui, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif';
const timeSteps = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 10800, 21600, 43200, 86400, 172800];
const groups = new Map(); // sync name -> charts

const isClock = (axis) => axis && axis.unit === 's' && (!axis.label || /time/i.test(axis.label));

function rangeOf(axis, data) {
  return (u, lo, hi) => {
    const fixedLo = axis.lo, fixedHi = axis.hi;
    if (lo === null || lo === undefined || hi === null || hi === undefined) { lo = axis.log ? 1 : 0; hi = axis.log ? 10 : 1; }
    if (axis.log) {
      let [a, b] = uPlot.rangeLog(lo, hi, 10, true);
      if (hi / lo < 20) [a, b] = [lo / 1.3, hi * 1.3];
      return [fixedLo ?? a, fixedHi ?? b];
    }
    let [a, b] = lo === hi ? [lo - (Math.abs(lo) * 1e-3 || 0.5), hi + (Math.abs(hi) * 1e-3 || 0.5)] : uPlot.rangeNum(lo, hi, 0.08, false);
    return [fixedLo ?? a, fixedHi ?? b];
  };
}

function axisSize(u, values, index, cycle) {
  const axis = u.axes[index];
  if (cycle > 1) return axis._size;
  let size = axis.ticks.size + axis.gap;
  const longest = (values ?? []).reduce((acc, v) => (v.length > acc.length ? v : acc), '');
  if (longest) {
    u.ctx.font = axis.font[0];
    size += u.ctx.measureText(longest).width / devicePixelRatio;
  }
  return Math.ceil(size + 4);
}

// A line that is broken at every null, also where the gap is narrower than a pixel (an angle that jumps by a turn);
// holes made by joining (undefined) are passed over.
function brokenLine(u, s, from, to) {
  const x = u.data[0], y = u.data[s], stroke = new Path2D(), scale = u.series[s].scale;
  let pen = false;
  for (let i = from; i <= to; i++) {
    if (y[i] === undefined) continue;
    if (y[i] === null) { pen = false; continue; }
    const px = u.valToPos(x[i], 'x', true), py = u.valToPos(y[i], scale, true);
    if (pen) stroke.lineTo(px, py); else stroke.moveTo(px, py);
    pen = true;
  }
  return { stroke, fill: null, clip: null, band: null, gaps: null, flags: 1 };
}

// Rows: { name, colour, style, x, y, lo, hi, key, hidden, fill }; all x ascending.
function build(fig, rows, options = {}) {
  const { root, plot, legend } = figure(fig, 'chart', { half: options.half ?? fig.half });
  const xAxis = fig.x || {}, yAxis = fig.y || {};
  const logX = xAxis.log && rows.some((r) => r.x.some((v) => v > 0));
  const logY = yAxis.log && rows.some((r) => r.y.some((v) => v > 0));
  const clocked = isClock(xAxis) && !logX;
  const positive = (a) => (logY ? a.map((v) => (v !== null && v !== undefined && v > 0 ? v : null)) : a);

  const tables = [], bands = [], series = [{}];
  for (const r of rows) {
    let keep = r.x.map((_, i) => i).filter((i) => r.x[i] !== null && (!logX || r.x[i] > 0));
    if (keep.some((i, k) => k > 0 && r.x[i] < r.x[keep[k - 1]])) keep.sort((a, b) => r.x[a] - r.x[b]);
    const pick = (a) => keep.map((i) => (a[i] === undefined ? null : a[i]));
    const table = [pick(r.x), positive(pick(r.y))];
    r.at = series.length;
    const points = r.style === 'points' || r.style === 'linepoints';
    series.push({
      label: r.name, scale: 'y', show: !r.hidden, stroke: () => r.colour(), width: points && r.style === 'points' ? 0 : (r.width ?? 1.75),
      dash: r.style === 'dashed' ? [7, 5] : undefined, fill: r.fill ? () => r.colour(r.fill) : undefined,
      paths: r.style === 'points' ? () => null : r.style === 'steps' ? uPlot.paths.stepped({ align: r.align ?? 1 }) : r.fill || options.bands ? undefined : brokenLine,
      points: { show: points || table[0].length < 2, size: table[0].length > 500 ? 3 : r.style === 'points' ? 5 : 6, fill: () => r.colour(), stroke: () => r.colour() },
    });
    if (r.hi) {
      table.push(positive(pick(r.hi)), positive(pick(r.lo)));
      const edge = { scale: 'y', show: !r.hidden, stroke: 'transparent', width: 0, points: { show: false } };
      bands.push({ series: [series.length, series.length + 1], fill: () => r.colour(0.16), dir: -1 });
      series.push({ ...edge }, { ...edge });
    }
    tables.push(table);
  }
  const data = tables.length ? uPlot.join(tables) : [[], []];
  // Where curves have x of their own, the holes that joining makes beside a gap belong to the gap.
  for (const column of data.slice(1)) {
    let before;
    for (let i = 0; i < column.length; i++) {
      if (column[i] !== undefined) { before = column[i]; continue; }
      let j = i;
      while (j < column.length && column[j] === undefined) j++;
      const gap = before === null || (j < column.length && column[j] === null && before !== undefined);
      for (; i < j; i++) if (gap) column[i] = null;
      i--;
    }
  }
  if (!tables.length) series.push({});
  for (const b of options.bands ?? []) bands.push(b);

  const span = () => (u && u.scales.x.max !== null ? u.scales.x.max - u.scales.x.min : 1);
  let u = null;
  const grid = { stroke: () => cssVar('--grid'), width: 1 };
  const axis = (a, log, time) => ({
    stroke: () => cssVar('--muted'), font, labelFont: font, grid, ticks: { stroke: () => cssVar('--grid'), width: 1, size: 5 }, gap: 4,
    label: axisText(time ? { label: a.label || 'time', unit: 'h:min:s' } : a) || undefined, labelSize: 20, labelGap: 2,
    ...(time ? { incrs: timeSteps, space: 70 } : {}),
    values: (_, splits, i, space, step) => splits.map((v) => (v === null ? '' : time ? clock(v, span()) : log ? logTick(v) : tick(v, step || 1))),
  });
  const height = options.height ?? 290;
  const reset = el('button', { type: 'button', class: 'reset', hidden: true, onclick: () => zoom(null) }, 'whole range');

  const sync = fig.sync || undefined;
  const self = { zoom: (lo, hi) => u.setScale('x', { min: lo, max: hi }) };
  let full = null, busy = false;
  function zoom(range) {
    if (!full) return;
    const [lo, hi] = range ?? full;
    for (const other of sync ? groups.get(sync) : [self]) other.zoom(lo, hi);
  }

  const opts = {
    width: 600, height, legend: { show: false }, padding: [10, clocked ? 30 : 18, 0, 0],
    cursor: {
      drag: { x: true, y: false, dist: 6 }, points: { size: 7, width: 1.5 }, focus: { prox: 24 },
      sync: sync ? { key: sync, setSeries: false, scales: ['x', null], filters: { pub: (type) => type === 'mousemove' || type === 'mouseleave' } } : undefined,
    },
    scales: {
      x: { time: false, distr: logX ? 3 : 1, range: (s, lo, hi) => xRange(lo, hi) },
      y: { distr: logY ? 3 : 1, range: rangeOf({ ...yAxis, log: logY }) },
    },
    axes: [{ ...axis(xAxis, logX, clocked), size: 28 }, { ...axis(yAxis, logY, false), size: axisSize, ...(options.yValues ? { values: options.yValues } : {}) }],
    series, bands,
    hooks: {
      ready: [(c) => (full = [c.scales.x.min, c.scales.x.max])],
      drawClear: [(c) => drawSpans(c, fig.spans || [])],
      draw: [(c) => { nameSpans(c, fig.spans || []); drawMarks(c, fig.marks || []); }],
      setCursor: [(c) => {
        const i = c.cursor.idx;
        for (const k of keys) k.show(c, i);
        if (sync && !busy && c.cursor.event) tellCursor(sync, i === null || i === undefined ? null : c.data[0][i]);
      }],
      setScale: [(c, name) => {
        if (name !== 'x' || !full || busy) return;
        const s = c.scales.x;
        const whole = Math.abs(s.min - full[0]) + Math.abs(s.max - full[1]) < 1e-9 * (full[1] - full[0]);
        reset.hidden = whole;
        if (!sync) return;
        for (const other of groups.get(sync)) if (other !== self) other.follow(s.min, s.max);
      }],
    },
  };
  self.follow = (lo, hi) => {
    const s = u.scales.x;
    if (s.min === lo && s.max === hi) return;
    busy = true;
    u.setScale('x', { min: lo, max: hi });
    reset.hidden = full && Math.abs(lo - full[0]) + Math.abs(hi - full[1]) < 1e-9 * (full[1] - full[0]);
    // uPlot calls setScale later in the same frame.
    queueMicrotask(() => (busy = false));
  };
  function xRange(lo, hi) {
    if (lo === null || lo === undefined) return logX ? [1, 10] : [0, 1];
    if (xAxis.lo !== undefined && full === null) lo = xAxis.lo;
    if (xAxis.hi !== undefined && full === null) hi = xAxis.hi;
    if (lo === hi) return logX ? [lo / 2, hi * 2] : [lo - (Math.abs(lo) * 1e-3 || 0.5), hi + (Math.abs(hi) * 1e-3 || 0.5)];
    return [lo, hi];
  }

  // The legend: one switch per source.
  const keys = [];
  const bySource = new Map();
  for (const r of rows) {
    if (r.key === null) continue;
    const k = r.key ?? r.name;
    if (!bySource.has(k)) bySource.set(k, []);
    bySource.get(k).push(r);
  }
  for (const [name, members] of bySource) {
    const item = legendButton(name, members.slice(0, 4).map((r) => ({ colour: r.colour, style: r.style })), !members[0].hidden, (on) => {
      u.batch(() => {
        for (const r of members) {
          u.setSeries(r.at, { show: on });
          if (r.hi) { u.setSeries(r.at + 1, { show: on }); u.setSeries(r.at + 2, { show: on }); }
        }
      });
      if (options.toggled) options.toggled(u, members, on);
    });
    keys.push({
      show: (c, i) => {
        const shown = i === null || i === undefined ? [] : members.map((r) => (r.read ? r.read(c, i) : nearby(c, r.at, i)));
        item.values.textContent = shown.some((v) => v !== null) ? shown.map((v) => value(v)).join('  ') : '';
      },
    });
    if (members[0].suffix) item.values.before(el('span', { class: 'aside' }, members[0].suffix));
    legend.append(item.button);
  }
  const readX = el('span', { class: 'readout' });
  keys.push({ show: (c, i) => (readX.textContent = i === null || i === undefined ? '' : `${xAxis.label || 'x'} ${clocked ? clock(c.data[0][i], 10) : value(c.data[0][i], 7)}${!clocked && xAxis.unit ? ' ' + xAxis.unit : ''}`) });
  legend.append(readX, reset);

  const start = () => {
    u = new uPlot({ ...opts, width: Math.max(200, plot.clientWidth) }, data, plot);
    if (sync) {
      if (!groups.has(sync)) groups.set(sync, new Set());
      groups.get(sync).add(self);
    }
    u.over.addEventListener('dblclick', () => zoom(null));
    redraws.add(() => u.redraw(false, true));
    onWidth(plot, (w) => u.setSize({ width: Math.max(200, w), height }));
    plot.addEventListener('keydown', (e) => {
      const s = u.scales.x, w = s.max - s.min;
      const shift = (d) => [Math.max(full[0], Math.min(full[1] - w, s.min + d)), Math.min(full[1], Math.max(full[0] + w, s.max + d))];
      if (logX) return;
      if (e.key === 'ArrowLeft') zoom(shift(-0.2 * w));
      else if (e.key === 'ArrowRight') zoom(shift(0.2 * w));
      else if (e.key === '+' || e.key === '=') zoom([s.min + 0.2 * w, s.max - 0.2 * w]);
      else if (e.key === '-') zoom([Math.max(full[0], s.min - 0.33 * w), Math.min(full[1], s.max + 0.33 * w)]);
      else if (e.key === '0' || e.key === 'Escape') zoom(null);
      else return;
      e.preventDefault();
    });
    if (!data.slice(1).some((c) => c.some((v) => v !== null && v !== undefined))) plot.append(el('p', { class: 'nothing' }, 'no data'));
  };
  return { root, start };
}

// The value of a series at or just beside an index: joined tables have holes.
function nearby(c, s, i) {
  const a = c.data[s];
  for (let d = 0; d < 40; d++) {
    for (const j of [i - d, i + d]) if (a[j] !== undefined) return a[j];
  }
  return null;
}

function drawSpans(c, spans) {
  const { ctx } = c;
  const { left, top, width, height } = c.bbox;
  spans.forEach((s, n) => {
    const a = Math.max(left, c.valToPos(s.from, 'x', true)), b = Math.min(left + width, c.valToPos(s.to, 'x', true));
    if (!(b > a)) return;
    ctx.save();
    ctx.fillStyle = cssVar(n % 2 ? '--span2' : '--span');
    ctx.fillRect(a, top, b - a, height);
    ctx.restore();
  });
}
function nameSpans(c, spans) {
  const { ctx } = c;
  const { left, top, width } = c.bbox, d = devicePixelRatio;
  for (const s of spans) {
    const a = Math.max(left, c.valToPos(s.from, 'x', true)), b = Math.min(left + width, c.valToPos(s.to, 'x', true));
    // A name that does not fit is left out: half a word says less than none.
    if (!s.label || a + 8 * d + nameWidth(ctx, s.label) > b) continue;
    ctx.save();
    label(ctx, s.label, a + 4 * d, top + 4 * d, 'left', 'top');
    ctx.restore();
  }
}
const labelFont = () => `${11 * devicePixelRatio}px ui-sans-serif, system-ui, sans-serif`;
function nameWidth(ctx, text) {
  ctx.font = labelFont();
  return ctx.measureText(text).width;
}
function label(ctx, text, x, y, align, baseline) {
  ctx.font = labelFont();
  ctx.textAlign = align;
  ctx.textBaseline = baseline;
  ctx.lineWidth = 3 * devicePixelRatio;
  ctx.lineJoin = 'round';
  ctx.strokeStyle = cssVar('--panel');
  ctx.strokeText(text, x, y);
  ctx.fillStyle = cssVar('--muted');
  ctx.fillText(text, x, y);
}
function drawMarks(c, marks) {
  const { ctx } = c;
  const { left, top, width, height } = c.bbox;
  const d = devicePixelRatio;
  for (const m of marks) {
    const p = c.valToPos(m.at, m.horizontal ? 'y' : 'x', true);
    if (!Number.isFinite(p) || (m.horizontal ? p < top || p > top + height : p < left || p > left + width)) continue;
    ctx.save();
    ctx.strokeStyle = cssVar('--mark');
    ctx.lineWidth = d;
    ctx.setLineDash([4 * d, 3 * d]);
    ctx.beginPath();
    if (m.horizontal) { ctx.moveTo(left, p); ctx.lineTo(left + width, p); } else { ctx.moveTo(p, top); ctx.lineTo(p, top + height); }
    ctx.stroke();
    ctx.setLineDash([]);
    if (m.label) {
      if (m.horizontal) label(ctx, m.label, m.left ? left + 4 * d : left + width - 4 * d, p - 3 * d, m.left ? 'left' : 'right', 'bottom');
      else {
        const rightward = p < left + 0.75 * width;
        label(ctx, m.label, p + (rightward ? 4 : -4) * d, top + 4 * d, rightward ? 'left' : 'right', 'top');
      }
    }
    ctx.restore();
  }
}

function curveRow(c) {
  const band = c.hi && !c.style && !numbers(c.y).some((v) => v !== null);
  return {
    name: c.name || '', key: c.source || undefined, colour: colourOf(c.name || '', c.colour), style: band ? 'band' : c.style, hidden: c.hidden,
    x: numbers(c.x), y: padded(numbers(c.y), numbers(c.x).length), lo: c.lo && numbers(c.lo), hi: c.hi && numbers(c.hi),
  };
}
const padded = (a, n) => (a.length < n ? a.concat(new Array(n - a.length).fill(null)) : a);

export function series(fig) {
  return build(fig, (fig.curves || []).map(curveRow));
}

export function fan(fig) {
  const x = numbers(fig.at), all = fig.percentiles || [];
  const rows = [];
  const colour = colourOf(fig.title || 'fan');
  const n = all.length;
  for (let i = 0; i < Math.floor(n / 2); i++) {
    const lo = all[i], hi = all[n - 1 - i];
    rows.push({ name: `${value(lo.percent)}–${value(hi.percent)} %`, colour: (a) => colour(a === undefined ? 0.25 + (0.5 * (i + 1)) / n : a), x, y: x.map(() => null), lo: numbers(lo.y), hi: numbers(hi.y), style: 'band',
      read: () => null });
  }
  if (n % 2) {
    const mid = all[(n - 1) / 2];
    rows.push({ name: mid.percent === 50 ? 'median' : `${value(mid.percent)} %`, colour, x, y: numbers(mid.y), width: 2.25 });
  }
  for (const c of fig.curves || []) rows.push({ ...curveRow(c), width: 1 });
  return build(fig, rows);
}

export function stacked(fig) {
  const x = numbers(fig.at);
  const layers = (fig.layers || []).map((l) => ({ name: l.name, y: padded(numbers(l.y), x.length), on: true }));
  const sums = () => {
    const total = x.map(() => 0);
    return layers.map((l) => x.map((_, i) => (total[i] += l.on ? l.y[i] ?? 0 : 0)));
  };
  let heights = sums();
  const rows = layers.map((l, k) => ({
    name: l.name, colour: colourOf(l.name), x, y: heights[k], width: 1, fill: k === 0 ? 0.55 : undefined, layer: k, read: (_, i) => (l.on ? l.y[i] : null),
  }));
  const bands = rows.slice(1).map((r, k) => ({ series: [k + 2, k + 1], fill: () => r.colour(0.55), dir: -1 }));
  return build({ ...fig, y: { lo: 0, ...fig.y } }, rows, {
    bands,
    toggled: (u, members, on) => {
      for (const m of members) { layers[m.layer].on = on; u.setSeries(m.at, { show: true }); }
      heights = sums();
      u.setData([u.data[0], ...heights], false);
      u.redraw();
    },
  });
}

export function histogram(fig) {
  const edges = numbers(fig.edges), rows = [];
  const samples = fig.samples || [], several = samples.length > 1;
  const width = edges.length > 1 ? edges[1] - edges[0] : 1;
  for (const s of samples) {
    const scale = several ? 100 / Math.max(1, s.n) : 1;
    const counts = numbers(s.counts).map((c) => c * scale);
    const colour = colourOf(s.name || '');
    const about = s.std !== undefined ? `  mean ${value(s.mean, 4)}, std ${value(s.std, 4)}, n ${s.n}` : `  n ${s.n ?? 0}`;
    // Closed at both ends, so that the outline of the first and last bin is drawn.
    rows.push({ name: s.name || '', suffix: about, colour, style: 'steps', fill: 0.22, width: 1.25, x: edges, y: counts.length ? counts.concat(counts[counts.length - 1]) : [] });
    if (fig.normal && s.std > 0) {
      const x = [], y = [];
      for (let i = 0; i <= 160; i++) {
        const v = edges[0] + ((edges[edges.length - 1] - edges[0]) * i) / 160;
        x.push(v);
        y.push((scale * s.n * width * Math.exp(-0.5 * ((v - s.mean) / s.std) ** 2)) / (s.std * Math.sqrt(2 * Math.PI)));
      }
      rows.push({ name: `${s.name || ''} normal`, key: `normal of ${s.name || 'it'}`, colour: several ? colour : colourOf('normal curve'), x, y, style: 'dashed', width: 1.5 });
    }
  }
  return build({ ...fig, y: { label: several ? 'share of each' : 'count', unit: several ? '%' : '', lo: 0 } }, rows, { half: true, height: 260 });
}

export function cdf(fig) {
  const percentiles = numbers(fig.percentiles);
  const rows = (fig.samples || []).map((s) => {
    const at = numbers(s.at);
    return {
      name: s.name || '', suffix: '  ' + percentiles.map((p, i) => `${value(p)} %: ${value(at[i], 4)}`).join(', '), colour: colourOf(s.name || ''), style: 'steps',
      x: numbers(s.x), y: numbers(s.p).map((p) => 100 * p),
    };
  });
  const marks = [...(fig.marks || []), ...percentiles.map((p) => ({ at: p, horizontal: true, left: true, label: `${value(p)} %` }))];
  return build({ ...fig, marks, y: { label: 'share below', unit: '%', lo: 0, hi: 102 } }, rows, { half: true, height: 260 });
}
