"use strict";
const $ = (id) => document.getElementById(id);
const token = new URLSearchParams(location.search).get("token") || "";
const S = { views: [], at: -1, n: 0, info: null, scale: 1, x: 0, y: 0, tags: [], labels: {}, tried: {}, tagTexts: {},
  undo: [], redo: [], chosen: -1, blob: null, curves: [], image: null, maskImage: null, drag: null, draft: null };
const NEED = 4;

async function ask(path, given) {
  const options = given === undefined ? { headers: { "X-Token": token } }
    : { method: "POST", headers: { "X-Token": token, "Content-Type": "application/json" }, body: JSON.stringify(given) };
  const answer = await fetch(path, options);
  if (!answer.ok) {
    const said = await answer.json().catch(() => ({ problem: answer.statusText }));
    throw Object.assign(new Error(said.problem), { status: answer.status });
  }
  return answer.headers.get("Content-Type").startsWith("image/") ? createImageBitmap(await answer.blob()) : answer.json();
}
function say(text, bad) { $("status").textContent = text; $("status").className = bad ? "bad" : ""; }
function guard(promise) { return promise.catch((error) => say(error.message, true)); }
function latest(work) { // of calls that overtake each other only the last one counts; one at a time
  let busy = false, next = null;
  return function run(...given) {
    if (busy) { next = given; return; }
    busy = true;
    guard(work(...given)).finally(() => { busy = false; if (next) { const g = next; next = null; run(...g); } });
  };
}
function query(view, more) {
  return new URLSearchParams({ kind: view.kind, name: view.name, camera: view.camera, ...more }).toString();
}
const view = () => S.views[S.at];
const place = (v) => ({ kind: v.kind, name: v.name, camera: v.camera });
const group = (v) => v.kind + "/" + v.name;
const tried = (v) => S.tried[group(v)] || {};
const detect = (v) => ({ ...v.detect, ...tried(v) });
const clips = (camera) => S.views.filter((v) => v.kind === "clip" && v.camera === camera);

// ---- what is there
async function load() {
  const state = await ask("/state");
  take(state);
  $("title").textContent = "vidtrack pick: " + state.title;
  await show(Math.max(0, S.views.findIndex((v) => missing(v))));
  for (const camera of state.cameras) await label(camera);
  listViews();
}
function take(state) {
  S.views = state.views; S.tags = state.tags; S.config = state.config; S.units = state.units; S.tried = {}; S.tagTexts = {};
  for (const v of S.views) v.saved = JSON.stringify(v.rows);
}
function picked(camera) { return clips(camera).reduce((n, v) => n + v.rows.length, 0); }
function named(v) {
  const found = (S.labels[v.camera] || { points: [] }).points.filter((p) => p.clip === v.name && p.Xf !== null);
  return found.length;
}
function missing(v) {
  if (v.kind === "clip") return !named(v) && picked(v.camera) < NEED;
  const others = S.views.filter((o) => o.kind === "run" && o.name === v.name);
  const names = new Set(others.flatMap((o) => o.rows.map((r) => r.target)));
  return [...names].some((name) => !v.rows.some((r) => r.target === name));
}
function mark(v) {
  if (v.kind === "clip") return named(v) ? named(v) + " named" : v.rows.length ? v.rows.length + " picked" : missing(v) ? "missing" : "";
  return v.rows.length ? v.rows.length + (v.rows.length > 1 ? " boxes" : " box") : missing(v) ? "missing" : "found by itself";
}
function listViews() {
  const nav = $("views");
  nav.replaceChildren();
  let last = "";
  S.views.forEach((v, i) => {
    const head = (v.kind === "clip" ? "clip " : "run ") + v.name;
    if (head !== last) { const h = document.createElement("h2"); h.textContent = last = head; nav.append(h); }
    const button = document.createElement("button"), note = document.createElement("span");
    button.textContent = v.camera + (JSON.stringify(v.rows) !== v.saved ? " *" : "");
    button.dataset.view = head + "/" + v.camera;
    note.textContent = mark(v);
    note.className = missing(v) ? "missing" : "done";
    button.append(note);
    button.setAttribute("aria-current", i === S.at);
    button.onclick = () => guard(show(i));
    nav.append(button);
  });
}
async function show(i) {
  S.at = i; S.n = 0; S.chosen = -1; S.blob = null; S.curves = []; S.image = S.maskImage = null;
  const v = view();
  S.info = await opened(v);
  $("slider").max = S.info.frames - 1;
  $("low").value = Math.max(0, Math.floor(S.info.low) - 4);
  $("high").value = Math.min(255, Math.ceil(S.info.high) + 4);
  $("points").hidden = v.kind !== "clip";
  $("boxes").hidden = v.kind !== "run";
  fillDetect(); fillTags(); fillTargets(); listViews(); fit();
  await seek(0);
  rows();
}

