// SPDX-License-Identifier: Apache-2.0
// Maps. Tracks and graticule are projected here from unit vectors, so that 90 degrees and ±180 degrees are points like
// any other and a metre is a metre; d3-geo draws only the land, under the same projection.
import { geoAzimuthalEquidistant, geoOrthographic, geoPath, geoStereographic } from 'd3-geo';
import { feature } from 'topojson-client';
import topology from 'world-atlas/land-110m.json';
import { colourOf, cssVar, cursors, el, figure, legendButton, niceTicks, numbers, onWidth, clock, redraws, value } from './look.js';

const land = feature(topology, topology.objects.land);
const rad = Math.PI / 180, R = 6371008.8, a = 6378137, e2 = 0.0066943799901413165;

const unit = (lat, lon) => [Math.cos(lat * rad) * Math.cos(lon * rad), Math.cos(lat * rad) * Math.sin(lon * rad), Math.sin(lat * rad)];
const dot = (p, q) => p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
const ecef = (lat, lon) => {
  const s = Math.sin(lat * rad), n = a / Math.sqrt(1 - e2 * s * s), c = n * Math.cos(lat * rad);
  return [c * Math.cos(lon * rad), c * Math.sin(lon * rad), n * (1 - e2) * s];
};
const axes = (lat, lon) => {
  const sl = Math.sin(lat * rad), cl = Math.cos(lat * rad), so = Math.sin(lon * rad), co = Math.cos(lon * rad);
  return { e: [-so, co, 0], n: [-sl * co, -sl * so, cl], u: [cl * co, cl * so, sl] };
};

// Chooses centre and projection: { project(lat, lon) -> [x, y] | null, invert, metres, kind, d3 }, x right, y up.
function choose(lats, lons) {
  let m = [0, 0, 0], maxLat = -90, minLat = 90;
  lats.forEach((lat, i) => {
    if (lat === null || lons[i] === null) return;
    const p = unit(lat, lons[i]);
    m = [m[0] + p[0], m[1] + p[1], m[2] + p[2]];
    maxLat = Math.max(maxLat, lat);
    minLat = Math.min(minLat, lat);
  });
  const size = Math.hypot(...m);
  if (!(size > 0)) return sphere(0, 0, false);
  m = m.map((v) => v / size);
  let reach = 0;
  lats.forEach((lat, i) => {
    if (lat === null || lons[i] === null) return;
    const p = unit(lat, lons[i]);
    reach = Math.max(reach, Math.hypot(p[0] - m[0], p[1] - m[1], p[2] - m[2]));
  });
  const lat0 = Math.atan2(m[2], Math.hypot(m[0], m[1])) / rad, lon0 = Math.atan2(m[1], m[0]) / rad;
  if (reach * R < 50e3) return plane(lat0, lon0, reach * R);
  const polar = Math.max(Math.abs(maxLat), Math.abs(minLat)) > 66.5 && Math.abs(lat0) > 50;
  if (polar) return sphere(Math.sign(lat0) * 90, lon0, true);
  return sphere(lat0, lon0, reach < 1);
}

