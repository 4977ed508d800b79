"use strict";
// The live parts of a page: a space view that turns, series that zoom and share a cursor, tables that sort and copy.
(function () {
  document.documentElement.classList.add("live");
  const style = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const shown = value => value === null || value === undefined ? "–" : String(+(+value).toPrecision(6));
  const make = (tag, parent, attributes, text) => {
    const node = document.createElement(tag);
    for (const [key, value] of Object.entries(attributes || {})) node.setAttribute(key, value);
    if (text !== undefined) node.textContent = text;
    parent.append(node);
    return node;
  };
  // The colour of a line as text: nearer to the ink, so that it is read on paper and on a dark screen.
  function readable(colour) {
    const parts = hex => [1, 3, 5].map(i => parseInt(hex.slice(i, i + 2), 16));
    const ink = style("--ink"), whole = ink.length === 4 ? "#" + [...ink.slice(1)].map(c => c + c).join("") : ink;
    if (!/^#[0-9a-f]{6}$/i.test(colour) || !/^#[0-9a-f]{6}$/i.test(whole)) return colour;
    const to = parts(whole);
    return "rgb(" + parts(colour).map((v, i) => Math.round(0.6 * v + 0.4 * to[i])).join(",") + ")";
  }
  function clock(seconds) {
    if (Math.abs(seconds) < 100) return seconds.toFixed(3) + " s";
    const two = value => String(Math.floor(value)).padStart(2, "0");
    return two(seconds / 3600) + ":" + two(seconds / 60 % 60) + ":" + (seconds % 60 < 10 ? "0" : "") + (seconds % 60).toFixed(3);
  }
  function fitted(canvas, height) {
    unseen.delete(canvas);
    const ratio = window.devicePixelRatio || 1, width = canvas.parentNode.clientWidth || 900;
    canvas.width = width * ratio;
    canvas.height = height * ratio;
    canvas.style.width = width + "px";
    canvas.style.height = height + "px";
    const pen = canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.font = "12px system-ui, sans-serif";
    return [pen, width];
  }
  // What is out of sight is drawn when it comes into sight: a page of many series opens at once.
  const redraws = new Map();
  const near = canvas => {
    const box = canvas.getBoundingClientRect();
    return box.bottom > -innerHeight && box.top < 2 * innerHeight;
  };
  const drawAll = () => redraws.forEach((draw, canvas) => { near(canvas) ? draw() : unseen.add(canvas); });
  const unseen = new Set();
  const drawn = (canvas, draw) => { redraws.set(canvas, draw); unseen.add(canvas); };
  const drawSeen = () => unseen.forEach(canvas => { if (near(canvas)) redraws.get(canvas)(); });
  window.addEventListener("scroll", drawSeen, {passive: true});

  function space(stage, data, title) {
    const help = "Drag or use the arrow keys to turn, wheel or + and - to zoom, shift and drag to move.";
    const canvas = make("canvas", stage, {role: "img", tabindex: "0", style: "height: 480px", "aria-label": title + ". " + help});
    const bar = make("div", stage, {class: "controls"});
    const view = {turn: -0.9, tilt: 0.42, zoom: 1, x: 0, y: 0, at: 0, near: false};
    for (const [name, turn, tilt] of [["turned", -0.9, 0.42], ["from above", 0, Math.PI / 2], ["along y", 0, 0], ["along x", -Math.PI / 2, 0]]) {
      make("button", bar, {type: "button"}, name).addEventListener("click", () => { Object.assign(view, {turn, tilt, zoom: 1, x: 0, y: 0}); draw(); });
    }
    if (data.tracks.some(track => track.p.some(p => p))) {
      for (const [name, near] of [["paths", true], ["all", false]]) {
        make("button", bar, {type: "button", title: near ? "Fit the paths into the view" : "Fit everything into the view"}, name)
          .addEventListener("click", () => { Object.assign(view, {near, zoom: 1, x: 0, y: 0}); draw(); });
      }
    }
    const whole = make("label", bar, {});
    const box = make("input", whole, {type: "checkbox"});
    whole.append(" cameras");
    box.checked = data.cameras.length > 0;
    box.addEventListener("change", () => draw());
    let output = null;
    if (data.times.length > 1) {
      const label = make("label", bar, {class: "time"}, "time ");
      const slider = make("input", label, {type: "range", "aria-label": "time", min: 0, max: data.times.length - 1, value: 0});
      output = make("output", label, {});
      slider.addEventListener("input", () => { view.at = +slider.value; draw(); });
    }
    make("p", stage, {class: "help"}, help);
    function draw() {
      const height = 480, [pen, width] = fitted(canvas, height);
      const bounds = [[Infinity, -Infinity], [Infinity, -Infinity], [Infinity, -Infinity]];
      const grow = p => p && p.forEach((v, i) => { bounds[i][0] = Math.min(bounds[i][0], v); bounds[i][1] = Math.max(bounds[i][1], v); });
      if (!view.near) data.points.forEach(grow);
      data.tracks.forEach(track => track.p.forEach(grow));
      if (box.checked && !view.near) data.cameras.forEach(camera => grow(camera.centre));
      const middle = bounds.map(([low, high]) => (low + high) / 2);
      const radius = Math.hypot(...bounds.map(([low, high]) => (high - low) / 2)) || 1;
      const scale = 0.56 * Math.min(width, height) / radius * view.zoom;
      const [ca, sa, ce, se] = [Math.cos(view.turn), Math.sin(view.turn), Math.cos(view.tilt), Math.sin(view.tilt)];
      const flat = p => {
        const [dx, dy, dz] = p.map((v, i) => v - middle[i]);
        return [width / 2 + view.x + scale * (ca * dx + sa * dy), height / 2 + view.y - scale * (-sa * se * dx + ca * se * dy + ce * dz)];
      };
      const line = (points, colour, thickness) => {
        pen.strokeStyle = colour;
        pen.lineWidth = thickness;
        pen.beginPath();
        let drawing = false;
        for (const p of points) {
          if (!p) { drawing = false; continue; }
          const [x, y] = flat(p);
          drawing ? pen.lineTo(x, y) : pen.moveTo(x, y);
          drawing = true;
        }
        pen.stroke();
      };
      const dot = (p, colour, size) => { const [x, y] = flat(p); pen.fillStyle = colour; pen.beginPath(); pen.arc(x, y, size, 0, 7); pen.fill(); };
      const written = [];
      const word = (p, text, colour) => {
        const [x, y] = flat(p), wide = pen.measureText(text).width;
        let at = y - 5;
        while (written.some(([u, v, w]) => x < u + w + 4 && u < x + wide + 4 && Math.abs(at - v) < 13)) at += 13;
        written.push([x, at, wide]);
        pen.fillStyle = readable(colour);
        pen.fillText(text, x + 7, at);
      };
      const ink = style("--ink"), faint = style("--faint");
      data.hull.forEach(([i, j]) => line([data.points[i], data.points[j]], faint, 0.6));
      data.points.forEach(p => dot(p, faint, 1.6));
      if (box.checked) data.cameras.forEach(camera => {
        line([...camera.corners, camera.corners[0]], camera.colour, 1);
        camera.corners.forEach(corner => line([camera.centre, corner], camera.colour, 1));
        dot(camera.centre, camera.colour, 4);
        word(camera.centre, camera.name, camera.colour);
      });
      const corner = bounds.map(([low]) => low), long = radius / 4;
      ["x", "y", "z"].forEach((name, i) => {
        const end = corner.map((v, k) => v + (k === i ? long : 0));
        line([corner, end], ink, 1.2);
        word(end, name, ink);
      });
      data.tracks.forEach(track => {
        line(track.p, track.colour, 1.2);
        const p = track.p[view.at], s = track.s[view.at];
        if (!p) return;
        dot(p, track.colour, 3.5);
        word(p, track.name, track.colour);
        if (!s) return;
        for (const [i, j] of [[0, 1], [0, 2], [1, 2]]) {
          const ring = [];
          for (let k = 0; k <= 36; k++) {
            const q = p.slice();
            q[i] += data.magnified * s[i] * Math.cos(k * Math.PI / 18);
            q[j] += data.magnified * s[j] * Math.sin(k * Math.PI / 18);
            ring.push(q);
          }
          line(ring, track.colour, 0.8);
        }
      });
      const step = Math.pow(10, Math.floor(Math.log10(150 / scale)));
      pen.strokeStyle = ink;
      pen.lineWidth = 2;
      pen.beginPath();
      pen.moveTo(16, height - 16);
      pen.lineTo(16 + step * scale, height - 16);
      pen.stroke();
      pen.fillStyle = ink;
      pen.fillText(shown(step) + " " + data.units, 16, height - 22);
      if (output) output.textContent = clock(data.t0 + data.times[view.at]);
    }
    let from = null;
    canvas.addEventListener("pointerdown", event => { from = event; canvas.setPointerCapture(event.pointerId); });
    canvas.addEventListener("pointerup", () => { from = null; });
    canvas.addEventListener("pointermove", event => {
      if (!from) return;
      const dx = event.clientX - from.clientX, dy = event.clientY - from.clientY;
      if (event.shiftKey) { view.x += dx; view.y += dy; } else { view.turn -= dx / 180; view.tilt = Math.max(-1.571, Math.min(1.571, view.tilt + dy / 180)); }
      from = event;
      draw();
    });
    canvas.addEventListener("wheel", event => { event.preventDefault(); view.zoom *= Math.exp(-event.deltaY / 600); draw(); }, {passive: false});
    canvas.addEventListener("keydown", event => {
      const act = {ArrowLeft: () => { view.turn -= 0.1; }, ArrowRight: () => { view.turn += 0.1; }, ArrowUp: () => { view.tilt += 0.1; },
        ArrowDown: () => { view.tilt -= 0.1; }, "+": () => { view.zoom *= 1.2; }, "-": () => { view.zoom /= 1.2; }}[event.key];
      if (act) { event.preventDefault(); act(); draw(); }
    });
    drawn(canvas, draw);
  }

  // All series of a page share the part of time that is shown, and the cursor.
  const time = {low: null, high: null, cursor: null};
  function series(stage, data, title) {
    const help = "Drag over a part of time to zoom, double-click or 0 for all of it; arrow keys move the cursor, + and - zoom.";
    const every = data.panels.flatMap(panel => panel.lines.flatMap(one => one.t));
    const ends = [every.reduce((a, b) => Math.min(a, b), Infinity) + data.t0, every.reduce((a, b) => Math.max(a, b), -Infinity) + data.t0];
    const low = () => time.low === null ? ends[0] : time.low, high = () => time.high === null ? ends[1] : time.high;
    const left = 68, right = 12;
    data.panels.forEach((panel, index) => {
      const canvas = make("canvas", stage, {role: "img", tabindex: "0", style: "height: 150px", "aria-label": title + ": " + panel.label + " against time. " + help});
      const reading = make("p", stage, {class: "reading"}, "");
      const last = index === data.panels.length - 1;
      let drag = null;
      function draw() {
        const height = last ? 170 : 150, [pen, width] = fitted(canvas, height), foot = height - (last ? 34 : 12);
        const t0 = low() - data.t0, t1 = high() - data.t0, place = t => left + (width - left - right) * (t - t0) / (t1 - t0 || 1);
        let least = Infinity, most = -Infinity;
        panel.lines.forEach(one => one.t.forEach((t, i) => {
          if (t >= t0 && t <= t1 && one.y[i] !== null) {
            const wide = 2 * ((one.sd && one.sd[i]) || 0);
            least = Math.min(least, one.y[i] - wide);
            most = Math.max(most, one.y[i] + wide);
          }
        }));
        if (!(most > least)) { least -= 1; most += 1; }
        if (!isFinite(least)) { least = 0; most = 1; }
        const pad = 0.06 * (most - least), rise = v => foot - (foot - 8) * (v - least + pad) / (most - least + 2 * pad);
        pen.strokeStyle = style("--line");
        pen.fillStyle = style("--faint");
        pen.lineWidth = 1;
        const steps = (a, b, n) => { const raw = (b - a) / n, power = Math.pow(10, Math.floor(Math.log10(raw))); return power * [1, 2, 5, 10].find(s => s * power >= raw); };
        const dv = steps(least, most, 5), dt = steps(t0, t1, 8);
        pen.textAlign = "right";
        for (let v = Math.ceil(least / dv) * dv; v <= most; v += dv) {
          pen.beginPath(); pen.moveTo(left, rise(v)); pen.lineTo(width - right, rise(v)); pen.stroke();
          pen.fillText(shown(Math.abs(v) < dv / 1e6 ? 0 : v), left - 6, rise(v) + 4);
        }
        pen.textAlign = "center";
        for (let t = Math.ceil(t0 / dt) * dt; t <= t1; t += dt) {
          pen.beginPath(); pen.moveTo(place(t), 8); pen.lineTo(place(t), foot); pen.stroke();
          if (last) pen.fillText(shown(Math.abs(t) < dt / 1e6 ? 0 : t), place(t), foot + 15);
        }
        if (last) pen.fillText("time (s after " + clock(data.t0) + ")", (left + width) / 2, foot + 30);
        pen.textAlign = "left";
        pen.save();
        pen.translate(12, foot);
        pen.rotate(-Math.PI / 2);
        pen.fillStyle = style("--ink");
        pen.fillText(panel.label, 0, 0);
        pen.restore();
        pen.save();
        pen.beginPath(); pen.rect(left, 0, width - left - right, foot); pen.clip();
        panel.lines.forEach(one => {
          const colour = one.colour || style("--ink");
          if (one.sd) {
            pen.fillStyle = colour;
            pen.globalAlpha = 0.22;
            const known = i => i < one.t.length && one.y[i] !== null && one.sd[i] !== null;
            for (let a = 0, b; a < one.t.length; a = b + 1) {
              for (b = a; known(b); b++);
              pen.beginPath();
              for (let i = a; i < b; i++) pen.lineTo(place(one.t[i]), rise(one.y[i] + 2 * one.sd[i]));
              for (let i = b - 1; i >= a; i--) pen.lineTo(place(one.t[i]), rise(one.y[i] - 2 * one.sd[i]));
              pen.fill();
            }
            pen.globalAlpha = 1;
          }
          pen.strokeStyle = colour;
          pen.lineWidth = 1.2;
          pen.beginPath();
          let drawing = false;
          one.t.forEach((t, i) => {
            if (one.y[i] === null) { drawing = false; return; }
            drawing ? pen.lineTo(place(t), rise(one.y[i])) : pen.moveTo(place(t), rise(one.y[i]));
            drawing = true;
          });
          pen.stroke();
        });
        if (drag) { pen.fillStyle = style("--link"); pen.globalAlpha = 0.15; pen.fillRect(drag[0], 0, drag[1] - drag[0], foot); pen.globalAlpha = 1; }
        const words = panel.lines.map(one => {
          if (time.cursor === null) return one.name;
          const t = time.cursor - data.t0;
          let best = -1;
          one.t.forEach((value, i) => { if (best < 0 || Math.abs(value - t) < Math.abs(one.t[best] - t)) best = i; });
          return one.name + ": " + shown(one.y[best]);
        });
        if (time.cursor !== null) {
          pen.strokeStyle = style("--ink");
          pen.lineWidth = 1;
          const x = place(time.cursor - data.t0);
          pen.beginPath(); pen.moveTo(x, 0); pen.lineTo(x, foot); pen.stroke();
        }
        pen.restore();
        reading.replaceChildren();
        if (time.cursor !== null) make("span", reading, {}, clock(time.cursor));
        words.forEach((text, i) => make("span", reading, {style: "color:" + readable(panel.lines[i].colour || style("--ink"))}, text));
      }
      const at = event => low() + (high() - low()) * (event.offsetX - left) / (canvas.clientWidth - left - right);
      canvas.addEventListener("pointerdown", event => { drag = [event.offsetX, event.offsetX, at(event)]; canvas.setPointerCapture(event.pointerId); });
      canvas.addEventListener("pointermove", event => { time.cursor = Math.max(low(), Math.min(high(), at(event))); if (drag) drag[1] = event.offsetX; drawAll(); });
      canvas.addEventListener("pointerup", event => {
        if (drag && Math.abs(drag[1] - drag[0]) > 8) { const end = at(event); [time.low, time.high] = [Math.min(drag[2], end), Math.max(drag[2], end)]; }
        drag = null;
        drawAll();
      });
      canvas.addEventListener("pointerleave", () => { if (!drag) { time.cursor = null; drawAll(); } });
      canvas.addEventListener("dblclick", () => { time.low = time.high = null; drawAll(); });
      canvas.addEventListener("keydown", event => {
        const span = high() - low(), middle = time.cursor === null ? (low() + high()) / 2 : time.cursor;
        const zoom = by => { time.low = middle - span * by / 2; time.high = middle + span * by / 2; };
        const act = {ArrowLeft: () => { time.cursor = middle - span / 100; }, ArrowRight: () => { time.cursor = middle + span / 100; },
          "+": () => zoom(0.7), "-": () => zoom(1 / 0.7), "0": () => { time.low = time.high = null; }}[event.key];
        if (act) { event.preventDefault(); act(); drawAll(); }
      });
      drawn(canvas, draw);
    });
    make("p", stage, {class: "help"}, help + " The cursor is the same in all series." + (data.every > 1 ? " Every " + data.every + "th sample is shown." : ""));
  }

  for (const figure of document.querySelectorAll("figure[data-live]")) {
    const data = JSON.parse(figure.querySelector("script").textContent);
    (data.kind === "space" ? space : series)(figure.querySelector(".stage"), data, figure.querySelector("figcaption").textContent);
  }
  drawAll();
  // On paper nothing can be unfolded: what is worth knowing is printed.
  window.addEventListener("beforeprint", () => document.querySelectorAll("details:not(.about):not([open])").forEach(part => { part.open = true; part.dataset.folded = ""; }));
  window.addEventListener("afterprint", () => document.querySelectorAll("details[data-folded]").forEach(part => { part.open = false; delete part.dataset.folded; }));
  window.addEventListener("resize", drawAll);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawAll);

  // Numbers sort by their value: 1/24,100, 0.20 ± 0.01, 75 %, 3·10⁻⁶; what is none sorts by its letters, after them.
  function value(text) {
    const plain = text.replace(/[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+/g, power => [...power].map(c => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹".indexOf(c)).map(i => i ? i - 1 : "-").join(""))
      .replace(/·10/, "e").replace(/(\d),(?=\d{3}\b)/g, "$1");
    const share = /^1\/([\d.]+)/.exec(plain);
    const number = share ? 1 / share[1] : parseFloat(plain);
    return isNaN(number) ? null : number;
  }
  for (const table of document.querySelectorAll("table")) {
    const body = table.tBodies[0];
    [...table.tHead.rows[0].cells].forEach((head, column) => {
      const button = document.createElement("button");
      button.type = "button";
      button.title = "Sort by this column";
      button.append(...head.childNodes);
      head.append(button);
      button.addEventListener("click", () => {
        const down = head.getAttribute("aria-sort") === "ascending";
        for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
        head.setAttribute("aria-sort", down ? "descending" : "ascending");
        const key = row => row.cells[column].textContent.trim();
        const compared = (a, b) => {
          const [x, y] = [value(key(a)), value(key(b))];
          return x === null ? (y === null ? key(a).localeCompare(key(b), undefined, {numeric: true}) : 1) : y === null ? -1 : x - y;
        };
        body.append(...[...body.rows].sort((a, b) => down ? -compared(a, b) : compared(a, b)));
      });
    });
    const copy = make("button", table.parentNode, {type: "button", class: "copy", "aria-label": "copy the table " + table.caption.textContent.trim()}, "copy");
    copy.addEventListener("click", async () => {
      const text = [...table.rows].map(row => [...row.cells].map(cell => cell.textContent.trim()).join("\t")).join("\n");
      try {
        await navigator.clipboard.writeText(text);
      } catch {
        const area = make("textarea", document.body, {});
        area.value = text;
        area.select();
        document.execCommand("copy");
        area.remove();
      }
      copy.textContent = "copied";
      setTimeout(() => { copy.textContent = "copy"; }, 1500);
    });
  }
})();