async function opened(v) { // MPEG program streams and some others are read to their end before they can be shown
  let waiting = true;
  const counting = setInterval(() => guard(ask("/counted").then(({ pictures }) => waiting &&
    say(`opening ${v.name}/${v.camera}` + (pictures ? `: this kind of file must be counted, ${pictures} pictures so far` : "")))), 700);
  try { return await ask("/info?" + query(v)); } finally {
    waiting = false;
    clearInterval(counting);
    if ($("status").textContent.startsWith("opening ")) say("");
  }
}

// ---- pictures
const fetchFrame = latest(async () => {
  const v = view(), n = S.n;
  const image = await ask("/frame?" + query(v, { n, low: $("low").value, high: $("high").value }));
  if (v === view()) { S.image = image; draw(); }
  if (n === S.n) fetchMask();
});
const fetchMask = latest(async () => {
  const v = view(), asked = query(v, { n: S.n, detect: JSON.stringify(detect(v)) });
  if (!$("show").checked || (S.maskImage && S.maskOf === asked)) return;
  const image = await ask("/mask?" + asked);
  if (v === view()) { S.maskImage = image; S.maskOf = asked; draw(); }
});
async function seek(n) {
  S.n = Math.min(Math.max(Math.round(n), 0), S.info.frames - 1);
  $("slider").value = S.n;
  $("frame").textContent = `frame ${S.n} of ${S.info.frames}, ${(S.n / S.info.rate).toFixed(3)} s`;
  fetchFrame();
  epipolar();
}
function fit() {
  const c = $("picture"), room = $("pictures"), ratio = S.info.width / S.info.height;
  // beside or above each other, whichever shows both pictures larger
  room.className = $("show").checked && ratio > room.clientWidth / room.clientHeight ? "stacked" : "";
  S.scale = Math.min(c.clientWidth / S.info.width, c.clientHeight / S.info.height);
  S.x = (c.clientWidth - S.scale * S.info.width) / 2 + S.scale / 2;
  S.y = (c.clientHeight - S.scale * S.info.height) / 2 + S.scale / 2;
  draw();
}
const toScreen = (x, y) => [S.scale * x + S.x, S.scale * y + S.y]; // px of the frame buffer: pixel centres are whole
const toPicture = (x, y) => [(x - S.x) / S.scale, (y - S.y) / S.scale];
function zoom(factor, x, y) {
  const [px, py] = toPicture(x, y);
  S.scale = Math.min(Math.max(S.scale * factor, 0.05), 60);
  S.x = x - S.scale * px; S.y = y - S.scale * py;
  draw();
}
function draw() {
  if (!S.info) return;
  for (const [id, image] of [["picture", S.image], ["mask", S.maskImage]]) {
    const c = $(id), ratio = window.devicePixelRatio || 1;
    if (c.hidden) continue;
    const w = Math.round(c.clientWidth * ratio), h = Math.round(c.clientHeight * ratio);
    if (c.width !== w || c.height !== h) { c.width = w; c.height = h; }
    const g = c.getContext("2d");
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.fillStyle = "#333"; g.fillRect(0, 0, c.clientWidth, c.clientHeight);
    g.imageSmoothingEnabled = S.scale < 2;
    if (image) {
      const [x, y] = toScreen(-0.5, -0.5);
      g.drawImage(image, x, y, S.scale * S.info.width, S.scale * S.info.height);
    }
    overlay(g);
  }
}
function overlay(g) {
  const v = view();
  g.lineWidth = 1.5; g.font = "12px system-ui";
  for (const curve of S.curves) {
    g.strokeStyle = "#ff9d00"; g.beginPath();
    curve.points.forEach((p, i) => { const [x, y] = toScreen(...p); i ? g.lineTo(x, y) : g.moveTo(x, y); });
    g.stroke();
    g.fillStyle = "#ff9d00";
    const middle = curve.points[Math.floor(curve.points.length / 2)];
    g.fillText(curve.name, ...toScreen(...middle));
  }
  if (v.kind === "clip") for (const p of (S.labels[v.camera] || { points: [] }).points) {
    if (p.clip !== v.name || p.Xf === null) continue;
    const [x, y] = toScreen(p.Xf, p.Yf), bad = wrong(v.camera, p);
    g.strokeStyle = g.fillStyle = bad ? "#ff2d55" : "#35c759";
    g.beginPath(); g.arc(x, y, bad ? 11 : 7, 0, 7); g.stroke();
    g.fillText(p.tag, x + 9, y - 6);
    if (p.residual_x !== null) {
      g.beginPath(); g.moveTo(x, y); g.lineTo(x + 50 * p.residual_x, y + 50 * p.residual_y); g.stroke();
    }
  }
  v.rows.forEach((r, i) => {
    const [x, y] = toScreen(r.Xf, r.Yf), on = i === S.chosen;
    g.strokeStyle = g.fillStyle = on ? "#ffd60a" : "#5ac8fa";
    if (v.kind === "clip") {
      g.beginPath(); g.moveTo(x - 9, y); g.lineTo(x + 9, y); g.moveTo(x, y - 9); g.lineTo(x, y + 9); g.stroke();
      g.fillText(r.tag + (r.sd ? " (by hand)" : ""), x + 9, y + 14);
    } else {
      const [w, h] = size(r).map((d) => d * S.scale);
      g.strokeRect(x - w / 2, y - h / 2, w, h);
      if (on) for (const [cx, cy] of corners(r)) g.fillRect(cx - 4, cy - 4, 8, 8);
      g.fillText(r.target, x - w / 2, y - h / 2 - 4);
    }
  });
  if (S.draft) {
    const [x, y] = toScreen(S.draft[0], S.draft[1]), [u, w] = toScreen(S.draft[2], S.draft[3]);
    g.strokeStyle = "#ffd60a"; g.strokeRect(Math.min(x, u), Math.min(y, w), Math.abs(u - x), Math.abs(w - y));
  }
  if (S.blob) {
    const [x, y] = toScreen(S.blob.Xf, S.blob.Yf);
    g.strokeStyle = "#ffffff"; g.beginPath(); g.arc(x, y, 3, 0, 7); g.stroke();
    const [l, t] = toScreen(S.blob.left - 0.5, S.blob.top - 0.5);
    g.setLineDash([3, 3]); g.strokeRect(l, t, S.blob.width * S.scale, S.blob.height * S.scale); g.setLineDash([]);
  }
}
const size = (r) => [r.width || view().detect.box[0], r.height || view().detect.box[1]];
function corners(r) {
  const [w, h] = size(r);
  return [[-1, -1], [1, -1], [-1, 1], [1, 1]].map(([i, j]) => toScreen(r.Xf + i * w / 2, r.Yf + j * h / 2));
}
function wrong(camera, p) {
  const rms = S.labels[camera].rms;
  return !p.used || (rms && p.residual_x !== null && Math.hypot(p.residual_x, p.residual_y) > 4 * rms);
}