function plane(lat0, lon0, reach) {
  const c = ecef(lat0, lon0), f = axes(lat0, lon0);
  return {
    kind: 'plane', lat0, lon0, reach, local: true,
    project: (lat, lon) => {
      const p = ecef(lat, lon), d = [p[0] - c[0], p[1] - c[1], p[2] - c[2]];
      return dot(d, f.u) < -a ? null : [dot(d, f.e), dot(d, f.n)];
    },
    metres: () => 1,
    name: 'plane in metres',
  };
}
function sphere(lat0, lon0, conformal) {
  const f = axes(lat0, lon0);
  const project = (lat, lon) => {
    const p = unit(lat, lon), x = dot(p, f.e), y = dot(p, f.n), z = dot(p, f.u);
    if (conformal) return z < -0.8 ? null : [(2 * x) / (1 + z), (2 * y) / (1 + z)];
    const r = Math.hypot(x, y), k = r > 1e-12 ? Math.atan2(r, z) / r : 1;
    return [x * k, y * k];
  };
  const invert = (x, y) => {
    const r = Math.hypot(x, y), c = conformal ? 2 * Math.atan(r / 2) : r;
    if (c > Math.PI) return null;
    const s = r > 0 ? Math.sin(c) / r : 1, z = Math.cos(c);
    const p = [0, 1, 2].map((i) => x * s * f.e[i] + y * s * f.n[i] + z * f.u[i]);
    return [Math.atan2(p[2], Math.hypot(p[0], p[1])) / rad, Math.atan2(p[1], p[0]) / rad];
  };
  return {
    kind: conformal ? 'stereographic' : 'equidistant', lat0, lon0, project, invert,
    // Metres of ground per unit of the plane at a point of it.
    metres: (x, y) => (conformal ? R / (1 + (x * x + y * y) / 4) : R),
    d3: () => (conformal ? geoStereographic().clipAngle(140) : geoAzimuthalEquidistant().clipAngle(179.9)).rotate([-lon0, -lat0]),
    d3scale: conformal ? 2 : 1,
    name: `${conformal ? 'stereographic' : 'azimuthal equidistant'}, centred on ${Math.abs(lat0) === 90 ? (lat0 > 0 ? 'the North Pole' : 'the South Pole') : `${value(lat0, 4)}°, ${value(lon0, 4)}°`}`,
  };
}