// ---- measuring
const measure = latest(async (x, y) => {
  const v = view(), r = v.kind === "run" && S.chosen >= 0 ? v.rows[S.chosen] : null;
  const given = { ...place(v), n: S.n, detect: detect(v) };
  if (r) { const [w, h] = size(r); given.box = [r.Xf - w / 2, r.Yf - h / 2, w, h]; }
  else Object.assign(given, { x, y, reach: 3 });
  const found = await ask("/measure", given);
  S.blob = found.blobs[0] || null;
  $("count").textContent = `${found.all} blob${found.all === 1 ? "" : "s"} in the picture`;
  fillMeasure(x, y, found.blobs.length, r);
  draw();
});
function fillMeasure(x, y, n, r) {
  const b = S.blob, f = (value, d) => (value === null || value === undefined ? "" : value.toFixed(d));
  const lines = [["cursor", `${f(x, 1)}, ${f(y, 1)} px`]];
  if (r) lines.push([`in box ${r.target}`, `${n} blob${n === 1 ? "" : "s"}`]);
  if (b) lines.push(["centroid", `${f(b.Xf, 2)}, ${f(b.Yf, 2)} px`], ["pixels", b.pixels], ["contrast", f(b.contrast, 0)],
    ["predicted sd", `${f(b.sd_x, 3)}, ${f(b.sd_y, 3)} px`]);
  if (b && (b.edge || b.saturated)) lines.push(["flag", [b.edge && "edge", b.saturated && "saturated"].filter(Boolean).join(", ")]);
  table($("measure"), lines);
}
function table(where, lines, rowsOf) {
  where.replaceChildren(...lines.map((cells, i) => {
    const tr = document.createElement("tr");
    for (const cell of cells) { const td = document.createElement("td"); td.textContent = cell; tr.append(td); }
    if (rowsOf) rowsOf(tr, i);
    return tr;
  }));
}

// ---- changes
function change(work) {
  S.undo.push(snapshot()); S.redo = [];
  work();
  changed();
}
const snapshot = () => JSON.stringify({ rows: S.views.map((v) => v.rows), tried: S.tried, tags: S.tagTexts });
function restore(text) {
  const kept = JSON.parse(text);
  S.views.forEach((v, i) => { v.rows = kept.rows[i]; });
  S.tried = kept.tried; S.tagTexts = kept.tags; S.chosen = -1;
  fillDetect(); changed();
}
function undo() { if (S.undo.length) { S.redo.push(snapshot()); restore(S.undo.pop()); } }
function redo() { if (S.redo.length) { S.undo.push(snapshot()); restore(S.redo.pop()); } }
let soon = 0;
function changed() {
  fillTags(); fillTargets(); rows(); listViews(); draw(); fetchMask();
  clearTimeout(soon);
  const v = view();
  if (v.kind === "clip") soon = setTimeout(() => guard(label(v.camera)), 250); else epipolar();
}
function dirty() {
  return S.views.some((v) => JSON.stringify(v.rows) !== v.saved) || Object.keys(S.tried).length || Object.keys(S.tagTexts).length;
}
const asked = {};
async function label(camera) { // of answers that overtake each other only that to the last question counts
  const own = clips(camera), n = picked(camera), turn = asked[camera] = (asked[camera] || 0) + 1;
  if (!own.length || (n < NEED && !own.some((v) => v.name in S.tagTexts))) {
    delete S.labels[camera]; rows(); listViews(); draw(); return;
  }
  const picks = Object.fromEntries(own.map((v) => [v.name, v.rows])), unsaved = {};
  for (const v of own) {
    unsaved[v.name] = { detect: tried(v) };
    if (v.name in S.tagTexts) unsaved[v.name].tags = S.tagTexts[v.name];
  }
  const found = await ask("/label", { camera, picks, clips: unsaved });
  if (turn !== asked[camera]) return;
  for (const v of own) v.tags = found.tags[v.name];
  if (n >= NEED) S.labels[camera] = found; else delete S.labels[camera];
  fillTags();
  rows(); listViews(); draw(); epipolar();
}
const epipolar = latest(async () => {
  const v = view();
  S.curves = [];
  if (v.kind !== "run") return;
  const curves = [];
  for (const other of S.views.filter((o) => o.kind === "run" && o.name === v.name && o.camera !== v.camera))
    for (const r of other.rows) {
      const found = await ask("/epipolar", { camera: other.camera, x: r.Xf, y: r.Yf });
      for (const points of found[v.camera] || []) curves.push({ points, name: `${r.target} (${other.camera})` });
    }
  if (v === view()) { S.curves = curves; draw(); }
});
function fillTags() {
  const v = view();
  if (v.kind !== "clip") return;
  const done = new Set(clips(v.camera).flatMap((o) => o.rows.map((r) => r.tag)));
  const left = v.tags.filter((tag) => !done.has(tag)), before = $("tag").value;
  $("tag").replaceChildren(...left.map((tag) => new Option(tag)));
  if (left.includes(before)) $("tag").value = before;
  if (document.activeElement !== $("tags")) $("tags").value = S.tagTexts[v.name] ?? v.text;
}
function fillTargets() {
  const v = view();
  if (v.kind !== "run") return;
  const names = [...new Set([...v.targets, ...S.views.filter((o) => group(o) === group(v)).flatMap((o) => o.rows.map((r) => r.target))])];
  $("targets").replaceChildren(...names.map((name) => new Option(name)));
  const free = names.find((name) => !v.rows.some((r) => r.target === name));
  let i = 1;
  while (v.rows.some((r) => r.target === "t" + i)) i += 1;
  $("target").value = free || "t" + i;
}
function rows() {
  const v = view();
  if (!v) return;
  const choose = (tr, i) => {
    tr.dataset.i = i;
    tr.className = i === S.chosen ? "chosen" : "";
    tr.onclick = () => { S.chosen = i; rows(); draw(); };
  };
  if (v.kind === "run") {
    table($("boxrows"), v.rows.map((r) => [r.target, `${r.Xf.toFixed(1)}, ${r.Yf.toFixed(1)}`, size(r).map((d) => d.toFixed(0)).join(" x ")]), choose);
    list($("problems"), []);
    return;
  }
  const own = S.labels[v.camera], by = Object.fromEntries((own ? own.points : []).filter((p) => p.clip === v.name).map((p) => [p.tag, p]));
  const lines = v.rows.map((r) => {
    const p = by[r.tag], off = p && p.residual_x !== null ? Math.hypot(p.residual_x, p.residual_y).toFixed(2) + " px" : p ? p.reason : "";
    return [r.tag, `${r.Xf.toFixed(1)}, ${r.Yf.toFixed(1)}`, off];
  });
  table($("rows"), lines, (tr, i) => { choose(tr, i); const p = by[v.rows[i].tag]; if (p && wrong(v.camera, p)) tr.className += " wrong"; });
  const n = picked(v.camera), count = own ? own.points.filter((p) => p.Xf !== null).length : 0;
  $("named").textContent = own
    ? `${count} of ${own.points.length} points of ${v.camera} are named` + (own.rms ? `, ${own.rms.toFixed(3)} px rms` : "")
    : `${n} picked; from ${NEED} on, in all clips of ${v.camera} together, the rest are named`;
  const odd = own ? own.points.filter((p) => p.Xf !== null && wrong(v.camera, p)).map((p) => `${p.clip}, tag ${p.tag}: ${p.reason || "far off"}`) : [];
  list($("problems"), own ? [...own.problems, ...odd] : []);
}
function list(where, lines) {
  where.replaceChildren(...lines.map((text) => { const li = document.createElement("li"); li.textContent = text; return li; }));
}
function fillDetect() {
  const d = detect(view());
  $("polarity").value = d.polarity; $("threshold").value = d.threshold; $("min_pixels").value = d.min_pixels;
  if (d.threshold !== "auto") $("level").value = d.threshold;
}
function tryOut(key, value) {
  const v = view();
  change(() => {
    const own = { ...tried(v), [key]: value };
    if (own[key] === v.detect[key]) delete own[key];
    if (Object.keys(own).length) S.tried[group(v)] = own; else delete S.tried[group(v)];
    fillDetect();
  });
}
async function save() {
  const tables = S.views.filter((v) => JSON.stringify(v.rows) !== v.saved)
    .map((v) => ({ ...place(v), rows: v.rows, version: v.version }));
  const changes = Object.entries(S.tried).map(([key, own]) => {
    const [kind, ...name] = key.split("/");
    return { kind, name: name.join("/"), changes: own };
  });
  if (!tables.length && !changes.length && !Object.keys(S.tagTexts).length) { say("nothing to save"); return; }
  say("saving");
  take(await ask("/save", { tables, detect: changes, tags: S.tagTexts, config: S.config }));
  say("saved");
  fillDetect(); rows(); listViews(); draw();
  list($("plan"), ["looking"]);
  list($("plan"), (await ask("/plan")).lines);
}