export function map(fig) {
  const tracks = (fig.tracks || []).map((t) => ({ name: t.name || '', style: t.style, lat: numbers(t.lat), lon: numbers(t.lon), t: t.t ? numbers(t.t) : null, colour: colourOf(t.name || '', t.colour), on: true }));
  const points = fig.points || [];
  const { root, plot, legend } = figure(fig, 'map');
  const canvas = el('canvas', { 'aria-hidden': 'true' });
  const tip = el('div', { class: 'tip', hidden: true });
  const key = (text, title, act) => el('button', { type: 'button', title, 'aria-label': title, onclick: act }, text);
  const controls = el('div', { class: 'controls' }, key('+', 'zoom in', () => zoomBy(1.6)), key('−', 'zoom out', () => zoomBy(1 / 1.6)), key('⤢', 'whole track', () => { fit(); draw(); }));
  plot.append(canvas, tip, controls);

  const allLat = tracks.flatMap((t) => t.lat).concat(points.map((p) => p.lat)), allLon = tracks.flatMap((t) => t.lon).concat(points.map((p) => p.lon));
  const proj = choose(allLat, allLon);
  const place = (lat, lon) => (lat === null || lat === undefined || lon === null || lon === undefined ? null : proj.project(lat, lon));
  for (const t of tracks) t.xy = t.lat.map((lat, i) => place(lat, t.lon[i]));
  const spots = points.map((p) => ({ ...p, xy: place(p.lat, p.lon), colour: colourOf('benchmarks', p.what === 'fix' ? 6 : undefined) }));

  let width = 600, height = 420, k = 1, cx = 0, cy = 0, ellipseScale = 1, cursorAt = null;
  const px = ([x, y]) => [width / 2 + (x - cx) * k, height / 2 - (y - cy) * k];

  function fit() {
    let x0 = Infinity, x1 = -Infinity, y0 = Infinity, y1 = -Infinity;
    const take = (p) => {
      if (!p) return;
      x0 = Math.min(x0, p[0]); x1 = Math.max(x1, p[0]); y0 = Math.min(y0, p[1]); y1 = Math.max(y1, p[1]);
    };
    for (const t of tracks) t.xy.forEach(take);
    spots.forEach((s) => take(s.xy));
    if (!(x1 >= x0)) { x0 = y0 = -1; x1 = y1 = 1; }
    cx = (x0 + x1) / 2;
    cy = (y0 + y1) / 2;
    const least = proj.local ? 1 : 1e-7; // a single point: a metre about it
    const margin = Math.min(56, width / 8);
    k = Math.min((width - 2 * margin) / Math.max(x1 - x0, least), (height - 2 * margin) / Math.max(y1 - y0, least));
    // Standard deviations of centimetres are drawn larger, and the page says how much.
    const perMetre = k / proj.metres(cx, cy);
    const largest = Math.max(0, ...spots.map((s) => 2.4477 * Math.max(s.std_e || 0, s.std_n || 0)));
    ellipseScale = largest > 0 && largest * perMetre < 7 ? 10 ** Math.ceil(Math.log10(7 / (largest * perMetre))) : 1;
  }
  function zoomBy(f, x = width / 2, y = height / 2) {
    cx += (x - width / 2) * (1 / k - 1 / (k * f));
    cy -= (y - height / 2) * (1 / k - 1 / (k * f));
    k *= f;
    draw();
  }

  const ctx = canvas.getContext('2d');
  function text(s, x, y, align = 'center', baseline = 'middle', colour = '--muted', size = 11) {
    ctx.font = `${size}px ui-sans-serif, system-ui, "Segoe UI", Roboto, sans-serif`;
    ctx.textAlign = align;
    ctx.textBaseline = baseline;
    ctx.lineWidth = 3;
    ctx.lineJoin = 'round';
    ctx.strokeStyle = cssVar('--panel');
    ctx.strokeText(s, x, y);
    ctx.fillStyle = cssVar(colour);
    ctx.fillText(s, x, y);
  }
  function line(pointsPx) {
    let pen = false;
    ctx.beginPath();
    for (const p of pointsPx) {
      if (!p) { pen = false; continue; }
      if (pen) ctx.lineTo(p[0], p[1]); else ctx.moveTo(p[0], p[1]);
      pen = true;
    }
    ctx.stroke();
  }
  const inside = (p, pad = 0) => p && p[0] >= -pad && p[0] <= width + pad && p[1] >= -pad && p[1] <= height + pad;

  // Parallels and meridians of the part in view.
  function graticule() {
    let lo = 90, hi = -90, lons = [];
    const nx = 24, ny = 16;
    for (let i = 0; i <= nx; i++) for (let j = 0; j <= ny; j++) {
      const g = proj.invert(cx + (width / k) * (i / nx - 0.5), cy + (height / k) * (j / ny - 0.5));
      if (!g) continue;
      lo = Math.min(lo, g[0]); hi = Math.max(hi, g[0]);
      lons.push(g[1]);
    }
    const north = inside(px(proj.project(90, 0) || [1e9, 1e9])), south = inside(px(proj.project(-90, 0) || [1e9, 1e9]));
    if (north) hi = 90;
    if (south) lo = -90;
    // Longitudes in view: all, or those about the middle one.
    const ref = (proj.invert(cx, cy) || [0, 0])[1];
    const rel = lons.map((l) => ((l - ref + 540) % 360) - 180);
    let w = Math.min(...rel), e = Math.max(...rel);
    if (north || south || e - w > 300) { w = -180; e = 180; }
    const steps = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30];
    const dLat = steps.find((s) => (hi - lo) / s <= 8) || 30;
    const dLon = north || south ? 30 : steps.find((s) => (e - w) / s <= 9) || 30;
    ctx.strokeStyle = cssVar('--graticule');
    ctx.lineWidth = 1;
    const labels = [];
    const cap = 90 - (dLat < 10 ? dLat : 10) * (north || south ? 1 : 0);
    for (let lat = Math.ceil(lo / dLat) * dLat; lat <= hi + 1e-9; lat += dLat) {
      if (Math.abs(lat) > 90 - 1e-9) continue;
      const pts = [];
      for (let i = 0; i <= 180; i++) pts.push(proj.project(lat, ref + w + ((e - w) * i) / 180));
      line(pts.map((p) => p && px(p)));
      for (const off of [0, 15, -15, 45, -45, 180, 90, -90]) {
        const at = proj.project(lat, ref + Math.max(w, Math.min(e, off * ((e - w) / 360))));
        if (at && inside(px(at), -26)) { labels.push([degrees(lat, 'N', 'S', dLat), px(at)]); break; }
      }
    }
    for (let n = Math.ceil((ref + w) / dLon); n * dLon <= ref + e + 1e-9; n++) {
      const lon = n * dLon;
      if (e - w >= 360 && lon >= ref + e - 1e-9) continue;
      const top = lon % 90 === 0 ? 90 : cap, from = Math.max(lo, -top), to = Math.min(hi, top), pts = [];
      for (let i = 0; i <= 90; i++) pts.push(proj.project(from + ((to - from) * i) / 90, lon));
      const p = pts.map((q) => q && px(q));
      line(p);
      const l = ((lon + 540) % 360) - 180;
      // Named where the meridian leaves the picture.
      const seen = p.filter((q) => inside(q, -14));
      if (seen.length > 6) {
        const q = north ? seen[0] : south ? seen[seen.length - 1] : seen[0];
        labels.push([degrees(l === -180 ? 180 : l, 'E', 'W', dLon), [q[0], Math.max(10, Math.min(height - 10, q[1]))]]);
      }
    }
    return () => {
      const taken = [];
      for (const [s, p] of labels) {
        // Not under the scale bar, the buttons or the globe.
        if ((p[0] < 210 && p[1] > height - 34) || (p[0] > width - 62 && p[1] < 124) || (width >= 520 && p[0] > width - 104 && p[1] > height - 104)) continue;
        if (taken.some((q) => Math.abs(q[0] - p[0]) < 44 && Math.abs(q[1] - p[1]) < 14)) continue;
        taken.push(p);
        text(s, Math.max(22, Math.min(width - 22, p[0])), p[1]);
      }
      for (const [pole, shown] of [[90, north], [-90, south]]) {
        if (!shown) continue;
        const p = px(proj.project(pole, 0));
        ctx.strokeStyle = cssVar('--muted');
        ctx.lineWidth = 1.25;
        line([[p[0] - 5, p[1]], [p[0] + 5, p[1]]]);
        line([[p[0], p[1] - 5], [p[0], p[1] + 5]]);
        text(pole > 0 ? 'North Pole' : 'South Pole', p[0] + 8, p[1] + (p[1] > height - 24 ? -11 : 11), 'left');
      }
    };
  }
  function degrees(v, plus, less, step) {
    const d = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    const s = Math.abs(v).toFixed(d);
    return +s === 0 ? '0°' : `${s}°${+s === 180 ? '' : v > 0 ? plus : less}`;
  }

  function metreGrid() {
    const { ticks: xs, step } = niceTicks(cx - width / 2 / k, cx + width / 2 / k, Math.max(3, width / 110));
    ctx.strokeStyle = cssVar('--graticule');
    ctx.lineWidth = 1;
    for (const x of xs) line([[px([x, 0])[0], 0], [px([x, 0])[0], height]]);
    for (let i = Math.ceil((cy - height / 2 / k) / step); i * step <= cy + height / 2 / k; i++) line([[0, px([0, i * step])[1]], [width, px([0, i * step])[1]]]);
    const pole = Math.abs(proj.lat0) > 85 ? proj.project(Math.sign(proj.lat0) * 90, 0) : null;
    return () => {
      if (!pole || !inside(px(pole))) return;
      const p = px(pole);
      ctx.strokeStyle = cssVar('--muted');
      line([[p[0] - 5, p[1]], [p[0] + 5, p[1]]]);
      line([[p[0], p[1] - 5], [p[0], p[1] + 5]]);
      text(proj.lat0 > 0 ? 'North Pole' : 'South Pole', p[0] + 8, p[1] + 11, 'left');
    };
  }

  function scaleBar() {
    const per = proj.metres(cx, cy) / k; // m per px
    const most = Math.min(180, width / 3) * per, base = 10 ** Math.floor(Math.log10(most));
    const length = [5, 2, 1].map((m) => m * base).find((m) => m <= most) || base;
    const x = 14, y = height - 14, w = length / per;
    ctx.strokeStyle = cssVar('--ink');
    ctx.lineWidth = 1.5;
    line([[x, y - 5], [x, y], [x + w, y], [x + w, y - 5]]);
    text(length >= 1000 ? `${length / 1000} km` : length >= 1 ? `${length} m` : length >= 0.01 ? `${+(length * 100).toPrecision(1)} cm` : `${+(length * 1000).toPrecision(1)} mm`, x + w / 2, y - 10, 'center', 'middle', '--ink');
  }

  // Where on the Earth the picture is.
  function globe() {
    if (width < 520 || (!proj.local && proj.metres(cx, cy) * (width / k) > 3e6)) return;
    const r = 38, gx = width - r - 12, gy = height - r - 12;
    const [lat, lon] = proj.local ? [proj.lat0, proj.lon0] : proj.invert(cx, cy);
    const g = geoOrthographic().rotate([-lon, -lat * 0.85]).scale(r).translate([gx, gy]);
    const path = geoPath(g, ctx);
    ctx.beginPath();
    ctx.arc(gx, gy, r, 0, 2 * Math.PI);
    ctx.fillStyle = cssVar('--sea');
    ctx.fill();
    ctx.beginPath();
    path(land);
    ctx.fillStyle = cssVar('--land2');
    ctx.fill();
    ctx.beginPath();
    ctx.arc(gx, gy, r, 0, 2 * Math.PI);
    ctx.strokeStyle = cssVar('--line');
    ctx.lineWidth = 1;
    ctx.stroke();
    const p = g([lon, lat]);
    ctx.beginPath();
    ctx.arc(p[0], p[1], 3.5, 0, 2 * Math.PI);
    ctx.fillStyle = cssVar('--accent');
    ctx.fill();
    ctx.strokeStyle = cssVar('--panel');
    ctx.stroke();
  }

  function draw() {
    const d = Math.min(3, devicePixelRatio || 1);
    canvas.width = Math.round(width * d);
    canvas.height = Math.round(height * d);
    canvas.style.height = `${height}px`;
    ctx.setTransform(d, 0, 0, d, 0, 0);
    ctx.fillStyle = cssVar(proj.local ? '--panel' : '--sea');
    ctx.fillRect(0, 0, width, height);
    let labels;
    if (proj.local) labels = metreGrid();
    else {
      const g = proj.d3().scale(k * proj.d3scale).translate([width / 2 - cx * k, height / 2 + cy * k]).clipExtent([[-2, -2], [width + 2, height + 2]]).precision(0.4);
      const path = geoPath(g, ctx);
      ctx.beginPath();
      path(fig.land ? coast(fig.land) : land);
      ctx.fillStyle = cssVar('--land');
      ctx.fill();
      ctx.strokeStyle = cssVar('--coast');
      ctx.lineWidth = 0.75;
      ctx.stroke();
      labels = graticule();
    }
    labels();
    for (const t of tracks) {
      if (!t.on) continue;
      ctx.strokeStyle = ctx.fillStyle = t.colour();
      ctx.lineWidth = 2;
      ctx.lineJoin = ctx.lineCap = 'round';
      ctx.setLineDash(t.style === 'dashed' ? [7, 6] : []);
      if (t.style !== 'points') line(t.xy.map((p) => p && px(p)));
      ctx.setLineDash([]);
      const seen = t.xy.filter(Boolean);
      const dots = t.style === 'points' || t.style === 'linepoints' || seen.length === 1;
      if (dots) for (const p of seen) { const q = px(p); ctx.beginPath(); ctx.arc(q[0], q[1], 3, 0, 7); ctx.fill(); }
    }
    ctx.lineCap = 'butt';
    const taken = [];
    for (const s of spots) {
      if (!s.xy) continue;
      const q = px(s.xy);
      if (!inside(q, 40)) continue;
      ellipse(s, q);
      symbol(s, q);
      if (s.name && !taken.some((o) => Math.abs(o[0] - q[0]) < 9 * s.name.length + 8 && Math.abs(o[1] - q[1]) < 14)) {
        taken.push(q);
        text(s.name, q[0] + 9, q[1] - 9, 'left', 'middle', '--ink', 12);
      }
    }
    if (cursorAt !== null) for (const t of tracks) {
      if (!t.on || !t.t) continue;
      const p = atTime(t, cursorAt);
      if (!p) continue;
      const q = px(p);
      ctx.beginPath();
      ctx.arc(q[0], q[1], 5.5, 0, 7);
      ctx.fillStyle = t.colour();
      ctx.fill();
      ctx.lineWidth = 2;
      ctx.strokeStyle = cssVar('--panel');
      ctx.stroke();
    }
    scaleBar();
    globe();
  }
  function ellipse(s, q) {
    if (!(s.std_e >= 0) || !(s.std_n >= 0)) return;
    // Axes of the 95 % ellipse (chi-square 5.991) of east and north.
    const see = s.std_e ** 2, snn = s.std_n ** 2, sen = (s.correlation || 0) * s.std_e * s.std_n;
    const mean = (see + snn) / 2, root = Math.hypot((see - snn) / 2, sen), angle = 0.5 * Math.atan2(2 * sen, see - snn);
    const f = (ellipseScale * 2.4477 * k) / proj.metres(...s.xy);
    ctx.beginPath();
    ctx.ellipse(q[0], q[1], f * Math.sqrt(mean + root), f * Math.sqrt(Math.max(0, mean - root)), -angle, 0, 2 * Math.PI);
    ctx.fillStyle = s.colour(0.18);
    ctx.fill();
    ctx.lineWidth = 1.25;
    ctx.strokeStyle = s.colour();
    ctx.stroke();
  }
  function symbol(s, [x, y]) {
    ctx.fillStyle = s.what === 'start' || s.what === 'end' ? cssVar('--ink') : s.colour();
    ctx.strokeStyle = cssVar('--panel');
    ctx.lineWidth = 1.5;
    ctx.beginPath();
    if (s.what === 'benchmark') { ctx.moveTo(x, y - 6.5); ctx.lineTo(x + 6, y + 4.5); ctx.lineTo(x - 6, y + 4.5); ctx.closePath(); }
    else if (s.what === 'end') ctx.rect(x - 4.5, y - 4.5, 9, 9);
    else ctx.arc(x, y, s.what === 'fix' ? 2.5 : 5, 0, 2 * Math.PI);
    ctx.fill();
    ctx.stroke();
  }
  function atTime(t, at) {
    let lo = 0, hi = t.t.length - 1;
    if (hi < 0 || at < t.t[0] || at > t.t[hi]) return null;
    while (hi - lo > 1) { const mid = (lo + hi) >> 1; if (t.t[mid] <= at) lo = mid; else hi = mid; }
    const p = t.xy[lo], q = t.xy[hi];
    if (!p || !q) return p || q;
    const f = t.t[hi] > t.t[lo] ? (at - t.t[lo]) / (t.t[hi] - t.t[lo]) : 0;
    return [p[0] + f * (q[0] - p[0]), p[1] + f * (q[1] - p[1])];
  }

  for (const t of tracks) legend.append(legendButton(t.name || 'track', [{ colour: t.colour, style: t.style }], true, (on) => { t.on = on; draw(); }).button);
  const kinds = [...new Set(points.map((p) => p.what))];
  const words = { benchmark: '▲ benchmark', start: '● start', end: '■ end', fix: '• fix', other: '● point' };
  for (const w of kinds) legend.append(el('span', { class: 'readout' }, words[w] || w));

  let moved = null;
  canvas.addEventListener('pointerdown', (e) => { moved = [e.clientX, e.clientY, cx, cy]; canvas.setPointerCapture(e.pointerId); });
  canvas.addEventListener('pointerup', () => (moved = null));
  canvas.addEventListener('pointercancel', () => (moved = null));
  canvas.addEventListener('pointermove', (e) => {
    if (moved) {
      cx = moved[2] - (e.clientX - moved[0]) / k;
      cy = moved[3] + (e.clientY - moved[1]) / k;
      tip.hidden = true;
      draw();
      return;
    }
    const box = canvas.getBoundingClientRect(), x = e.clientX - box.left, y = e.clientY - box.top;
    let best = 20 * 20, found = null;
    for (const t of tracks) if (t.on) t.xy.forEach((p, i) => {
      if (!p) return;
      const q = px(p), d2 = (q[0] - x) ** 2 + (q[1] - y) ** 2;
      if (d2 < best) { best = d2; found = { t, i, q }; }
    });
    for (const s of spots) if (s.xy) {
      const q = px(s.xy), d2 = (q[0] - x) ** 2 + (q[1] - y) ** 2;
      if (d2 < best) { best = d2; found = { s, q }; }
    }
    tip.hidden = !found;
    if (!found) return;
    const digits = Math.max(2, Math.min(9, Math.ceil(Math.log10((k / proj.metres(cx, cy)) * 111e3))));
    const lat = found.s ? found.s.lat : found.t.lat[found.i], lon = found.s ? found.s.lon : found.t.lon[found.i];
    const wrapped = ((lon + 540) % 360) - 180;
    tip.textContent = `${found.s ? found.s.name : found.t.name}  ${lat.toFixed(digits)}°, ${wrapped.toFixed(digits)}°` + (found.t && found.t.t ? `  t ${clock(found.t.t[found.i], 10)}` : '');
    tip.style.transform = `translate(${Math.min(found.q[0] + 10, width - tip.offsetWidth - 4)}px, ${Math.max(4, found.q[1] - 30)}px)`;
  });
  canvas.addEventListener('pointerleave', () => (tip.hidden = true));
  // The wheel scrolls the page unless the map was chosen (click or tab) or Ctrl is held.
  canvas.addEventListener('wheel', (e) => {
    if (!e.ctrlKey && !plot.contains(document.activeElement)) return;
    e.preventDefault();
    const box = canvas.getBoundingClientRect();
    zoomBy(Math.exp(-e.deltaY * 0.0018), e.clientX - box.left, e.clientY - box.top);
  }, { passive: false });
  canvas.addEventListener('dblclick', (e) => { const box = canvas.getBoundingClientRect(); zoomBy(2, e.clientX - box.left, e.clientY - box.top); });
  canvas.addEventListener('click', () => plot.focus());
  plot.addEventListener('keydown', (e) => {
    const step = 40 / k;
    if (e.key === 'ArrowLeft') cx -= step;
    else if (e.key === 'ArrowRight') cx += step;
    else if (e.key === 'ArrowUp') cy += step;
    else if (e.key === 'ArrowDown') cy -= step;
    else if (e.key === '+' || e.key === '=') return zoomBy(1.4);
    else if (e.key === '-') return zoomBy(1 / 1.4);
    else if (e.key === '0' || e.key === 'Escape') fit();
    else return;
    e.preventDefault();
    draw();
  });
  cursors.addEventListener('at', (e) => { cursorAt = e.detail.x; draw(); });

  const note = el('p', { class: 'remark' });
  root.append(note);
  const start = () => {
    onWidth(plot, (w) => {
      const kept = width / k;
      const first = !draw.done;
      width = w;
      height = Math.round(Math.max(280, Math.min(520, w * 0.56)));
      canvas.style.width = `${w}px`;
      if (first) fit(); else k = width / kept;
      draw.done = true;
      draw();
    });
    const parts = [`Projection: ${proj.name}.`];
    if (proj.local) parts.push(`Origin ${value(proj.lat0, 9)}°, ${value(proj.lon0, 9)}°; east to the right, north up.`);
    if (spots.some((s) => s.std_e >= 0)) parts.push(`Ellipses: 95\u00a0%${ellipseScale > 1 ? `, drawn ${ellipseScale.toLocaleString('en')} times larger` : ''}.`);
    note.textContent = parts.join(' ');
    redraws.add(draw);
  };
  return { root, start };
}

// Polygons of the page's own, finer coast: rings [lon, lat, dlon, dlat, …] in hundredths of a degree.
let coastCache = null;
function coast(polygons) {
  if (coastCache && coastCache.from === polygons) return coastCache.geo;
  const geo = { type: 'MultiPolygon', coordinates: polygons.map((rings) => rings.map((r) => {
    const ring = [];
    let x = 0, y = 0;
    for (let i = 0; i + 1 < r.length; i += 2) { x += r[i]; y += r[i + 1]; ring.push([x / 100, y / 100]); }
    return ring;
  })) };
  coastCache = { from: polygons, geo };
  return geo;
}