// ---- mouse
function at(event) {
  const box = event.currentTarget.getBoundingClientRect();
  return [event.clientX - box.left, event.clientY - box.top];
}
function under(x, y) { // what of the rows lies at a place of the screen
  const v = view();
  if (v.kind === "clip") {
    const i = v.rows.findIndex((r) => { const [a, b] = toScreen(r.Xf, r.Yf); return Math.hypot(a - x, b - y) < 9; });
    return i < 0 ? null : { i, how: "move" };
  }
  if (S.chosen >= 0) {
    const c = corners(v.rows[S.chosen]).findIndex(([a, b]) => Math.hypot(a - x, b - y) < 9);
    if (c >= 0) return { i: S.chosen, how: "size", corner: c };
  }
  const [px, py] = toPicture(x, y);
  const i = v.rows.findIndex((r) => { const [w, h] = size(r); return Math.abs(px - r.Xf) < w / 2 && Math.abs(py - r.Yf) < h / 2; });
  return i < 0 ? null : { i, how: "move" };
}
let space = false;
function down(event) {
  const [x, y] = at(event), [px, py] = toPicture(x, y);
  event.currentTarget.setPointerCapture(event.pointerId);
  $("picture").focus();
  if (event.button || space) { S.drag = { how: "pan", x, y }; return; }
  const found = under(x, y);
  if (found) {
    S.chosen = found.i;
    S.drag = { ...found, px, py, from: { ...view().rows[found.i] }, before: snapshot(), moved: false };
    rows(); draw();
  } else S.drag = { how: "new", px, py, x, y };
}
function move(event) {
  const [x, y] = at(event), [px, py] = toPicture(x, y), d = S.drag;
  if (!d) { measure(px, py); return; }
  if (d.how === "pan") { S.x += x - d.x; S.y += y - d.y; d.x = x; d.y = y; draw(); return; }
  if (d.how === "new") { if (view().kind === "run") { S.draft = [d.px, d.py, px, py]; draw(); } return; }
  const r = view().rows[d.i];
  d.moved = true;
  if (d.how === "move") { r.Xf = d.from.Xf + px - d.px; r.Yf = d.from.Yf + py - d.py; }
  else {
    const [w, h] = [d.from.width || size(d.from)[0], d.from.height || size(d.from)[1]], i = d.corner % 2 ? 1 : -1, j = d.corner > 1 ? 1 : -1;
    const fx = d.from.Xf - i * w / 2, fy = d.from.Yf - j * h / 2;
    r.width = Math.max(4, Math.abs(px - fx)); r.height = Math.max(4, Math.abs(py - fy));
    r.Xf = (px + fx) / 2; r.Yf = (py + fy) / 2;
  }
  draw();
}
async function up(event) {
  const d = S.drag, v = view();
  if (!d) return;
  const [x, y] = at(event), [px, py] = toPicture(x, y);
  S.drag = S.draft = null;
  if (d.how === "pan") return;
  if (d.how === "new") {
    if (v.kind === "run") newBox(d, px, py); else if (Math.hypot(x - d.x, y - d.y) < 5) await newPick(px, py);
    return;
  }
  if (!d.moved) return;
  const r = v.rows[d.i];
  if (v.kind === "clip" && !r.sd) Object.assign(r, await snapped(v, r.Xf, r.Yf) || {});
  S.undo.push(d.before); S.redo = [];
  changed();
}
async function snapped(v, x, y) { // the blob at a place, as the stages find it
  const found = await ask("/measure", { ...place(v), n: S.n, detect: detect(v), x, y, reach: Math.max(3, 12 / S.scale), click: true });
  S.blob = found.blobs[0] || null;
  fillMeasure(x, y, found.blobs.length, null);
  return S.blob && { Xf: round(S.blob.Xf), Yf: round(S.blob.Yf) };
}
const round = (value) => Math.round(value * 100) / 100;
async function newPick(x, y) {
  const v = view(), tag = $("tag").value;
  if (!tag) { say(S.tags.length ? "every tag of this clip is picked" : "points.csv lists no points yet", true); return; }
  const began = performance.now(), byHand = $("hand").checked;
  const row = byHand ? { Xf: round(x), Yf: round(y), sd: Number($("sd").value) || 0.5 } : await snapped(v, x, y);
  if (!row) { say("no blob there: correct the threshold, or place the point by hand", true); return; }
  change(() => { v.rows.push({ tag, ...row }); S.chosen = v.rows.length - 1; });
  S.answered = performance.now() - began;
  say(`tag ${tag} at (${row.Xf.toFixed(2)}, ${row.Yf.toFixed(2)})`);
}
function newBox(d, x, y) {
  const v = view(), name = $("target").value.trim();
  const w = Math.abs(x - d.px), h = Math.abs(y - d.py);
  if (w * S.scale < 6 || h * S.scale < 6) { S.chosen = -1; rows(); draw(); return; }
  if (!name || v.rows.some((r) => r.target === name)) { say("give the box a name of its own", true); return; }
  change(() => {
    v.rows.push({ target: name, Xf: round((x + d.px) / 2), Yf: round((y + d.py) / 2), width: round(w), height: round(h) });
    S.chosen = v.rows.length - 1;
  });
}
function remove() {
  if (S.chosen >= 0) change(() => { view().rows.splice(S.chosen, 1); S.chosen = -1; });
}

// ---- wiring
for (const id of ["picture", "mask"]) {
  const c = $(id);
  c.onpointerdown = down; c.onpointermove = move; c.onpointerup = (event) => guard(up(event));
  c.oncontextmenu = (event) => event.preventDefault();
  c.addEventListener("wheel", (event) => { event.preventDefault(); zoom(Math.exp(-event.deltaY / 400), ...at(event)); }, { passive: false });
}
$("slider").oninput = () => guard(seek(Number($("slider").value)));
$("before").onclick = () => guard(seek(S.n - 1));
$("after").onclick = () => guard(seek(S.n + 1));
$("low").onchange = $("high").onchange = () => fetchFrame();
$("fit").onclick = fit;
$("show").onchange = () => { $("mask").hidden = !$("show").checked; fetchMask(); fit(); };
$("undo").onclick = undo; $("redo").onclick = redo; $("save").onclick = () => guard(save());
$("polarity").onchange = () => tryOut("polarity", $("polarity").value);
$("threshold").onchange = () => {
  const text = $("threshold").value.trim(), level = Number(text);
  if (text === "auto" || (text && level >= 0 && level <= 255)) tryOut("threshold", text === "auto" ? "auto" : level);
  else { say("threshold: auto, or a grey level from 0 to 255", true); fillDetect(); }
};
$("level").onchange = () => tryOut("threshold", Number($("level").value));
$("min_pixels").onchange = () => { const n = Math.round(Number($("min_pixels").value)); if (n >= 1) tryOut("min_pixels", n); else fillDetect(); };
$("tags").onchange = () => change(() => { S.tagTexts[view().name] = $("tags").value.trim(); });
window.onresize = () => { if (S.info) fit(); };
window.onbeforeunload = (event) => { if (dirty()) event.preventDefault(); };
document.onkeydown = (event) => {
  const key = event.key, typing = ["INPUT", "SELECT"].includes(event.target.tagName) && event.target.type !== "range";
  if ((event.ctrlKey || event.metaKey) && ["z", "y", "s"].includes(key.toLowerCase())) {
    event.preventDefault();
    ({ z: undo, y: redo, s: () => guard(save()) })[key.toLowerCase()]();
    return;
  }
  if (typing || event.ctrlKey || event.metaKey) return;
  const c = $("picture"), middle = [c.clientWidth / 2, c.clientHeight / 2], d = detect(view());
  const level = d.threshold === "auto" ? 128 : d.threshold;
  const keys = { ArrowLeft: () => guard(seek(S.n - (event.shiftKey ? 10 : 1))), ArrowRight: () => guard(seek(S.n + (event.shiftKey ? 10 : 1))),
    "+": () => zoom(1.3, ...middle), "-": () => zoom(1 / 1.3, ...middle), 0: fit, Delete: remove, Backspace: remove,
    n: () => { $("tag").selectedIndex = ($("tag").selectedIndex + 1) % Math.max($("tag").length, 1); },
    m: () => { $("show").checked = !$("show").checked; $("show").onchange(); }, " ": () => { space = true; },
    "[": () => tryOut("threshold", Math.max(0, level - 2)), "]": () => tryOut("threshold", Math.min(255, level + 2)) };
  const work = keys[key] || keys[key.toLowerCase()];
  if (work) { event.preventDefault(); work(); }
};
document.onkeyup = (event) => { if (event.key === " ") space = false; };
window.vidtrack = { state: S, toScreen, picture: $("picture") };
guard(load());
